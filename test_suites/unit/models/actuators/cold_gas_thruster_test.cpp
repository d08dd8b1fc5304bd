#include <orrery/models/actuators/cold_gas_thruster.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "../support/fake_device_context.hpp"

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr SimTime kStart = from_ns(1'426'464'000'000'000'000);
constexpr double kForce_N = 0.025, kMass_kg = 11;
constexpr double kExhaust_mps = 9.80665 * 45;
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The layouts of orrery_messages.h, written out: i64 mid_burn_ns, f64 dv_ECI[3].
ByteBuffer delta_v_command(std::int64_t mid_burn_ns, const Vec3& dv_ECI) {
  ByteBuffer message(32);
  std::memcpy(message.data(), &mid_burn_ns, 8);
  std::memcpy(message.data() + 8, &dv_ECI.x, 8);
  std::memcpy(message.data() + 16, &dv_ECI.y, 8);
  std::memcpy(message.data() + 24, &dv_ECI.z, 8);
  return message;
}

// i64 start_ns, u8 nozzle, f64 duration_s.
ByteBuffer on_time_command(std::int64_t start_ns, int nozzle, double duration_s) {
  ByteBuffer message(17);
  std::memcpy(message.data(), &start_ns, 8);
  message[8] = static_cast<std::byte>(nozzle);
  std::memcpy(message.data() + 9, &duration_s, 8);
  return message;
}

ColdGasThrusterOptions without_errors() {
  return {.scale_sigma = 0, .misalignment_sigma_deg = 0, .shot_sigma = 0};
}

struct Rig {
  explicit Rig(const ColdGasThrusterOptions& options = without_errors(), std::uint64_t seed = 1)
      : io(kStart, seed), thruster(options) {
    io.truth_at = [](SimTime t) {
      return OrbitState{.t = t, .r_ECI = {}, .v_ECI = {}, .mass_kg = kMass_kg};
    };
    thruster.start(io);
  }
  void burn(Duration from_now, const Vec3& dv_ECI) {
    thruster.from_flight(io, delta_v_command(io.onboard_ns() + to_ns(from_now), dv_ECI));
  }
  void fire(Duration from_now, int nozzle, double duration_s) {
    thruster.from_flight(io,
                         on_time_command(io.onboard_ns() + to_ns(from_now), nozzle, duration_s));
  }
  void expect_rejected(int count, std::string_view why) {
    EXPECT_EQ(thruster.rejected(), count);
    ASSERT_FALSE(io.log_lines.empty());
    EXPECT_EQ(io.log_lines.back().level, DeviceContext::kWarning);
    EXPECT_THAT(io.log_lines.back().text, HasSubstr(std::string(why)));
  }
  FakeDeviceContext io;
  ColdGasThruster thruster;
};

struct ColdGasThrusterTest : Rig, testing::Test {};

// 1 mm/s of 11 kg is 11 mN s: 440 ms at 25 mN. The valve is told 10 ms before thrust begins and 7
// ms before it ends.
TEST_F(ColdGasThrusterTest, FiringHasFourEdgesToTheNanosecond) {
  const Duration middle = 30s + 123'456'789ns;
  burn(middle, {1e-3, 0, 0});
  io.run_for(1min);
  ASSERT_EQ(io.thrusts.size(), 2u);
  EXPECT_EQ(io.thrusts[0].t, kStart + middle - 220ms);
  EXPECT_EQ(io.thrusts[0].thrust.force_B, (Vec3{kForce_N, 0, 0}));
  EXPECT_EQ(io.thrusts[0].thrust.force_ECI, Vec3{});
  EXPECT_DOUBLE_EQ(io.thrusts[0].thrust.mass_flow_kgps, kForce_N / kExhaust_mps);
  EXPECT_EQ(io.thrusts[1].t, kStart + middle + 220ms);
  EXPECT_TRUE(io.thrusts[1].thrust.is_off());
  ASSERT_EQ(thruster.shot_log().size(), 1u);
  const ColdGasThruster::Shot& shot = thruster.shot_log()[0];
  EXPECT_EQ(shot.nozzle, 0);
  EXPECT_EQ(shot.on_time, 440ms);
  EXPECT_EQ(shot.valve_opens, kStart + middle - 230ms);
  EXPECT_EQ(shot.thrust_begins, kStart + middle - 220ms);
  EXPECT_EQ(shot.valve_closes, kStart + middle + 213ms);
  EXPECT_EQ(shot.thrust_ends, kStart + middle + 220ms);
  EXPECT_NEAR(shot.impulse_Ns, 0.011, 1e-16);
  EXPECT_EQ(thruster.burns(), 1);
  EXPECT_EQ(thruster.burn_log()[0].t, kStart + middle);
  EXPECT_EQ(thruster.burn_log()[0].dv_ECI, (Vec3{1e-3, 0, 0}));
  EXPECT_TRUE(thruster.burn_log()[0].executed);
}

