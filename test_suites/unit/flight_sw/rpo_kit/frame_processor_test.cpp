#include "rpo_kit/imaging/frame_processor.hpp"

#include <erfa.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "rpo_kit/imaging/earth_velocity.hpp"
#include "rpo_kit/imaging/hot_pixels.hpp"
#include "rpo_kit/imaging/star_file.hpp"
#include "star_scene.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;

// Barycentric velocity of the Earth in the ICRS [m/s], from ERFA.
Vec3 erfa_velocity(std::int64_t t_ns) {
  double heliocentric[2][3], barycentric[2][3];
  eraEpv00(2444244.5, seconds(t_ns) / 86400.0, heliocentric, barycentric);
  const double* v = barycentric[1];
  constexpr double kAu_m = 149597870700.0;
  return (kAu_m / 86400.0) * vec3(v[0], v[1], v[2]);
}

TEST(EarthVelocityTest, FollowsErfaFrom2000To2050) {
  double worst = 0.0;
  for (int k = 0; k < 600; ++k) {
    const std::int64_t t_ns = (1043 + k * 4) * kWeek_ns + k * 100000 * kSecond_ns;
    worst = std::max(worst, norm(earth_velocity_ECI(t_ns) - erfa_velocity(t_ns)));
  }
  EXPECT_LT(worst, 35.0);
  EXPECT_GT(worst, 10.0);  // the Sun's own motion is left out
}

TEST(EarthVelocityTest, SunIsWhereErfaHasIt) {
  double worst_rad = 0.0;
  for (int k = 0; k < 600; ++k) {
    const std::int64_t t_ns = (1043 + k * 4) * kWeek_ns + k * 100000 * kSecond_ns;
    double heliocentric[2][3], barycentric[2][3];
    eraEpv00(2444244.5, seconds(t_ns) / 86400.0, heliocentric, barycentric);
    const double* r = heliocentric[0];
    const Vec3 sun = -1.0 * vec3(r[0], r[1], r[2]);
    const Vec3 ours = sun_direction_ECI(t_ns);
    EXPECT_NEAR(norm(ours), 1.0, 1e-12);
    worst_rad = std::max(worst_rad, norm(cross(ours, (1.0 / norm(sun)) * sun)));
  }
  EXPECT_LT(worst_rad, 3.5e-4);  // 0.02 deg
}

class StarFileTest : public testing::Test {
 protected:
  bool load(const char* text) {
    path_ = testing::TempDir() + "star_file_test.txt";
    std::FILE* file = std::fopen(path_.c_str(), "w");
    std::fputs(text, file);
    std::fclose(file);
    stars_.clear();
    const bool good = load_stars(path_.c_str(), &stars_, message_, sizeof message_);
    std::remove(path_.c_str());
    return good;
  }
  std::string path_;
  std::vector<Star> stars_;
  char message_[160] = "";
};

TEST_F(StarFileTest, ReadsDirectionsAndMagnitudes) {
  ASSERT_TRUE(load("# stars\n0 0 1.5\n\n90 0 -1.44\n180 45 3  # a comment\n0 90 2")) << message_;
  ASSERT_EQ(stars_.size(), 4u);
  EXPECT_LT(norm(stars_[0].direction_ECI - vec3(1, 0, 0)), 1e-15);
  EXPECT_LT(norm(stars_[1].direction_ECI - vec3(0, 1, 0)), 1e-15);
  EXPECT_LT(norm(stars_[2].direction_ECI - vec3(-std::sqrt(0.5), 0, std::sqrt(0.5))), 1e-15);
  EXPECT_LT(norm(stars_[3].direction_ECI - vec3(0, 0, 1)), 1e-15);
  EXPECT_EQ(stars_[1].magnitude, -1.44);
}

