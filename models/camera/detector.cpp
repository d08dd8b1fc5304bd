#include <orrery/harness/kernel/hash.hpp>
#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/detector.hpp>
#include <orrery/models/camera/parallel_rows.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {

namespace {

constexpr double kInvertBelow = 30;
constexpr double kTrackLength_px = 6;     // mean
constexpr double kTrackElectrons = 1500;  // per pixel of track: 80 pairs per um of silicon
enum Purpose : std::uint64_t { kShot = 1, kRead = 2, kCosmic = 3 };

void check(const char* option, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument("Detector: " + std::string(option) + " = " + to_text(value) +
                                "; accepted: " + to_text(low) + " to " + to_text(high));
  }
}

void check(const DetectorOptions& o) {
  check("bits", o.bits, 8, 16);
  check("gain_electrons_per_DN", o.gain_electrons_per_DN, 0.01, 1e4);
  check("offset_DN", o.offset_DN, 0, (1 << o.bits) - 1);
  check("full_well_electrons", o.full_well_electrons, 100, 1e7);
  check("read_noise_electrons", o.read_noise_electrons, 0, 1000);
  check("dark_electrons_ps", o.dark_electrons_ps, 0, 1e6);
  check("dark_nonuniformity", o.dark_nonuniformity, 0, 1);
  check("response_nonuniformity", o.response_nonuniformity, 0, 0.3);
  check("hot_pixels_per_million", o.hot_pixels_per_million, 0, 1e5);
  check("hot_pixel_electrons_ps", o.hot_pixel_electrons_ps, 0, 1e7);
  check("bloom", o.bloom, 0, 1);
  check("cosmic_rays_ps", o.cosmic_rays_ps, 0, 1e5);
}

RandomStream row_stream(std::uint64_t frame_key, Purpose purpose, int row) {
  return RandomStream(hash_word(hash_word(frame_key, purpose), static_cast<std::uint64_t>(row)));
}

double inverted_poisson(double u, double mean) {
  double term = std::exp(-mean), sum = term;
  int k = 0;
  // Beyond 200 lies less than 1e-80 for a mean of 30: rounding has stopped the sum before that.
  while (u > sum && k < 200) {
    ++k;
    term *= mean / k;
    sum += term;
  }
  return k;
}

// What runs from row to row along one column, half of `bloom` of the excess each way.
void run_over(Image<float>& charge, int u, int begin, int end, int step, float full_well,
              const std::vector<float>& excess, float part) {
  float carried = 0;
  for (int v = begin; v != end; v += step) {
    const float room = std::max(0.0f, full_well - charge.at(u, v));
    const float stays = std::min(room, carried);
    charge.at(u, v) += stays;
    carried += part * excess[static_cast<std::size_t>(v)] - stays;
  }
}

}  // namespace

double poisson(RandomStream& stream, double mean) {
  if (!(mean > 0) || !std::isfinite(mean)) return 0;
  if (mean < kInvertBelow) return inverted_poisson(stream.uniform(), mean);
  const double z = stream.normal();
  return std::max(0.0, std::floor(mean + std::sqrt(mean) * z + (z * z - 1) / 6 + 0.5));
}

Detector::Detector(const DetectorOptions& options, int width_px, int height_px,
                   RandomStream& fixed_pattern)
    : options_(options) {
  check(options);
  response_ = Image<float>(width_px, height_px, 1);
  dark_ = Image<float>(width_px, height_px);
  for (std::size_t k = 0; k < dark_.values.size(); ++k) {
    const double response = fixed_pattern.normal(1, options.response_nonuniformity);
    const double dark = fixed_pattern.normal(1, options.dark_nonuniformity);
    response_.values[k] = static_cast<float>(std::max(0.0, response));
    dark_.values[k] = static_cast<float>(options.dark_electrons_ps * std::max(0.0, dark));
  }
  const double pixels = static_cast<double>(dark_.values.size());
  add_hot_pixels(static_cast<int>(std::lround(options.hot_pixels_per_million * 1e-6 * pixels)),
                 fixed_pattern);
}

void Detector::add_hot_pixels(int count, RandomStream& stream) {
  for (int k = 0; k < count; ++k) {
    const std::int64_t at = stream.integer(0, static_cast<std::int64_t>(dark_.values.size()) - 1);
    dark_.values[static_cast<std::size_t>(at)] +=
        static_cast<float>(stream.exponential(options_.hot_pixel_electrons_ps));
  }
}