TEST_F(ColdGasThrusterTest, EveryAxisFiresItsNozzleAroundTheSameMiddle) {
  burn(30s, {1e-3, -0.5e-3, 2e-3});
  io.run_for(1min);
  // z: 880 ms, x: 440 ms, y: 220 ms; the forces add up where they overlap.
  std::vector<std::pair<Duration, Vec3>> edges;
  for (const auto& edge : io.thrusts)
    edges.emplace_back(edge.t - kStart - 30s, edge.thrust.force_B);
  const double F = kForce_N;
  EXPECT_THAT(edges, ElementsAre(std::pair<Duration, Vec3>(-440ms, {0, 0, F}),
                                 std::pair<Duration, Vec3>(-220ms, {F, 0, F}),
                                 std::pair<Duration, Vec3>(-110ms, {F, -F, F}),
                                 std::pair<Duration, Vec3>(110ms, {F, 0, F}),
                                 std::pair<Duration, Vec3>(220ms, {0, 0, F}),
                                 std::pair<Duration, Vec3>(440ms, {0, 0, 0})));
  EXPECT_THAT(thruster.commanded_on_times_s(), ElementsAre(0.44, 0, 0, 0.22, 0.88, 0));
}

// The body turns by R3(w t), w = 1 rad/s; the firing is prepared 550 ms before its middle and must
// use the attitude there: dv along ECI x is cos, -sin in body axes.
TEST_F(ColdGasThrusterTest, OnTimesUseTheAttitudeAtMidBurn) {
  io.body_rate_B = {0, 0, 1};
  burn(30s,
       {1e-3, 0, 0});  // the longest possible on-time is 440 ms: prepared 220 + 10 + 100 ms ahead
  io.run_for(1min);
  const double angle = 0.33;
  const auto on_time = [](double dv) { return std::round(dv * kMass_kg / kForce_N * 1e3) * 1e-3; };
  EXPECT_THAT(thruster.commanded_on_times_s(),
              ElementsAre(testing::DoubleNear(on_time(1e-3 * std::cos(angle)), 1e-12), 0, 0,
                          testing::DoubleNear(on_time(1e-3 * std::sin(angle)), 1e-12), 0, 0));
  EXPECT_NEAR(angle,
              std::atan2(thruster.commanded_on_times_s()[3], thruster.commanded_on_times_s()[0]),
              2e-3)
      << "within the quanta";
}

TEST(ColdGasOnTimesTest, AreWholeQuantaAndNoLessThanTheMinimum) {
  const auto ms = [](double impulse_mNs) {
    const auto times = ColdGasThruster::on_times({0, -1e-3 * impulse_mNs, 0}, {});
    EXPECT_EQ(times[0] + times[1] + times[2] + times[4] + times[5], 0ns);
    return times[3] / 1ms;
  };
  EXPECT_EQ(ms(33), 1320);
  EXPECT_EQ(ms(11), 440);
  EXPECT_EQ(ms(11.0124), 440) << "0.025 mN s a quantum";
  EXPECT_EQ(ms(11.0126), 441);
  EXPECT_EQ(ms(0.25), 10);
  EXPECT_EQ(ms(0.24), 10) << "the minimum";
  EXPECT_EQ(ms(0.126), 10);
  EXPECT_EQ(ms(0.124), 0) << "nearer to nothing";
}

