#include <orrery/models/gnss/receiver.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "../support/fake_device_context.hpp"

namespace orrery {
namespace {

constexpr double kOmegaEarth_radps = 7.2921151467e-5;  // WGS 84
constexpr SimTime kStart = from_ns(1'426'464'000'000'000'000);

// What a frame says, read at the offsets of the layout table.
struct Fix {
  SimTime t;
  Vec3 r_ECEF, v_ECEF;
  float sigma_r, sigma_v;
};

template <class T>
T field(const ByteBuffer& frame, std::size_t offset) {
  T value;
  static_assert(std::endian::native == std::endian::little);
  std::memcpy(&value, frame.data() + offset, sizeof value);
  return value;
}

Vec3 f64x3(const ByteBuffer& frame, std::size_t at) {
  return {field<double>(frame, at), field<double>(frame, at + 8), field<double>(frame, at + 16)};
}

Fix read(const ByteBuffer& frame) {
  EXPECT_EQ(frame.size(), 144u);
  EXPECT_EQ(field<std::uint16_t>(frame, 4), 241);  // BESTXYZ
  const std::int64_t ms =
      field<std::uint16_t>(frame, 14) * 604'800'000LL + field<std::uint32_t>(frame, 16);
  return {.t = from_ns(ms * 1'000'000),
          .r_ECEF = f64x3(frame, 28 + 8),
          .v_ECEF = f64x3(frame, 28 + 52),
          .sigma_r = field<float>(frame, 28 + 32),
          .sigma_v = field<float>(frame, 28 + 76)};
}

std::vector<Fix> fixes(const FakeDeviceContext& io) {
  std::vector<Fix> out;
  for (const auto& sent : io.to_flight_log) out.push_back(read(sent.bytes));
  return out;
}

Mat3 rotation_about_z(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{c, s, 0}, {-s, c, 0}, {0, 0, 1}};
}

// An Earth turning about z, and something standing still on it.
void stand_still(FakeDeviceContext& io, const Vec3& r_ECEF) {
  const auto R_EI_at = [](SimTime t) {
    return rotation_about_z(1.0 + kOmegaEarth_radps * to_seconds(t - kStart));
  };
  const Vec3 omega{0, 0, kOmegaEarth_radps};
  io.surroundings_at = [=](SimTime t) {
    return Surroundings{.R_EI = R_EI_at(t), .omega_EI_ECEF = omega};
  };
  io.truth_at = [=](SimTime t) {
    const Mat3 R_IE = transpose(R_EI_at(t));
    return OrbitState{.t = t, .r_ECI = R_IE * r_ECEF, .v_ECI = R_IE * cross(omega, r_ECEF)};
  };
}

const GnssReceiverOptions kNoiseless{
    .sigma_position_m = 0, .sigma_velocity_mps = 0, .lever_arm_B = {0, 0, 0}};

// There and back through two rotations of a vector of 7000 km: a few ulp, 1 nm each. 7.5 km/s
// cancel to zero: a few ulp of 1 pm/s.
TEST(GnssReceiverTest, StandingStillOnTheTurningEarthIsAFixedPositionWithoutVelocity) {
  FakeDeviceContext io(kStart);
  const Vec3 r_ECEF{3e6, -5e6, 4e6};
  stand_still(io, r_ECEF);
  GnssReceiver receiver(kNoiseless);
  receiver.start(io);
  io.run_for(1h);
  ASSERT_EQ(io.to_flight_log.size(), 361u);
  for (const Fix& fix : fixes(io)) {
    EXPECT_LT(norm(fix.r_ECEF - r_ECEF), 5e-9);
    EXPECT_LT(norm(fix.v_ECEF), 1e-12);
  }
}

// A point at rest in inertial space moves westward over the Earth: v_ECEF = -omega x r.
TEST(GnssReceiverTest, VelocityIsRelativeToTheRotatingEarth) {
  FakeDeviceContext io(kStart);
  io.truth_at = [](SimTime t) { return OrbitState{.t = t, .r_ECI = {7e6, 0, 0}}; };
  io.surroundings_at = [](SimTime) {
    return Surroundings{.omega_EI_ECEF = {0, 0, kOmegaEarth_radps}};
  };
  GnssReceiver receiver(kNoiseless);
  receiver.start(io);
  io.run_for(0s);
  ASSERT_EQ(io.to_flight_log.size(), 1u);
  EXPECT_NEAR(fixes(io)[0].v_ECEF.y, -7e6 * kOmegaEarth_radps, 1e-12);
  EXPECT_EQ(fixes(io)[0].v_ECEF.x, 0);
}

// Body axes: x_B = y_ECI, y_B = -x_ECI, z_B = z_ECI. An arm of (1, 2, 3) in B is (-2, 1, 3) in ECI;
// the Earth has turned by 90 deg, which makes (1, 2, 3) of it in ECEF. The velocity of the antenna
// over the ground follows from where the antenna is.
TEST(GnssReceiverTest, PositionIsThatOfTheAntenna) {
  FakeDeviceContext io(kStart);
  io.attitude = {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}};
  io.truth_at = [](SimTime t) { return OrbitState{.t = t, .r_ECI = {7e6, 0, 0}}; };
  io.surroundings_at = [](SimTime) {
    return Surroundings{.R_EI = {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}},
                        .omega_EI_ECEF = {0, 0, kOmegaEarth_radps}};
  };
  GnssReceiverOptions options = kNoiseless;
  options.lever_arm_B = {1, 2, 3};
  GnssReceiver receiver(options);
  receiver.start(io);
  io.run_for(0s);
  ASSERT_EQ(io.to_flight_log.size(), 1u);
  const Vec3 antenna_ECEF{1, -7e6 + 2, 3};
  EXPECT_EQ(fixes(io)[0].r_ECEF, antenna_ECEF);
  EXPECT_NEAR(fixes(io)[0].v_ECEF.x, kOmegaEarth_radps * (-7e6 + 2), 1e-12);
  EXPECT_NEAR(fixes(io)[0].v_ECEF.y, -kOmegaEarth_radps * 1, 1e-12);
}

