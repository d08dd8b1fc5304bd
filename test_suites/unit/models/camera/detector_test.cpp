#include <orrery/models/camera/detector.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace orrery {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

DetectorOptions without_imperfections() {
  return {.bits = 16,
          .gain_electrons_per_DN = 1,
          .offset_DN = 100,
          .full_well_electrons = 60000,
          .shot_noise = false,
          .read_noise_electrons = 0,
          .dark_electrons_ps = 0,
          .dark_nonuniformity = 0,
          .response_nonuniformity = 0,
          .hot_pixels_per_million = 0};
}

Detector make(const DetectorOptions& options, int size = 64) {
  RandomStream pattern(99);
  return Detector(options, size, size, pattern);
}

struct Moments {
  double mean = 0, variance = 0, skewness = 0;
};
Moments moments_of(const std::vector<double>& x) {
  Moments m;
  m.mean = std::accumulate(x.begin(), x.end(), 0.0) / double(x.size());
  double third = 0;
  for (const double v : x) {
    const double d = v - m.mean;
    m.variance += d * d, third += d * d * d;
  }
  m.variance /= double(x.size() - 1);
  m.skewness = third / double(x.size()) / std::pow(m.variance, 1.5);
  return m;
}

// Half the variance of the difference of two frames has no fixed pattern in it.
struct Transfer {
  double mean_DN, variance_DN2;
};
Transfer transfer(const Detector& detector, double electrons, double exposure_s,
                  std::uint64_t key) {
  const int size = detector.dark_electrons_ps().width_px;
  const ElectronImage light(size, size, float(electrons));
  const DigitalImage a = detector.read(light, exposure_s, key);
  const DigitalImage b = detector.read(light, exposure_s, key + 1);
  std::vector<double> sums, differences;
  for (std::size_t k = 0; k < a.values.size(); ++k) {
    sums.push_back(0.5 * (a.values[k] + b.values[k]));
    differences.push_back(double(a.values[k]) - b.values[k]);
  }
  return {moments_of(sums).mean, 0.5 * moments_of(differences).variance};
}

// variance = read^2/gain^2 + 1/12 + (mean - offset)/gain in DN. Of 65,536 pixels a variance is
// known to sqrt(2/n) = 0.55 %; bound: 4 of these.
TEST(DetectorTest, PhotonTransferCurveIsTheCommandedOne) {
  DetectorOptions options = without_imperfections();
  options.shot_noise = true;
  options.gain_electrons_per_DN = 2.5;
  options.read_noise_electrons = 9;
  options.response_nonuniformity = 0.02;
  const Detector detector = make(options, 256);
  std::uint64_t key = 1000;
  for (const double electrons : {0.0, 5.0, 25.0, 60.0, 400.0, 3000.0, 20000.0}) {
    const Transfer t = transfer(detector, electrons, 0.1, key += 10);
    EXPECT_NEAR(t.mean_DN, 100 + electrons / 2.5, 0.02 + 4e-4 * electrons / 2.5);
    const double expected = 81 / 6.25 + 1.0 / 12 + electrons / 6.25;
    EXPECT_NEAR(t.variance_DN2 / expected, 1, 0.022) << electrons;
  }
}

// Mean to sqrt(m/n), variance to sqrt(2/n + 1/(m n)), skewness 1/sqrt(m) to sqrt(6/n): 4.5 of each.
TEST(DetectorTest, PoissonHasItsMomentsOnBothSidesOfTheChange) {
  const int n = 100000;
  for (const double mean : {0.02, 0.7, 5.0, 29.9, 30.1, 200.0}) {
    RandomStream stream(7);
    std::vector<double> drawn;
    for (int k = 0; k < n; ++k) drawn.push_back(poisson(stream, mean));
    const Moments m = moments_of(drawn);
    EXPECT_NEAR(m.mean, mean, 4.5 * std::sqrt(mean / n));
    EXPECT_NEAR(m.variance / mean, 1,
                4.5 * std::sqrt(2.0 / n + 1 / (mean * n)) + 1 / (12 * mean) * (mean >= 30));
    EXPECT_NEAR(m.skewness * std::sqrt(mean), 1,
                4.5 * std::sqrt(6.0 / n * (mean + 1)) + 0.2 * (mean < 1));
  }
  RandomStream stream(7);
  EXPECT_EQ(poisson(stream, 0), 0);
  EXPECT_EQ(poisson(stream, std::nan("")), 0);
  EXPECT_EQ(stream.draws(), 0u);
}