TEST_F(StarFileTest, SaysWhatIsWrong) {
  EXPECT_FALSE(load("0 0 1\n0 0 1\n0 0 1\n"));
  EXPECT_STREQ(message_, "star catalogue: 3 stars are too few");
  for (const char* bad : {"0 0", "0 0 x", "0 91 1", "-1 0 1", "361 0 1", "0 0 1 1", "0 0 nan"}) {
    EXPECT_FALSE(load((std::string("0 0 1\n") + bad + "\n0 0 1\n0 0 1\n0 0 1\n").c_str())) << bad;
    EXPECT_STREQ(message_, "star catalogue: line 2 is no star") << bad;
  }
  EXPECT_FALSE(load((std::string(200, '0') + " 0 1\n0 0 1\n0 0 1\n0 0 1\n").c_str()));
  EXPECT_FALSE(load_stars("/no/such/file", nullptr, message_, sizeof message_));
  EXPECT_STREQ(message_, "star catalogue: no file '/no/such/file'");
}

// Hot pixels stand still, alone and side by side with their like diagonally; a star drifts over
// one; cosmic rays strike once.
TEST(HotPixelsTest, AreLearntInThreeFramesAndMended) {
  constexpr int kSize = 64;
  HotPixels hot;
  Noise noise(8);
  std::vector<std::uint16_t> pixels;
  const auto at = [&](int x, int y) -> std::uint16_t& {
    return pixels[static_cast<std::size_t>(y * kSize + x)];
  };
  for (int k = 0; k < 8; ++k) {
    flight_test::Exposure exposure(kSize, kSize, 60.0);
    exposure.add(20, 20, 1500.0);
    exposure.add(40, 41, 800.0);
    exposure.add(5 + 6 * k, 50, 2000.0);  // a ray, elsewhere each time
    exposure.add_source(30.3, 30.4, 4000.0, 0.7);
    if (k == 6) exposure.add_source(20.6, 19.7, 6000.0, 0.8);
    exposure.read_out(2.0, 10.0, &noise);
    const ImageView view = exposure.view();
    pixels.assign(view.pixels, view.pixels + kSize * kSize);
    hot.mend(pixels.data(), kSize, kSize);
    EXPECT_EQ(hot.known(), k < 2 ? 0 : 2) << k;
    EXPECT_GT(at(30, 30), 500);          // of 570: a source that stands still is not hot
    EXPECT_GT(at(5 + 6 * k, 50), 1000);  // what is seen once is left
    if (k < 3 || k == 6) continue;
    EXPECT_NEAR(at(20, 20), 130, 15) << k;
    EXPECT_NEAR(at(40, 41), 130, 15) << k;
  }
}

// A camera that is fixed in RTN, 20 deg of sky along the track, in an orbit of 550 km; a target
// that goes round at 2 deg off the boresight; hot pixels; frames every two minutes.
class FrameProcessorTest : public testing::Test {
 protected:
  FrameProcessorTest() {
    camera_.width = camera_.height = 512;
    camera_.fx = 1500.0, camera_.fy = 1501.0, camera_.cx = 255.1, camera_.cy = 256.4;
    camera_.k1 = -0.08, camera_.p1 = 2e-4;
    header_.camera = camera_;
    header_.electrons_per_dn = 2.0;
    options_.width = options_.height = 512;
    options_.field_radius_rad = 0.24;
    for (const Star& star : sky_) {
      if (star.magnitude < 6.0) known_.push_back(star);
    }
  }

  /// Position and velocity on a circle that is inclined by 60 deg.
  StateEci state(double t_s) const {
    const double a = 6928e3, n = mean_motion_radps(a), u = n * t_s;
    const Vec3 p = vec3(1, 0, 0), q = vec3(0, 0.5, std::sqrt(0.75));
    return {a * (std::cos(u) * p + std::sin(u) * q), a * n * (-std::sin(u) * p + std::cos(u) * q)};
  }
  /// Exact aberration, by velocities of ERFA.
  static Vec3 apparent(const Vec3& direction, const Vec3& v) {
    const Vec3 beta = (1.0 / 299792458.0) * v;
    const double gamma = 1.0 / std::sqrt(1.0 - dot(beta, beta));
    const double along = dot(direction, beta);
    const Vec3 shifted = (1.0 / gamma) * direction + (1.0 + along / (1.0 + 1.0 / gamma)) * beta;
    return (1.0 / norm(shifted)) * shifted;
  }

