// models/gnss/noise.svg shows what the tracker draws: code and phase errors of one receiver over
// an orbit against elevation, and the sigmas of the law. The test writes the picture and compares
// it with the committed one; to renew that, copy the file which the failure names.
#include <orrery/models/gnss/gps_constants.hpp>
#include <orrery/models/gnss/tracking.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "leo_scene.hpp"

namespace orrery {
namespace {

struct Sample {
  double elevation_deg, code_m, phase_mm;
};

std::vector<Sample> one_orbit() {
  RandomStreams streams(1);
  GpsConstellation gps({}, kSceneEpoch, streams);
  GnssTracker tracker({}, AntennaPattern::patch(), [&](std::string_view purpose) -> RandomStream& {
    return streams.stream("chief", "gnss", purpose);
  });
  tracker.start(GnssStart::kTracking);
  std::vector<Sample> samples;
  for (Duration t = 0s; t < 96min; t += 120s) {
    tracker.epoch(gps.at(kSceneEpoch + t), gps, antenna_at({}, t), {1.5e11, 0, 0}, 0, 0, {});
    for (const GnssChannel& c : tracker.channels()) {
      if (!c.reported) continue;
      samples.push_back(
          {std::asin(c.sin_elevation) * 57.29577951308232, c.code_noise_m, 1e3 * c.phase_noise_m});
    }
  }
  return samples;
}

std::string text(const char* format, double a, double b, double c = 0, double d = 0) {
  char line[160];
  std::snprintf(line, sizeof line, format, a, b, c, d);
  return line;
}

/// One panel: errors as dots, plus and minus one sigma as lines, over elevation 0 to 90 deg.
template <class Error, class Sigma>
std::string panel(double top, const char* title, double limit, const char* unit, Error error,
                  Sigma sigma, const std::vector<Sample>& samples) {
  const auto x = [](double elevation_deg) { return 60 + 6 * elevation_deg; };
  const auto y = [=](double value) { return top + 100 - 90 * value / limit; };
  std::string out = text("<rect x='60' y='%.0f' width='540' height='180'/>", top + 10, 0) + "\n";
  for (int e = 0; e <= 90; e += 15) {
    out += text("<text x='%.0f' y='%.0f'>%.0f</text>", x(e) - 6, top + 206, e) + "\n";
  }
  for (const double part : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    out += text("<text x='12' y='%.0f'>%g</text>", y(part * limit) + 4, part * limit) + "\n";
  }
  out += "<text x='66' y='" + text("%.0f", top + 4, 0) + "'>" + title + " [" + unit + "]</text>\n";
  for (const int sign : {-1, 1}) {
    out += "<polyline points='";
    for (int e = 0; e <= 90; ++e) out += text("%.0f,%.1f ", x(e), y(sign * sigma(e)));
    out += "'/>\n";
  }
  out += "<path d='";
  for (const Sample& s : samples) {
    if (std::abs(error(s)) > limit) continue;
    out += text("M%.1f %.1fh0", x(s.elevation_deg), y(error(s)));
  }
  return out + "'/>\n";
}

std::string figure() {
  const Cn0Model cn0(AntennaPattern::patch(), Cn0Law::kStretched);
  const auto cn0_at = [&](int elevation_deg) {
    return cn0.at_angle((90 - elevation_deg) * 0.017453292519943295);
  };
  const std::vector<Sample> samples = one_orbit();
  std::string out =
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 620 480' font-family='sans-serif' "
      "font-size='12'>\n<style>rect{fill:none;stroke:#888}polyline{fill:none;stroke:#c40;"
      "stroke-width:1.5}path{stroke:#246;stroke-width:3;stroke-linecap:round;"
      "stroke-opacity:.6}</style>\n<rect x='0' y='0' width='620' height='480' "
      "style='fill:#fff;stroke:none'/>\n";
  out += panel(
      10, "pseudorange error", 6, "m", [](const Sample& s) { return s.code_m; },
      [&](int e) { return code_sigma_m(cn0_at(e)); }, samples);
  out += panel(
      235, "carrier phase error", 30, "mm", [](const Sample& s) { return s.phase_mm; },
      [&](int e) { return 1e3 * phase_sigma_m(cn0_at(e), gps::kL1Wavelength_m); }, samples);
  return out +
         "<text x='250' y='472'>elevation [deg], antenna to the zenith; lines: 1 sigma"
         "</text>\n</svg>\n";
}

TEST(GnssNoiseFigureTest, CommittedPictureIsWhatTheTrackerDraws) {
  const std::string now = figure();
  std::ifstream file(ORRERY_NOISE_FIGURE, std::ios::binary);
  const std::string committed{std::istreambuf_iterator<char>(file), {}};
  if (committed == now) return;
  const std::string written = testing::TempDir() + "noise.svg";
  std::ofstream(written, std::ios::binary) << now;
  FAIL() << ORRERY_NOISE_FIGURE << " is not what " << written << " shows";
}

}  // namespace
}  // namespace orrery
