#include "rpo_kit/imaging/detection.hpp"

#include <algorithm>
#include <cmath>

namespace rpo_kit {
namespace {

// Of quantisation to whole DN: the least noise there is.
constexpr double kQuantisation_dn = 0.288675;
// The window is wider than the PSF, or the sum over pixels would alias: with equal widths and 0.8
// px the bias is 0.014 px, with 1.5 times as wide 0.001 px.
constexpr double kWindowWidth = 1.5;
// How much further the source is than the first moment under such a window says.
constexpr double kStep = 1.0 + 1.0 / (kWindowWidth * kWindowWidth);

bool brighter(const Detection& a, const Detection& b) {
  if (a.flux_dn != b.flux_dn) return a.flux_dn > b.flux_dn;
  if (a.v != b.v) return a.v < b.v;
  return a.u < b.u;
}

struct Moments {
  double sum = 0.0, x = 0.0, y = 0.0, variance = 0.0;
};

}  // namespace

PointSourceDetector::PointSourceDetector(int width, int height, const DetectionOptions& options)
    : width_(width),
      height_(height),
      tiles_x_((width + kTile - 1) / kTile),
      tiles_y_((height + kTile - 1) / kTile),
      radius_(static_cast<int>(std::ceil(3.0 * kWindowWidth * options.psf_sigma_px))),
      options_(options),
      window_sigma_px_(kWindowWidth * options.psf_sigma_px) {
  const double side = std::erf(0.5 / (std::sqrt(2.0) * options.psf_sigma_px));
  hot_sharpness_ = side;  // geometric mean of side^2, a centred source, and 1
  const std::size_t tiles = static_cast<std::size_t>(tiles_x_) * static_cast<std::size_t>(tiles_y_);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  median_.resize(tiles);
  sigma_.resize(tiles);
  scratch_.reserve(kTile * kTile);
  marked_.resize(pixels);
  group_.reserve(pixels);
}

void PointSourceDetector::measure_tile(const ImageView& image, int tile_x, int tile_y) {
  scratch_.clear();
  const int x_end = std::min(width_, (tile_x + 1) * kTile);
  const int y_end = std::min(height_, (tile_y + 1) * kTile);
  for (int y = tile_y * kTile; y < y_end; ++y) {
    for (int x = tile_x * kTile; x < x_end; ++x) {
      scratch_.push_back(static_cast<float>(image.pixels[y * width_ + x]));
    }
  }
  const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(scratch_.size() / 2);
  std::nth_element(scratch_.begin(), middle, scratch_.end());
  const double median = *middle;
  // From the lower half, where no source is; then within 3 sigma of the mean, three times.
  double mean = median, sigma = 0.0;
  std::size_t below = 0;
  for (auto at = scratch_.begin(); at != middle; ++at, ++below) {
    sigma += (*at - median) * (*at - median);
  }
  sigma = std::sqrt(sigma / static_cast<double>(std::max<std::size_t>(below, 1)));
  for (int round = 0; round < 3; ++round) {
    const double reach = 3.0 * std::max(sigma, kQuantisation_dn) + 0.5;
    double sum = 0.0, squares = 0.0;
    int count = 0;
    for (float value : scratch_) {
      const double d = value - mean;
      if (std::fabs(d) > reach) continue;
      sum += d;
      squares += d * d;
      ++count;
    }
    if (count == 0) break;
    const double shift = sum / count;
    sigma = std::sqrt(std::max(squares / count - shift * shift, 0.0));
    mean += shift;
  }
  const std::size_t tile = static_cast<std::size_t>(tile_y * tiles_x_ + tile_x);
  median_[tile] = static_cast<float>(mean);
  sigma_[tile] = static_cast<float>(std::max(sigma, kQuantisation_dn));
}

// Bilinear between the centres of tiles, constant beyond the outermost.
double PointSourceDetector::interpolate(const std::vector<float>& grid, int x, int y) const {
  const double gx = std::clamp((x + 0.5) / kTile - 0.5, 0.0, tiles_x_ - 1.0);
  const double gy = std::clamp((y + 0.5) / kTile - 0.5, 0.0, tiles_y_ - 1.0);
  const int x0 = static_cast<int>(gx), y0 = static_cast<int>(gy);
  const int x1 = std::min(x0 + 1, tiles_x_ - 1), y1 = std::min(y0 + 1, tiles_y_ - 1);
  const double wx = gx - x0, wy = gy - y0;
  const auto at = [&](int i, int j) {
    return static_cast<double>(grid[static_cast<std::size_t>(j * tiles_x_ + i)]);
  };
  return (1.0 - wy) * ((1.0 - wx) * at(x0, y0) + wx * at(x1, y0)) +
         wy * ((1.0 - wx) * at(x0, y1) + wx * at(x1, y1));
}

void PointSourceDetector::mark(const ImageView& image) {
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const std::size_t at = static_cast<std::size_t>(y * width_ + x);
      const double limit = background(x, y) + options_.threshold_sigma * noise(x, y);
      marked_[at] = image.pixels[at] > limit ? 1 : 0;
    }
  }
}