  /// Frame k, with the camera's attitude in RTN.
  /// @param expected  How far from the target it is expected, with reach and range; null: anywhere.
  bool frame(FrameProcessor* processor, int k, const Mat3& R_CH, double target_e,
             const ExpectedTarget* expected = nullptr) {
    const double t_s = 120.0 * k;
    const StateEci own = state(t_s);
    const Vec3 r = (1.0 / norm(own.r_ECI)) * own.r_ECI;
    const Vec3 t = (1.0 / norm(own.v_ECI)) * own.v_ECI;
    const Vec3 n = cross(r, t);
    const Mat3 R_HI{{{r[0], r[1], r[2]}, {t[0], t[1], t[2]}, {n[0], n[1], n[2]}}};
    R_CI_ = R_CH * R_HI;
    header_.t_ns = kEpoch_ns + nanoseconds(t_s);
    const Vec3 v = erfa_velocity(header_.t_ns) + own.v_ECI;
    const double phase = 1.1e-3 * t_s;
    const Vec3 d_H = vec3(0.02 * std::cos(phase), 1.0, 0.03 * std::sin(phase));
    direction_ECI_ = transpose(R_HI) * ((1.0 / norm(d_H)) * d_H);

    flight_test::Exposure exposure(camera_.width, camera_.height, 60.0);
    double pu = 0.0, pv = 0.0;
    for (const Star& star : sky_) {
      const Vec3 d_C = R_CI_ * apparent(star.direction_ECI, v);
      // The distortion folds what is far outside the field back into it.
      if (d_C[2] < 0.9 || !flight_test::pinhole(camera_, d_C, &pu, &pv)) continue;
      exposure.add_source(pu, pv, 6e5 * std::pow(10.0, -0.4 * star.magnitude), 0.8);
    }
    if (flight_test::pinhole(camera_, R_CI_ * direction_ECI_, &pu, &pv) && target_e > 0.0) {
      exposure.add_source(pu, pv, target_e, 0.8);
    }
    exposure.add(300, 200, 3000.0);
    exposure.add(100, 400, 2000.0);
    exposure.add(101, 400, 2000.0);
    exposure.read_out(2.0, 10.0, &noise_);
    ExpectedTarget there;
    if (expected != nullptr) {
      there = *expected;
      there.direction_ECI = expected->direction_ECI + direction_ECI_;
      there.direction_ECI = (1.0 / norm(there.direction_ECI)) * there.direction_ECI;
    }
    return processor->process(header_, exposure.view(), observer_from_state(header_.t_ns, own),
                              expected == nullptr ? nullptr : &there, &report_);
  }
  Vec3 turn() const { return flight_test::small_turn(report_.attitude.R_CI, R_CI_); }

  std::vector<Star> sky_ = flight_test::random_sky(9000, 6.6, 31), known_;
  Camera camera_;
  ImagingOptions options_;
  Noise noise_{33};
  FrameHeader header_;
  FrameReport report_;
  Mat3 R_CI_;
  Vec3 direction_ECI_;
};

// Of 23 frames: mean of chi-square of 3 and 2 degrees of freedom, 1 sigma 0.51 and 0.42. Both carry
// a floor for what is systematic, and nothing is here: so they may be small.
TEST_F(FrameProcessorTest, DirectionsAndAttitudesAreAsGoodAsTheySay) {
  FrameProcessor processor(options_, known_);
  const Mat3 R_CH = flight_test::looking_along(vec3(0.0, 1.0, 0.0), 0.3);
  double attitude = 0.0, direction = 0.0;
  int directions = 0;
  for (int k = 0; k < 23; ++k) {
    ASSERT_TRUE(frame(&processor, k, R_CH, 5000.0));
    ASSERT_TRUE(report_.attitude_known) << k;
    EXPECT_EQ(report_.lost_in_space, k == 0);
    EXPECT_GE(report_.identified, 5);
    EXPECT_LT(norm(turn()), 1e-3) << k;
    attitude += squared_mahalanobis(report_.attitude.covariance_C, turn()) / 23.0;
    EXPECT_EQ(report_.target, k >= 2) << k;
    if (!report_.target) continue;
    EXPECT_EQ(report_.bearing.t_ns, header_.t_ns);
    const double off = norm(report_.bearing.direction_ECI - direction_ECI_);
    EXPECT_LT(off, 5.5 * report_.bearing.sigma_rad) << k;
    EXPECT_LT(report_.bearing.sigma_rad, 5e-5);
    direction += off * off / (report_.bearing.sigma_rad * report_.bearing.sigma_rad);
    ++directions;
  }
  EXPECT_EQ(directions, 21);
  EXPECT_NEAR(attitude, 2.4, 1.4);
  EXPECT_NEAR(direction / directions, 1.7, 1.1);
  RecordProperty("attitude_chi2", std::to_string(attitude));
  RecordProperty("direction_chi2", std::to_string(direction / directions));
}