TEST(GnssReceiverTest, EpochsAreMultiplesOfThePeriodWheneverItIsSwitchedOn) {
  FakeDeviceContext io(kStart + 3700ms);
  GnssReceiver receiver(kNoiseless);
  receiver.start(io);
  io.run_until(kStart + 31s);
  ASSERT_EQ(io.to_flight_log.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(io.to_flight_log[i].t, kStart + (i + 1) * 10s);
    EXPECT_EQ(fixes(io)[i].t, kStart + (i + 1) * 10s);
  }
}

TEST(GnssReceiverTest, EpochAtPowerOnIsNotMissed) {
  FakeDeviceContext io(kStart);
  GnssReceiver receiver(kNoiseless);
  receiver.start(io);
  io.run_until(kStart + 10s);
  ASSERT_EQ(io.to_flight_log.size(), 2u);
  EXPECT_EQ(io.to_flight_log[0].t, kStart);
}

TEST(GnssReceiverTest, HeaderSaysTheEpochAtTenHertz) {
  FakeDeviceContext io(kStart + 1ns);
  GnssReceiverOptions options = kNoiseless;
  options.period = 100ms;
  GnssReceiver receiver(options);
  receiver.start(io);
  io.run_until(kStart + 1s);
  ASSERT_EQ(io.to_flight_log.size(), 10u);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(fixes(io)[i].t, kStart + (i + 1) * 100ms);
}

struct Moments {
  double mean = 0, variance = 0;
};

template <class Pick>
Moments moments(const std::vector<Fix>& all, Pick pick) {
  const double n = static_cast<double>(all.size());
  Moments m;
  for (const Fix& fix : all) m.mean += pick(fix) / n;
  for (const Fix& fix : all) m.variance += (pick(fix) - m.mean) * (pick(fix) - m.mean) / (n - 1);
  return m;
}

// Of n normal values the mean deviates by sigma/sqrt(n), the variance by sigma^2 sqrt(2/(n-1));
// 4.5 deviations are exceeded by chance once in 150 000 seeds.
void expect_normal(const Moments& m, double sigma, double n) {
  EXPECT_NEAR(m.mean, 0, 4.5 * sigma / std::sqrt(n));
  EXPECT_NEAR(m.variance, sigma * sigma, 4.5 * sigma * sigma * std::sqrt(2 / (n - 1)));
}