TEST(DetectorTest, DarkCurrentGrowsWithTheExposureAndHotPixelsStayWhereTheyAre) {
  DetectorOptions options = without_imperfections();
  options.dark_electrons_ps = 50;
  options.hot_pixels_per_million = 1000;
  options.hot_pixel_electrons_ps = 5000;
  const Detector detector = make(options, 128);
  const ElectronImage night(128, 128);
  const DigitalImage one = detector.read(night, 1, 1), four = detector.read(night, 4, 2);
  int hot = 0;
  for (std::size_t k = 0; k < one.values.size(); ++k) {
    const double in_one = one.values[k] - 100.0, in_four = four.values[k] - 100.0;
    if (in_four < 59000) {
      EXPECT_NEAR(in_four, 4 * in_one, 2.5);  // each rounded to 1 DN
    }
    hot += in_one > 51;
  }
  EXPECT_GE(hot, 14);  // 16 drawn with replacement; one of each fifty is below 100 electrons/s
  EXPECT_LE(hot, 16);
}

TEST(DetectorTest, FixedPatternHasTheCommandedSpreadAndStays) {
  DetectorOptions options = without_imperfections();
  options.response_nonuniformity = 0.03;
  const Detector detector = make(options, 128);
  const ElectronImage light(128, 128, 10000);
  const DigitalImage a = detector.read(light, 0.1, 1), b = detector.read(light, 0.1, 2);
  EXPECT_EQ(a, b);
  std::vector<double> values(a.values.begin(), a.values.end());
  // 300 DN to 1/sqrt(2 n) = 0.55 %: 4 of these.
  EXPECT_NEAR(std::sqrt(moments_of(values).variance) / 300, 1, 0.022);
}

TEST(DetectorTest, NumbersAreRoundedAndClipped) {
  DetectorOptions options = without_imperfections();
  options.bits = 10;
  options.gain_electrons_per_DN = 4;
  ElectronImage light(64, 64);
  light.at(3, 5) = 41;     // 10.25 DN
  light.at(4, 5) = 42.1f;  // 10.5
  light.at(5, 5) = 50000;  // beyond the converter
  const DigitalImage out = make(options).read(light, 1, 1);
  EXPECT_EQ(out.at(3, 5), 110);
  EXPECT_EQ(out.at(4, 5), 111);
  EXPECT_EQ(out.at(5, 5), 1023);
  EXPECT_EQ(out.at(6, 5), 100);
}

// Charge is conserved but for the part that is drained and what runs off the edge.
TEST(DetectorTest, BloomRunsAlongTheColumnAndKeepsTheCharge) {
  DetectorOptions options = without_imperfections();
  options.full_well_electrons = 10000;
  options.bloom = 0.8;
  ElectronImage light(64, 64, 200);
  light.at(20, 30) = 60200;
  const DigitalImage out = make(options).read(light, 1, 1);
  double total = 0;
  for (int v = 0; v < 64; ++v) total += out.at(20, v) - 100.0;
  EXPECT_NEAR(total, 64 * 200 + 60000 - 0.2 * 50200, 2);
  EXPECT_EQ(out.at(20, 30), 10100);
  EXPECT_EQ(out.at(20, 29), 10100);
  EXPECT_EQ(out.at(20, 31), 10100);
  EXPECT_EQ(out.at(19, 30), 300);
  EXPECT_EQ(out.at(20, 24), 300);
}

TEST(DetectorTest, CosmicRaysComeAtTheirRate) {
  DetectorOptions options = without_imperfections();
  options.cosmic_rays_ps = 40;
  const Detector detector = make(options, 256);
  double lit = 0;
  for (std::uint64_t key = 0; key < 50; ++key) {
    const DigitalImage out = detector.read(ElectronImage(256, 256), 0.5, key);
    for (const auto dn : out.values) lit += dn > 100;
  }
  // 1000 rays of a mean length of 6 px over 4/pi pixels per px of length, and the first pixel; lost
  // at the edges 2 %. Rays to 3 %, lengths to 3 %: a bound of 15 %.
  EXPECT_NEAR(lit / 1000, 1 + 6 * 4 / 3.14159, 0.15 * 8.6);
}

TEST(DetectorTest, BitsDependOnTheFrameAndNotOnTheThreads) {
  RandomStream pattern(5);
  DetectorOptions options;
  options.cosmic_rays_ps = 100;
  options.bloom = 0.5;
  const Detector detector(options, 100, 75, pattern);
  ElectronImage light(100, 75, 900);
  light.at(50, 40) = 1e6;
  const DigitalImage one = detector.read(light, 0.2, 17, 1);
  for (const int threads : {2, 3, 8}) EXPECT_EQ(detector.read(light, 0.2, 17, threads), one);
  EXPECT_NE(detector.read(light, 0.2, 18, 1), one);
}

TEST(DetectorTest, RefusesWhatNoDetectorIs) {
  const auto with = [](auto change) {
    return [change] {
      DetectorOptions options;
      change(options);
      make(options);
    };
  };
  EXPECT_THAT(with([](auto& o) { o.bits = 24; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("bits = 24; accepted: 8 to 16")));
  EXPECT_THAT(with([](auto& o) { o.read_noise_electrons = std::nan(""); }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("read_noise_electrons = nan")));
  EXPECT_THAT([] { make({}).read(ElectronImage(32, 64), 1, 1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("32 x 64 px; expected 64 x 64")));
}

}  // namespace
}  // namespace orrery