// The camera jumps by 3 deg: no star is where it was expected.
TEST_F(FrameProcessorTest, FindsItselfAgainAfterAJump) {
  FrameProcessor processor(options_, known_);
  const Mat3 before = flight_test::looking_along(vec3(0.0, 1.0, 0.0), 0.3);
  const Mat3 after = flight_test::axis_rotation(vec3(0.6, 0.8, 0.0), 0.05) * before;
  for (int k = 0; k < 6; ++k) {
    ASSERT_TRUE(frame(&processor, k, k < 3 ? before : after, 5000.0));
    ASSERT_TRUE(report_.attitude_known) << k;
    EXPECT_EQ(report_.lost_in_space, k == 0 || k == 3);
    EXPECT_LT(norm(turn()), 1e-3) << k;
    EXPECT_EQ(report_.target, k >= 2) << k;  // of the sky, it has not moved
  }
}

// Hot pixels and unknown stars alone, or a target elsewhere than expected: no direction.
TEST_F(FrameProcessorTest, TakesNothingElseForTheTarget) {
  const Mat3 R_CH = flight_test::looking_along(vec3(0.0, 1.0, 0.0), 0.3);
  FrameProcessor without(options_, known_), elsewhere(options_, known_);
  for (int k = 0; k < 9; ++k) {
    ASSERT_TRUE(frame(&without, k, R_CH, 0.0));
    EXPECT_TRUE(report_.attitude_known);
    EXPECT_FALSE(report_.target) << k;
  }
  for (int k = 0; k < 6; ++k) {
    const ExpectedTarget expected{vec3(0.0, 0.02, 0.02), 0.003, 1e4};
    ASSERT_TRUE(frame(&elsewhere, k, R_CH, 5000.0, &expected));
    EXPECT_FALSE(report_.target) << k;
  }
}

// A smaller image, a black one, a white one.
TEST_F(FrameProcessorTest, ImagesWithoutStarsGiveNothing) {
  FrameProcessor processor(options_, known_);
  const Observer own = observer_from_state(kEpoch_ns, state(0.0));
  std::vector<std::uint16_t> pixels(512 * 512, 0);
  EXPECT_FALSE(processor.process(header_, {pixels.data(), 512, 511}, own, nullptr, &report_));
  for (const int value : {0, 100, 65535}) {
    pixels.assign(pixels.size(), static_cast<std::uint16_t>(value));
    ASSERT_TRUE(processor.process(header_, {pixels.data(), 512, 512}, own, nullptr, &report_));
    EXPECT_FALSE(report_.attitude_known);
    EXPECT_FALSE(report_.target);
    EXPECT_EQ(report_.sources, 0);
  }
}

// Where on the target its light comes from counts once it is near.
TEST_F(FrameProcessorTest, TheTargetsSizeIsInTheSigma) {
  const Mat3 R_CH = flight_test::looking_along(vec3(0.0, 1.0, 0.0), 0.3);
  for (const double range_m : {20e3, 500.0}) {
    FrameProcessor processor(options_, known_);
    const ExpectedTarget expected{vec3(0.0, 0.003, 0.003), 0.01, range_m};
    for (int k = 0; k < 4; ++k) ASSERT_TRUE(frame(&processor, k, R_CH, 5000.0, &expected));
    ASSERT_TRUE(report_.target);
    EXPECT_GT(report_.bearing.sigma_rad, options_.target_size_m / range_m);
    EXPECT_LT(report_.bearing.sigma_rad, options_.target_size_m / range_m + 5e-5);
  }
}

}  // namespace
}  // namespace rpo_kit