TEST(GnssReceiverTest, NoiseIsWhiteWithTheStatedSigmaOnEachAxis) {
  FakeDeviceContext io(kStart);
  GnssReceiver receiver({.period = 100ms, .lever_arm_B = {0, 0, 0}});
  receiver.start(io);
  io.run_for(2000s);
  const std::vector<Fix> all = fixes(io);
  const double n = static_cast<double>(all.size());
  ASSERT_EQ(n, 20'001);
  for (int axis = 0; axis < 3; ++axis) {
    expect_normal(moments(all, [&](const Fix& fix) { return fix.r_ECEF[axis]; }), 1.5, n);
    expect_normal(moments(all, [&](const Fix& fix) { return fix.v_ECEF[axis]; }), 0.03, n);
  }
  // White, and independent between axes and between position and velocity: sample correlations
  // deviate from 0 by 1/sqrt(n).
  const auto expect_uncorrelated = [&](auto a, auto b, double sigma_a, double sigma_b) {
    double sum = 0;
    for (std::size_t i = 1; i < all.size(); ++i) sum += a(i) * b(i);
    EXPECT_NEAR(sum / (n * sigma_a * sigma_b), 0, 4.5 / std::sqrt(n));
  };
  const auto x = [&](std::size_t i) { return all[i].r_ECEF.x; };
  const auto y = [&](std::size_t i) { return all[i].r_ECEF.y; };
  const auto x_before = [&](std::size_t i) { return all[i - 1].r_ECEF.x; };
  const auto v_x = [&](std::size_t i) { return all[i].v_ECEF.x; };
  expect_uncorrelated(x, y, 1.5, 1.5);
  expect_uncorrelated(x, x_before, 1.5, 1.5);
  expect_uncorrelated(x, v_x, 1.5, 0.03);
}

TEST(GnssReceiverTest, FrameStatesTheSigmasOfItsNoise) {
  FakeDeviceContext io(kStart);
  GnssReceiver receiver({.sigma_position_m = 2.5, .sigma_velocity_mps = 0.125});
  receiver.start(io);
  io.run_for(0s);
  ASSERT_EQ(io.to_flight_log.size(), 1u);
  EXPECT_EQ(fixes(io)[0].sigma_r, 2.5f);
  EXPECT_EQ(fixes(io)[0].sigma_v, 0.125f);
}

TEST(GnssReceiverTest, NothingIsSentDuringAnOutage) {
  FakeDeviceContext io(kStart);
  GnssReceiver receiver(kNoiseless);
  receiver.start(io);
  io.run_until(kStart + 15s);
  io.faults["outage"] = 1;
  io.run_until(kStart + 35s);
  io.faults.clear();
  io.run_until(kStart + 45s);
  std::vector<SimTime> sent;
  for (const auto& frame : io.to_flight_log) sent.push_back(frame.t);
  EXPECT_THAT(sent, testing::ElementsAre(kStart, kStart + 10s, kStart + 40s));
}

TEST(GnssReceiverTest, NoiseAfterAnOutageIsWhatItWouldHaveBeenWithout) {
  const auto last_frame = [](bool outage) {
    FakeDeviceContext io(kStart);
    GnssReceiver receiver;
    receiver.start(io);
    if (outage) io.faults["outage"] = 1;
    io.run_until(kStart + 95s);
    io.faults.clear();
    io.run_until(kStart + 200s);  // the satellites must be found again
    return io.to_flight_log.back().bytes;
  };
  EXPECT_EQ(last_frame(true), last_frame(false));
}

TEST(GnssReceiverOptionsTest, ValuesOutOfRangeAreNamedWithTheirRange) {
  const auto expect_refused = [](const GnssReceiverOptions& options, const char* text) {
    EXPECT_THAT([&] { GnssReceiver receiver(options); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text)));
  };
  expect_refused({.period = 99ms}, "period = 99 ms");
  expect_refused({.period = 61s}, "100 ms to 60 s");
  expect_refused({.period = 100ms + 1us}, "whole milliseconds");
  expect_refused({.sigma_position_m = -1}, "sigma_position_m = -1; accepted: 0 to");
  expect_refused({.sigma_velocity_mps = std::numeric_limits<double>::quiet_NaN()},
                 "sigma_velocity_mps = nan");
  expect_refused({.lever_arm_B = {0, 101, 0}}, "|lever_arm_B| = 101 m");
}

TEST(GnssReceiverOptionsTest, EndsOfThePeriodsRangeAreAccepted) {
  EXPECT_NO_THROW(GnssReceiver({.period = 100ms}));
  EXPECT_NO_THROW(GnssReceiver({.period = 60s}));
}

}  // namespace
}  // namespace orrery