TEST_F(ColdGasThrusterTest, CommandedMassFallsByWhatWasCommandedAndIsNeverTruth) {
  io.truth_at = [](SimTime t) {
    return OrbitState{.t = t, .r_ECI = {}, .v_ECI = {}, .mass_kg = 7};
  };
  io.faults["weak"] = 0.5;
  burn(30s, {3e-3, 0, 0});
  io.run_for(1min);
  EXPECT_DOUBLE_EQ(thruster.commanded_mass_kg(), kMass_kg - 0.033 / kExhaust_mps);
  EXPECT_THAT(thruster.commanded_on_times_s(), ElementsAre(1.32, 0, 0, 0, 0, 0));
  EXPECT_DOUBLE_EQ(thruster.propellant_kg(), 0.5 - 0.5 * 0.033 / kExhaust_mps) << "this is";
}

TEST_F(ColdGasThrusterTest, ThrustPerCommandIsWithinHalfAQuantum) {
  for (int k = 1; k <= 20; ++k) {
    const Vec3 dv = 1e-4 * k * Vec3{0.36, -0.48, 0.8};
    burn(30s, dv);
    io.run_for(200s);
    Vec3 impulse_B;
    SimTime last = kStart;
    Vec3 force_B;
    for (const auto& edge : io.thrusts) {
      impulse_B += to_seconds(edge.t - last) * force_B;
      last = edge.t, force_B = edge.thrust.force_B;
    }
    io.thrusts.clear();
    // Half a quantum an axis; below 0.25 mN s the minimum's half.
    for (int axis = 0; axis < 3; ++axis) {
      const double wanted = kMass_kg * dv[axis];
      const double tolerance = std::abs(wanted) < 0.25e-3 ? 0.125e-3 : 0.0126e-3;
      EXPECT_NEAR(impulse_B[axis], wanted, tolerance) << k << ", " << axis;
    }
  }
  EXPECT_EQ(thruster.rejected(), 0);
}

TEST_F(ColdGasThrusterTest, OnTimesThatOverlapAreOneFiring) {
  fire(30s, 1, 0.1);
  fire(30s + 50ms, 2, 0.2);
  fire(29s + 990ms, 4, 0.02);
  io.run_for(1min);
  EXPECT_EQ(thruster.rejected(), 0);
  std::vector<std::pair<Duration, Vec3>> edges;
  for (const auto& edge : io.thrusts)
    edges.emplace_back(edge.t - kStart - 30s, edge.thrust.force_B);
  const double F = kForce_N;
  EXPECT_THAT(edges, ElementsAre(std::pair<Duration, Vec3>(-10ms, {0, 0, F}),
                                 std::pair<Duration, Vec3>(0ms, {-F, 0, F}),
                                 std::pair<Duration, Vec3>(10ms, {-F, 0, 0}),
                                 std::pair<Duration, Vec3>(50ms, {-F, F, 0}),
                                 std::pair<Duration, Vec3>(100ms, {0, F, 0}),
                                 std::pair<Duration, Vec3>(250ms, {0, 0, 0})));
  EXPECT_EQ(thruster.burns(), 1);
  EXPECT_LT(norm(thruster.burn_log()[0].dv_ECI - kForce_N / kMass_kg * Vec3{-0.1, 0.2, 0.02}),
            1e-8);
}