// All marked pixels that hang together with this one; they are unmarked.
void PointSourceDetector::gather(int start) {
  group_.clear();
  group_.push_back(start);
  marked_[static_cast<std::size_t>(start)] = 0;
  for (std::size_t next = 0; next < group_.size(); ++next) {
    const int x = group_[next] % width_, y = group_[next] / width_;
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v) {
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u) {
        const int at = v * width_ + u;
        if (marked_[static_cast<std::size_t>(at)] == 0) continue;
        marked_[static_cast<std::size_t>(at)] = 0;
        group_.push_back(at);
      }
    }
  }
}

// The group's centroid, flux and their uncertainties; false if the window leaves the image or the
// centroid the group.
bool PointSourceDetector::measure(const ImageView& image, Detection* detection) const {
  double sum = 0.0, u = 0.0, v = 0.0, peak = 0.0;
  for (std::int32_t at : group_) {
    const int x = at % width_, y = at / width_;
    const double value = image.pixels[at] - background(x, y);
    sum += value;
    u += value * x;
    v += value * y;
    peak = std::max(peak, value);
    if (image.pixels[at] >= options_.saturation_dn) detection->saturated = true;
  }
  u /= sum;
  v /= sum;
  const double u0 = u, v0 = v;

  const double scale = -0.5 / (window_sigma_px_ * window_sigma_px_);
  for (int iteration = 0; iteration < 30; ++iteration) {
    const int x0 = static_cast<int>(std::lround(u)), y0 = static_cast<int>(std::lround(v));
    if (x0 < radius_ || y0 < radius_ || x0 + radius_ >= width_ || y0 + radius_ >= height_) {
      return false;
    }
    Moments window;
    double flux = 0.0, flux_variance = 0.0;
    for (int y = y0 - radius_; y <= y0 + radius_; ++y) {
      for (int x = x0 - radius_; x <= x0 + radius_; ++x) {
        const double dx = x - u, dy = y - v;
        const double weight = std::exp(scale * (dx * dx + dy * dy));
        const double value = image.pixels[y * width_ + x] - background(x, y);
        const double sigma = noise(x, y);
        double variance = sigma * sigma;
        if (options_.electrons_per_dn > 0.0) {
          variance += std::max(value, 0.0) / options_.electrons_per_dn;
        }
        window.sum += weight * value;
        window.x += weight * value * dx;
        window.y += weight * value * dy;
        window.variance += 0.5 * weight * weight * (dx * dx + dy * dy) * variance;
        flux += value;
        flux_variance += variance;
      }
    }
    if (!(window.sum > 0.0) || !(flux > 0.0)) return false;
    const double step_u = kStep * window.x / window.sum, step_v = kStep * window.y / window.sum;
    u += step_u;
    v += step_v;
    if (std::fabs(step_u) + std::fabs(step_v) > 1e-5 && iteration < 29) continue;
    const double centroid = kStep * std::sqrt(window.variance) / window.sum;
    detection->sigma_px = std::hypot(centroid, options_.floor_sigma_px);
    detection->flux_dn = flux;
    detection->snr = flux / std::sqrt(flux_variance);
    detection->sharpness = peak / flux;
    break;
  }
  detection->u = u;
  detection->v = v;
  detection->pixels = static_cast<int>(group_.size());
  return std::hypot(u - u0, v - v0) < radius_;
}

bool PointSourceDetector::detect(const ImageView& image, std::vector<Detection>* found) {
  found->clear();
  if (image.pixels == nullptr || image.width != width_ || image.height != height_) return false;
  for (int y = 0; y < tiles_y_; ++y) {
    for (int x = 0; x < tiles_x_; ++x) measure_tile(image, x, y);
  }
  mark(image);
  for (int at = 0; at < width_ * height_; ++at) {
    if (marked_[static_cast<std::size_t>(at)] == 0) continue;
    gather(at);
    const int size = static_cast<int>(group_.size());
    if (size < options_.min_pixels || size > options_.max_pixels) continue;
    Detection detection;
    if (measure(image, &detection)) found->push_back(detection);
  }
  std::sort(found->begin(), found->end(), brighter);
  return true;
}

}  // namespace rpo_kit