DigitalImage Detector::read(const ElectronImage& light, double exposure_s, std::uint64_t frame_key,
                            int threads) const {
  if (light.width_px != dark_.width_px || light.height_px != dark_.height_px) {
    throw std::invalid_argument("Detector::read: light of " + std::to_string(light.width_px) +
                                " x " + std::to_string(light.height_px) + " px; expected " +
                                std::to_string(dark_.width_px) + " x " +
                                std::to_string(dark_.height_px));
  }
  Image<float> charge(light.width_px, light.height_px);
  collect(charge, light, exposure_s, frame_key, threads);
  add_cosmic_rays(charge, exposure_s, frame_key);
  saturate(charge);
  DigitalImage out(light.width_px, light.height_px);
  convert(out, charge, frame_key, threads);
  return out;
}

void Detector::collect(Image<float>& charge, const ElectronImage& light, double exposure_s,
                       std::uint64_t frame_key, int threads) const {
  const auto collect_rows = [&](int first, int end) {
    for (int v = first; v < end; ++v) {
      RandomStream stream = row_stream(frame_key, kShot, v);
      for (std::size_t k = light.index(0, v); k < light.index(0, v + 1); ++k) {
        const double mean = double(light.values[k]) * double(response_.values[k]) +
                            double(dark_.values[k]) * exposure_s;
        charge.values[k] = static_cast<float>(options_.shot_noise ? poisson(stream, mean) : mean);
      }
    }
  };
  for_bands_of_rows(threads, light.height_px, collect_rows);
}

// Straight tracks in any direction; each pixel that a step of a tenth of a pixel passes gets its
// part.
void Detector::add_cosmic_rays(Image<float>& charge, double exposure_s,
                               std::uint64_t frame_key) const {
  RandomStream stream = row_stream(frame_key, kCosmic, 0);
  const int rays = static_cast<int>(poisson(stream, options_.cosmic_rays_ps * exposure_s));
  for (int k = 0; k < rays; ++k) {
    double u = stream.uniform(-0.5, charge.width_px - 0.5);
    double v = stream.uniform(-0.5, charge.height_px - 0.5);
    const double angle = stream.uniform(0, 6.283185307179586);
    const double length = std::min(stream.exponential(kTrackLength_px), 100.0);
    const double du = 0.1 * std::cos(angle), dv = 0.1 * std::sin(angle);
    const int steps = 1 + static_cast<int>(10 * length);
    for (int i = 0; i < steps; ++i, u += du, v += dv) {
      const int column = static_cast<int>(std::lround(u)), row = static_cast<int>(std::lround(v));
      if (column < 0 || row < 0 || column >= charge.width_px || row >= charge.height_px) break;
      charge.at(column, row) += static_cast<float>(0.1 * kTrackElectrons);
    }
  }
}

void Detector::saturate(Image<float>& charge) const {
  const float full_well = static_cast<float>(options_.full_well_electrons);
  std::vector<float> excess(static_cast<std::size_t>(charge.height_px));
  for (int u = 0; u < charge.width_px; ++u) {
    bool any = false;
    for (int v = 0; v < charge.height_px; ++v) {
      const float above = std::max(0.0f, charge.at(u, v) - full_well);
      excess[static_cast<std::size_t>(v)] = above;
      if (above > 0) charge.at(u, v) = full_well, any = true;
    }
    if (!any || options_.bloom == 0) continue;
    const float part = static_cast<float>(0.5 * options_.bloom);
    run_over(charge, u, 0, charge.height_px, 1, full_well, excess, part);
    run_over(charge, u, charge.height_px - 1, -1, -1, full_well, excess, part);
  }
}

void Detector::convert(DigitalImage& out, const Image<float>& charge, std::uint64_t frame_key,
                       int threads) const {
  const double highest = (1 << options_.bits) - 1;
  const auto convert_rows = [&](int first, int end) {
    for (int v = first; v < end; ++v) {
      RandomStream stream = row_stream(frame_key, kRead, v);
      for (std::size_t k = charge.index(0, v); k < charge.index(0, v + 1); ++k) {
        double electrons = charge.values[k];
        if (options_.read_noise_electrons > 0) {
          electrons += options_.read_noise_electrons * stream.normal();
        }
        const double dn = electrons / options_.gain_electrons_per_DN + options_.offset_DN;
        out.values[k] = static_cast<std::uint16_t>(std::clamp(std::floor(dn + 0.5), 0.0, highest));
      }
    }
  };
  for_bands_of_rows(threads, charge.height_px, convert_rows);
}

}  // namespace orrery