TEST_F(ColdGasThrusterTest, OnTimesThatDoNotFitAreRejected) {
  fire(30s, 0, 1.0);
  fire(30s, 0, 0.1);
  expect_rejected(1, "nozzle 0 has an on-time in this firing already");
  fire(30s, 2, 1.0);
  expect_rejected(2, "impulse of the firing would be 0.0353");
  fire(31s, 1, 0.5);
  expect_rejected(3, "less than 120 s from another firing");  // it begins where the other ends
  fire(30s, 6, 0.1);
  expect_rejected(4, "nozzle 6; accepted: 0 to 5");
  fire(300s, 1, 0.0099);
  expect_rejected(5, "on-time of 0.0099 s; accepted: 10 ms to 1.32 s");
  fire(300s, 1, 1.4);
  expect_rejected(6, "on-time of 1.4 s");
  fire(300s, 1, kNan);
  expect_rejected(7, "on-time of nan s");
  fire(20s - 1ns, 1, 0.1);
  expect_rejected(8, "epoch ");
}

TEST_F(ColdGasThrusterTest, FiringsAreKeptApart) {
  burn(200s, {1e-3, 0, 0});  // from 199.78 s to 200.22 s
  burn(200s + 120s + 440ms - 2ns, {1e-3, 0, 0});
  expect_rejected(1, "less than 120 s from another firing");
  burn(200s - 120s - 440ms + 2ns, {0, 1e-3, 0});
  expect_rejected(2, "less than 120 s");
  burn(200s + 120s + 440ms, {1e-3, 0, 0});
  burn(200s - 120s - 440ms, {1e-3, 0, 0});
  EXPECT_EQ(thruster.rejected(), 2);
  io.run_for(320s + 700ms);
  EXPECT_EQ(thruster.burns(), 3);
  burn(119s, {1e-3, 0, 0});  // 119 s - 0.04 s - 0.22 s after the last one, which is over
  expect_rejected(3, "less than 120 s");
}

TEST_F(ColdGasThrusterTest, CommandsThatCannotBeDoneAreRejected) {
  thruster.from_flight(io, ByteBuffer(31));
  expect_rejected(1, "31 bytes; accepted: 32 (thruster) or 17 (thruster_on_time)");
  burn(30s, {kNan, 0, 0});
  expect_rejected(2, "impulse of nan N s");
  burn(30s, {0, 1e200, 0});
  expect_rejected(3, "impulse of inf N s; accepted: 0.000125 to 0.033");
  burn(30s, {0, 3.01e-3, 0});
  expect_rejected(4, "impulse of 0.0331");
  burn(30s, {0, 11e-6, 0});
  expect_rejected(5, "impulse of 0.000121");
  burn(20s - 1ns, {1e-3, 0, 0});
  expect_rejected(6, "epoch ");
  thruster.from_flight(io, delta_v_command(std::numeric_limits<std::int64_t>::max(), {1e-3, 0, 0}));
  expect_rejected(7, "epoch 9223372036854775807 ns");
  thruster.from_flight(io, delta_v_command(std::numeric_limits<std::int64_t>::min(), {1e-3, 0, 0}));
  EXPECT_EQ(thruster.rejected(), 8);
  // 0.2 mN s in all, but 0.115 mN s an axis: known only when the attitude is.
  burn(30s, 0.2e-3 / kMass_kg / std::sqrt(3) * Vec3{1, 1, 1});
  EXPECT_EQ(thruster.rejected(), 8);
  io.run_for(weeks(1));
  expect_rejected(9, "no nozzle reaches its minimum");
  EXPECT_TRUE(io.thrusts.empty());
  EXPECT_EQ(thruster.burns(), 0);
  burn(20s, {3e-3, 0, 0});
  EXPECT_EQ(thruster.rejected(), 9) << "the limits themselves are accepted";
}

TEST_F(ColdGasThrusterTest, EpochsAreReadOnTheOnboardClock) {
  io.clock_offset = -250ms;
  thruster.from_flight(io, delta_v_command(to_ns(kStart + 30s), {1e-3, 0, 0}));
  io.run_for(1min);
  ASSERT_EQ(io.thrusts.size(), 2u);
  EXPECT_EQ(io.thrusts[0].t, kStart + 30s + 250ms - 220ms);
  thruster.from_flight(io, delta_v_command(io.onboard_ns() + 200'000'000'000, {1e-3, 0, 0}));
  io.run_for(100s);
  io.clock_offset += 1h;
  io.run_for(100s);
  expect_rejected(1, "the onboard clock has stepped over the burn");
  EXPECT_EQ(io.thrusts.size(), 2u);
}

// 1.2 mg of propellant last 1.2e-6 * 441.3 / 0.025 = 21.2 ms of a firing of 440 ms.
TEST(ColdGasThrusterTankTest, ThrustEndsForGoodWhenTheTankIsEmpty) {
  ColdGasThrusterOptions options = without_errors();
  options.propellant_kg = 1.2e-6;
  Rig rig(options);
  rig.burn(30s, {1e-3, 0, 0});
  rig.io.run_for(1min);
  ASSERT_GE(rig.io.thrusts.size(), 2u);
  const double lasts_s = 1.2e-6 * kExhaust_mps / kForce_N;
  EXPECT_NEAR(to_seconds(rig.io.thrusts[1].t - rig.io.thrusts[0].t), lasts_s, 0.5e-9);
  EXPECT_TRUE(rig.io.thrusts[1].thrust.is_off());
  EXPECT_EQ(rig.thruster.propellant_kg(), 0);
  EXPECT_NEAR(rig.thruster.shot_log()[0].impulse_Ns, 1.2e-6 * kExhaust_mps, 1e-11);
  rig.io.run_for(2min);
  rig.burn(30s, {1e-3, 0, 0});
  rig.io.run_for(1min);
  EXPECT_EQ(rig.thruster.burns(), 2);
  EXPECT_TRUE(rig.thruster.burn_log()[0].executed);
  EXPECT_FALSE(rig.thruster.burn_log()[1].executed);
  for (std::size_t i = 1; i < rig.io.thrusts.size(); ++i) {
    EXPECT_TRUE(rig.io.thrusts[i].thrust.is_off()) << i;
  }
  EXPECT_THAT(rig.thruster.commanded_on_times_s(), ElementsAre(0.88, 0, 0, 0, 0, 0))
      << "flight software sees none of it";
}

TEST_F(ColdGasThrusterTest, PropellantFallsWithTheImpulse) {
  for (int i = 0; i < 3; ++i) {
    burn(30s, {1e-3, -1e-3, 1e-3});
    io.run_for(200s);
  }
  EXPECT_NEAR(thruster.propellant_kg(), 0.5 - 9 * 0.011 / kExhaust_mps, 1e-15);
  EXPECT_EQ(io.samples.back().channel, "propellant_kg");
  EXPECT_EQ(io.samples.back().value, thruster.propellant_kg());
}

TEST_F(ColdGasThrusterTest, LostFiringIsCommandedButNothingComesOut) {
  io.faults["lost"] = 1;
  burn(30s, {1e-3, 0, 0});
  io.run_for(1min);
  EXPECT_TRUE(io.thrusts.empty());
  EXPECT_EQ(thruster.burns(), 1);
  EXPECT_FALSE(thruster.burn_log()[0].executed);
  EXPECT_THAT(thruster.commanded_on_times_s(), ElementsAre(0.44, 0, 0, 0, 0, 0));
  EXPECT_EQ(thruster.propellant_kg(), 0.5);
}

TEST_F(ColdGasThrusterTest, StuckClosedNozzleIsMissingFromItsFiring) {
  io.faults["+X/stuck_closed"] = 1;
  burn(30s, {1e-3, 1e-3, 0});
  io.run_for(1min);
  ASSERT_EQ(io.thrusts.size(), 2u);
  EXPECT_EQ(io.thrusts[0].thrust.force_B, (Vec3{0, kForce_N, 0}));
  ASSERT_EQ(thruster.shot_log().size(), 2u);
  EXPECT_EQ(thruster.shot_log()[0].impulse_Ns, 0);
  EXPECT_NEAR(thruster.shot_log()[1].impulse_Ns, 0.011, 1e-16);
}

// Stuck from its closing at 30.213 s; asked again every 100 ms, it hears at 45.013 s that the fault
// has ended at 45 s, and closes 7 ms later.
TEST_F(ColdGasThrusterTest, StuckOpenNozzleFiresUntilTheFaultEnds) {
  io.faults["-X/stuck_open"] = 1;
  burn(30s, {-1e-3, 1e-3, 0});
  io.run_for(45s);
  io.faults.clear();
  io.run_for(15s);
  ASSERT_EQ(io.thrusts.size(), 4u);
  EXPECT_EQ(io.thrusts[2].thrust.force_B, (Vec3{-kForce_N, 0, 0}));
  EXPECT_EQ(io.thrusts[3].t, kStart + 45s + 20ms);
  EXPECT_TRUE(io.thrusts[3].thrust.is_off());
  const double shots_Ns = kForce_N * (45.02 - 29.78) + 0.011;
  EXPECT_NEAR(thruster.propellant_kg(), 0.5 - shots_Ns / kExhaust_mps, 1e-15);
  EXPECT_THAT(thruster.commanded_on_times_s(), ElementsAre(0, 0.44, 0.44, 0, 0, 0));
}

TEST_F(ColdGasThrusterTest, ANewCommandDoesNotCloseAStuckNozzle) {
  io.faults["stuck_open"] = 1;
  burn(30s, {1e-3, 0, 0});
  burn(200s, {1e-3, 0, 0});
  io.run_for(250s);
  ASSERT_EQ(io.thrusts.size(), 1u) << "open since the first firing";
  io.faults.clear();
  io.run_for(1s);
  EXPECT_TRUE(io.thrusts.back().thrust.is_off());
  burn(200s, {1e-3, 0, 0});
  io.run_for(250s);
  EXPECT_EQ(io.thrusts.size(), 4u) << "and works again";
}

TEST_F(ColdGasThrusterTest, WeakAndMisalignedNozzlesPushAsTheFaultSays) {
  io.faults["weak"] = 0.4;
  io.faults["+Z/misaligned"] = 30;
  burn(30s, {0, 0, 1e-3});
  io.run_for(1min);
  ASSERT_EQ(io.thrusts.size(), 2u);
  const Vec3 f = io.thrusts[0].thrust.force_B;
  EXPECT_NEAR(norm(f), 0.4 * kForce_N, 1e-16);
  EXPECT_NEAR(f.z / norm(f), std::cos(30 * kDegree), 1e-14);
  EXPECT_DOUBLE_EQ(io.thrusts[0].thrust.mass_flow_kgps, 0.4 * kForce_N / kExhaust_mps);
}

TEST_F(ColdGasThrusterTest, PowerOnClosesTheValvesAndStartsTheTelemetryAnew) {
  io.faults["stuck_open"] = 1;
  burn(30s, {1e-3, 0, 0});
  io.run_for(31s);
  EXPECT_FALSE(io.thrusts.back().thrust.is_off());
  thruster.start(io);
  EXPECT_TRUE(io.thrusts.back().thrust.is_off());
  EXPECT_THAT(thruster.commanded_on_times_s(), ElementsAre(0, 0, 0, 0, 0, 0));
}

// One +X and one -Y shot each; what a nozzle does in its first and second firing.
struct TwoShots {
  Vec3 first_B, second_B;
};
TwoShots two_shots(const ColdGasThrusterOptions& options, std::uint64_t seed, int nozzle) {
  Rig rig(options, seed);
  rig.fire(30s, nozzle, 0.1);
  rig.fire(300s, nozzle, 0.1);
  rig.io.run_for(400s);
  return {rig.io.thrusts.at(0).thrust.force_B, rig.io.thrusts.at(2).thrust.force_B};
}

// Over 600 seeds, all six nozzles in turn. A sample deviation of N has a relative 1-sigma of
// 1/sqrt(2 N) = 2.9 %, a mean sigma/sqrt(N) = 0.041 sigma; the bounds are four times these.
TEST(ColdGasThrusterErrorsTest, HaveTheSigmasOfTheirOptions) {
  constexpr int kSeeds = 600;
  struct Moments {
    double sum = 0, squares = 0;
    void add(double x) { sum += x, squares += x * x; }
  } scale, shot, tilt_first, tilt_second;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const int nozzle = static_cast<int>(seed % 6), axis = nozzle / 2;
    const double sign = nozzle % 2 == 0 ? 1 : -1;
    const TwoShots shots = two_shots({}, seed, nozzle);
    const Vec3 u = unit(shots.first_B);
    EXPECT_LT(norm(u - unit(shots.second_B)), 1e-15) << "constant per run";
    const double first = norm(shots.first_B) / kForce_N, second = norm(shots.second_B) / kForce_N;
    scale.add((first + second) / 2 - 1);  // variance 2 %^2 + 1 %^2 / 2
    shot.add((first - second) / (first + second) * std::numbers::sqrt2);  // 1 %
    tilt_first.add(std::atan(u[(axis + 1) % 3] / (sign * u[axis])) / kDegree);
    tilt_second.add(std::atan(u[(axis + 2) % 3] / (sign * u[axis])) / kDegree);
  }
  const auto expect = [](const char* what, const Moments& m, double sigma) {
    EXPECT_NEAR(m.sum / kSeeds, 0, 4 * 0.041 * sigma) << what;
    EXPECT_NEAR(std::sqrt(m.squares / kSeeds) / sigma, 1, 4 * 0.029) << what;
  };
  expect("scale", scale, std::sqrt(0.02 * 0.02 + 0.01 * 0.01 / 2));
  expect("shot", shot, 0.01);
  expect("tilt about the first axis", tilt_first, 0.5);
  expect("tilt about the second axis", tilt_second, 0.5);
}

TEST(ColdGasThrusterErrorsTest, NozzlesErrIndependentlyAndSeedsDecide) {
  std::vector<double> forces;
  for (int nozzle = 0; nozzle < 6; ++nozzle)
    forces.push_back(norm(two_shots({}, 5, nozzle).first_B));
  std::sort(forces.begin(), forces.end());
  EXPECT_EQ(std::adjacent_find(forces.begin(), forces.end()), forces.end());
  EXPECT_EQ(two_shots({}, 5, 3).first_B, two_shots({}, 5, 3).first_B);
  EXPECT_NE(two_shots({}, 5, 3).first_B, two_shots({}, 6, 3).first_B);
}

TEST(ColdGasThrusterOptionsTest, ValuesOutOfRangeAreNamed) {
  const auto expect_refused = [](const ColdGasThrusterOptions& options, const char* text) {
    EXPECT_THAT([&] { ColdGasThruster thruster(options); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(text)));
  };
  expect_refused({.force_N = 0}, "force_N = 0 N; accepted: above 0");
  expect_refused({.isp_s = kNan}, "isp_s = nan s");
  expect_refused({.on_time_quantum = 0ns}, "on_time_quantum = 0 s");
  expect_refused({.minimum_on_time = 10500us}, "minimum_on_time = 10.5 ms; accepted: a multiple");
  expect_refused({.maximum_impulse_Ns = -1}, "maximum_impulse_Ns = -1 N s");
  expect_refused({.minimum_interval = -1s}, "minimum_interval = -1 s");
  expect_refused({.minimum_lead = 2s, .maximum_lead = 1s}, "maximum_lead = 1 s");
  expect_refused({.closing_delay = 11ms}, "closing_delay = 11 ms; accepted: 0 s to minimum_on");
  expect_refused({.scale_sigma = 0.2}, "scale_sigma = 0.2; accepted: 0 to 0.1");
  expect_refused({.propellant_kg = -1}, "propellant_kg = -1");
  expect_refused({.commanded_mass_kg = 0}, "commanded_mass_kg = 0 kg");
}

TEST(ColdGasThrusterOptionsTest, NozzlesAreNamedByTheWayTheyPush) {
  EXPECT_EQ(ColdGasThruster::nozzle_name(0), "+X");
  EXPECT_EQ(ColdGasThruster::nozzle_name(3), "-Y");
  EXPECT_THROW((void)ColdGasThruster::nozzle_name(6), std::out_of_range);
}

}  // namespace
}  // namespace orrery
