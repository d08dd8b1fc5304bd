#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace orrery {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const SimTime kStart(days(16510));
const QuasiNonsingularElements kElements{6928137, 0.0003, 0.00095, 1.7033, 5.5, 0.2};
constexpr double kMass_kg = 11;
// A strong thruster: 10 N at 45 s for a minute takes 1.36 kg of 11 kg and gives 58 m/s.
constexpr double kForce_N = 10, kIsp_s = 45;
constexpr double kExhaust_mps = kStandardGravity_mps2 * kIsp_s;
constexpr double kFlow_kgps = kForce_N / kExhaust_mps;

OrbitState initial_state() {
  const InertialState s = to_inertial(kElements);
  return {kStart, s.r_ECI, s.v_ECI, kMass_kg};
}

const Vec3 kAlong = unit(Vec3{1, -2, 2});

// Takes away the point mass that the propagator carries: what remains is motion in free space.
class NoGravity final : public ForceModel {
 public:
  std::string_view name() const override { return "no gravity"; }
  Vec3 acceleration_ECI(const OrbitState& s, const Surroundings&) const override {
    const double r = norm(s.r_ECI);
    return kMuEarth_m3ps2 / (r * r * r) * s.r_ECI;
  }
};

// Turns at a constant rate about z, from the ECI axes at the start.
class Spin final : public AttitudeLaw {
 public:
  explicit Spin(double rate_radps) : rate_radps_(rate_radps) {}
  Mat3 R_BI(SimTime t, const InertialState&) const override {
    return rotation_about_z(rate_radps_ * to_seconds(t - kStart));
  }

 private:
  double rate_radps_;
};

// Looks along x until `jump`, along y from then on.
class Jump final : public AttitudeLaw {
 public:
  Jump(SimTime at, bool announces) : at_(at), announces_(announces) {}
  Mat3 R_BI(SimTime t, const InertialState&) const override {
    return rotation_about_z(t < at_ ? 0 : 2 * std::atan(1));
  }
  std::optional<SimTime> next_discontinuity(SimTime t) const override {
    if (!announces_ || t >= at_) return {};
    return at_;
  }

 private:
  SimTime at_;
  bool announces_;
};

SpacecraftOrbitOptions earth_options() {
  static const auto environment = std::make_shared<const EarthEnvironment>();
  return {.forces = {make_earth_gravity(8)}, .environment = environment};
}

SpacecraftOrbitOptions free_space(Duration step = 1s) {
  SpacecraftOrbitOptions options = earth_options();
  options.step = step;
  options.forces = {std::make_shared<NoGravity>()};
  return options;
}

// Tsiolkovsky, and its integral, along the thrust.
double rocket_dv_mps(double t_s) {
  return -kExhaust_mps * std::log(1 - kFlow_kgps * t_s / kMass_kg);
}
double rocket_distance_m(double t_s) {
  return kExhaust_mps *
         (t_s + (kMass_kg / kFlow_kgps - t_s) * std::log(1 - kFlow_kgps * t_s / kMass_kg));
}

// Cancelling gravity in elements leaves the rounding of the elements, 1e-9 m and 5e-12 m/s a step,
// 60 of them, and RK4's error of a step of 1 s in a problem that elements do not suit.
// Observed 1.4e-7 m, 1.5e-10 m/s.
TEST(ThrustTest, BurnInFreeSpaceFollowsTheRocketEquation) {
  SpacecraftOrbit orbit(initial_state(), free_space());
  orbit.set_thrust(kStart, Thrust::inertial(kForce_N * kAlong, kIsp_s));
  const OrbitState start = initial_state();
  for (const Duration d : {Duration(1s), Duration(17500ms), Duration(60s)}) {
    const double t_s = to_seconds(d);
    const OrbitState s = orbit.at(kStart + d);
    EXPECT_NEAR(s.mass_kg, kMass_kg - kFlow_kgps * t_s, 1e-14) << t_s;
    EXPECT_LT(norm(s.v_ECI - start.v_ECI - rocket_dv_mps(t_s) * kAlong), 1e-9) << t_s;
    EXPECT_LT(norm(s.r_ECI - start.r_ECI - t_s * start.v_ECI - rocket_distance_m(t_s) * kAlong),
              4e-7)
        << t_s;
    const Propulsion delivered = orbit.propulsion(kStart + d);
    EXPECT_NEAR(delivered.delta_v_mps, rocket_dv_mps(t_s), 1e-13) << t_s;
    EXPECT_NEAR(delivered.impulse_Ns, kForce_N * t_s, 1e-12) << t_s;
  }
}

// RK4: halving the step divides the error by 16 until rounding.
TEST(ThrustTest, ErrorFallsWithTheFourthPowerOfTheStep) {
  const auto error_m = [](Duration step) {
    SpacecraftOrbit orbit(initial_state(), free_space(step));
    orbit.set_thrust(kStart, Thrust::inertial(kForce_N * kAlong, kIsp_s));
    const Vec3 expected =
        initial_state().r_ECI + 240 * initial_state().v_ECI + rocket_distance_m(240) * kAlong;
    return norm(orbit.at(kStart + 240s).r_ECI - expected);
  };
  const double order = std::log2(error_m(40s) / error_m(20s));
  RecordProperty("order", std::to_string(order));
  EXPECT_NEAR(order, 4, 0.3);
}

// A body-fixed force on a body that turns at w about z describes a circle in velocity:
// dv = F/(m w) (sin wt, 1 - cos wt). Constant mass, so that nothing else is in it.
TEST(ThrustTest, BodyFixedThrustFollowsTheAttitudeDuringTheBurn) {
  constexpr double kRate_radps = 0.05;
  SpacecraftOrbitOptions options = free_space();
  options.attitude = std::make_shared<Spin>(kRate_radps);
  SpacecraftOrbit orbit(initial_state(), options);
  orbit.set_thrust(kStart, {.force_B = {kForce_N, 0, 0}, .nozzle_N = kForce_N});
  for (const Duration d : {Duration(10s), Duration(33300ms), Duration(60s)}) {
    const double angle = kRate_radps * to_seconds(d);
    const Vec3 dv =
        kForce_N / (kMass_kg * kRate_radps) * Vec3{std::sin(angle), 1 - std::cos(angle)};
    // RK4 on the direction: w^4 h^5 / 2880 F/m a step, 60 steps: 1e-7; between grid points
    // h^4 w^3 / 384 F/m = 3e-7.
    EXPECT_LT(norm(orbit.at(kStart + d).v_ECI - initial_state().v_ECI - dv), 4e-7) << angle;
  }
  EXPECT_EQ(orbit.at(kStart + 60s).mass_kg, kMass_kg);
  // In body axes the impulse is the nozzle's, whatever the body does.
  EXPECT_NEAR(orbit.propulsion(kStart + 60s).delta_v_mps, kForce_N * 60 / kMass_kg, 1e-12);
}

// To first order in its length T a burn is an impulse in its middle. The second order is the
// gradient of gravity, at most 2 n^2 = 2.4e-6, over T: dv 2 n^2 T^2/24 more speed, which in 876 s
// drifts by up to 3 times the way: 3 * 876 s * 1e-9 T^2 = 2.6e-6 T^2. The grids differ: 2e-8 m/s of
// a step, undone by the steps after it. Observed 0.9e-6 T^2 and 5e-9 m.
TEST(ThrustTest, ShortBurnTendsToAnImpulseInItsMiddle) {
  const SimTime middle = kStart + 123s + 456'789'012ns;
  const Vec3 dv = 0.01 * kAlong;
  SpacecraftOrbit kicked(initial_state(), earth_options());
  kicked.apply_impulse(middle, dv);
  const Vec3 r_kicked = kicked.at(kStart + 1000s).r_ECI;
  const auto difference_m = [&](Duration length) {
    SpacecraftOrbit burnt(initial_state(), earth_options());
    const double force_N = kMass_kg * 0.01 / to_seconds(length);
    burnt.set_thrust(middle - length / 2, {.force_ECI = force_N * kAlong});
    burnt.set_thrust(middle + length / 2, {});
    return norm(burnt.at(kStart + 1000s).r_ECI - r_kicked);
  };
  for (const Duration length : {Duration(30s), Duration(1s), Duration(1ms)}) {
    const double T = to_seconds(length);
    EXPECT_LT(difference_m(length), 2.6e-6 * T * T + 3e-8) << T;
  }
}

// Against the same grid without thrust. One microsecond more of 10 N on 11 kg is 9.1e-7 m/s. The
// edges lie at odd nanoseconds, on and beside grid points, and across several. Tolerance: rounding
// of elements, 1e-11 m/s, and gravity's gradient over the way gained, 2 mu/r^3 a T^3/6 = 4e-7 a
// T^3.
TEST(ThrustTest, EdgesActToTheNanosecond) {
  const auto velocity = [](Duration begin, Duration end, const Thrust& thrust) {
    SpacecraftOrbit orbit(initial_state(), earth_options());
    orbit.set_thrust(kStart + begin, thrust);
    orbit.set_thrust(kStart + end, {});
    return orbit.at(kStart + end).v_ECI;
  };
  const Vec3 a = kForce_N / kMass_kg * kAlong;
  const auto gain = [&](Duration begin, Duration end) {
    return velocity(begin, end, {.force_ECI = kMass_kg * a}) - velocity(begin, end, {});
  };
  for (const auto& [begin, end] :
       {std::pair<Duration, Duration>(13'000'000'001ns, 13'020'000'007ns),
        {19'999'999'999ns, 20'000'000'001ns},
        {20s, 20s + 1ns},
        {13'000'000'001ns, 47'123'456'789ns}}) {
    const double T = to_seconds(end - begin);
    const double tolerance = 2e-11 + 4e-7 * norm(a) * T * T * T;
    EXPECT_LT(norm(gain(begin, end) - T * a), tolerance)
        << to_string(begin) << " to " << to_string(end);
    const Vec3 more = gain(begin, end + 1us) - gain(begin, end);
    EXPECT_LT(norm(more - 1e-6 * a), 4e-11 + 3e-6 * 4e-7 * norm(a) * T * T)
        << to_string(begin) << " to " << to_string(end);
  }
}

TEST(ThrustTest, NozzlesOpenAndCloseIndependently) {
  const Thrust x = Thrust::inertial({kForce_N, 0, 0}, kIsp_s);
  const Thrust y = Thrust::inertial({0, 2 * kForce_N, 0}, kIsp_s);
  SpacecraftOrbit orbit(initial_state(), free_space());
  orbit.set_thrust(kStart + 1s, x);
  orbit.set_thrust(kStart + 1500ms, x + y);
  orbit.set_thrust(kStart + 1750ms, x);
  orbit.set_thrust(kStart + 2s, {});
  const double m1 = kMass_kg - 0.5 * kFlow_kgps, m2 = m1 - 0.25 * 3 * kFlow_kgps,
               m3 = m2 - 0.25 * kFlow_kgps;
  const Vec3 dv{
      kExhaust_mps * (std::log(kMass_kg / m1) + std::log(m1 / m2) / 3 + std::log(m2 / m3)),
      kExhaust_mps * std::log(m1 / m2) * 2 / 3, 0};
  EXPECT_NEAR(orbit.at(kStart + 3s).mass_kg, m3, 1e-14);
  EXPECT_LT(norm(orbit.at(kStart + 3s).v_ECI - initial_state().v_ECI - dv), 1e-9);
  const Propulsion delivered = orbit.propulsion(kStart + 3s);
  EXPECT_NEAR(delivered.delta_v_mps, norm(dv), 1e-13) << "one firing, one vector";
  EXPECT_NEAR(delivered.impulse_Ns, kForce_N * (1 + 2 * 0.25), 1e-13)
      << "nozzles add up as scalars";
  EXPECT_TRUE(orbit.thrust().is_off());
}

TEST(ThrustTest, FiringsAndImpulsesAddUp) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  for (const double sign : {1.0, -1.0}) {
    const SimTime t = kStart + (sign > 0 ? 100s : 200s);
    orbit.set_thrust(t, {.force_ECI = sign * kForce_N * kAlong, .nozzle_N = kForce_N});
    orbit.set_thrust(t + 1s, {});
  }
  orbit.apply_impulse(kStart + 300s, {0, 0.5, 0});
  EXPECT_NEAR(orbit.propulsion(kStart + 1h).delta_v_mps, 2 * kForce_N / kMass_kg + 0.5, 1e-13);
  EXPECT_NEAR(orbit.propulsion(kStart + 1h).impulse_Ns, 2 * kForce_N + 0.5 * kMass_kg, 1e-12);
}

TEST(ThrustTest, LookingDuringABurnChangesNoBit) {
  SpacecraftOrbitOptions options = earth_options();
  options.attitude = std::make_shared<Spin>(0.01);
  SpacecraftOrbit seldom(initial_state(), options), often(initial_state(), options);
  const Thrust thrust = Thrust::body_fixed({0, kForce_N, 0}, kIsp_s);
  const auto fly = [&](SpacecraftOrbit& orbit, bool looks) {
    std::vector<OrbitState> seen;
    for (int i = 0; i < 600; ++i) {
      const SimTime t = kStart + i * 100ms;
      if (i == 137) orbit.set_thrust(t + 12'345'679ns, thrust);
      if (i == 351) orbit.set_thrust(t + 1ns, Thrust{});
      if (looks) (void)orbit.at(t + 99ms);
      if (i % 50 == 49) seen.push_back(orbit.at(t + 99ms));
    }
    return seen;
  };
  const std::vector<OrbitState> a = fly(seldom, false), b = fly(often, true);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].r_ECI, b[i].r_ECI) << i;
    EXPECT_EQ(a[i].v_ECI, b[i].v_ECI) << i;
    EXPECT_EQ(a[i].mass_kg, b[i].mass_kg) << i;
  }
  EXPECT_LT(a.back().mass_kg, kMass_kg - 0.4);
}

// A look inside a 30 ms burn: v = v0 + (g + F/m) dt. A quintic through positions that are rounded
// to 1e-9 m would err by 15 of it over 30 ms, 5e-7 m/s. The reference: the same state, stepped to
// the look instead of interpolated. Observed 2e-12 m/s.
TEST(ThrustTest, LooksInsideAShortBurnKeepTheVelocity) {
  const SimTime begin = kStart + 14s;
  const auto burning = [&](SimTime end) {
    SpacecraftOrbit orbit(initial_state(), earth_options());
    orbit.set_thrust(begin, Thrust::inertial(kForce_N * kAlong, kIsp_s));
    orbit.set_thrust(end, {});
    return orbit;
  };
  for (int ms = 3; ms < 30; ms += 4) {
    SpacecraftOrbit to_the_end = burning(begin + 30ms), to_the_look = burning(begin + ms * 1ms);
    const OrbitState look = to_the_end.recent(begin + ms * 1ms);
    const OrbitState step = to_the_look.at(begin + ms * 1ms);
    EXPECT_LT(norm(look.v_ECI - step.v_ECI), 5e-11) << ms;
    EXPECT_LT(norm(look.r_ECI - step.r_ECI), 1e-8) << ms;
    EXPECT_NEAR(look.mass_kg, step.mass_kg, 2e-15) << ms;
  }
}

// Both interpolants against Kepler, where they meet: in a step of just under 2 s.
TEST(ThrustTest, LooksInsideAStepBelowTwoSecondsLieOnTheOrbit) {
  SpacecraftOrbitOptions options = earth_options();
  options.forces.clear();
  options.step = 1999ms;
  SpacecraftOrbit orbit(initial_state(), options);
  const double n = std::sqrt(kMuEarth_m3ps2 / kElements.a_m) / kElements.a_m;
  for (int i = 0; i <= 400; ++i) {
    QuasiNonsingularElements x = kElements;
    x.u_rad += n * 0.05 * i;
    const OrbitState look = orbit.at(kStart + i * 50ms);
    EXPECT_LT(norm(look.r_ECI - to_inertial(x).r_ECI), 2e-8) << i;
    EXPECT_LT(norm(look.v_ECI - to_inertial(x).v_ECI), 6e-10) << i;
  }
}

// Forward through a burn, back through it: rounding (1e-9 m, 1e-12 m/s a step), RK4's error both
// ways, and the nanosecond by which the last stage lies before a step's end. Observed 2e-13 m/s.
TEST(ThrustTest, ForwardAndBackThroughABurnCloses) {
  OrbitDynamics dynamics(earth_options().environment, earth_options().forces,
                         std::make_shared<Spin>(0.001));
  dynamics.set_thrust(Thrust::body_fixed({kForce_N, 0, 0}, kIsp_s));
  const OrbitDynamics::State start = dynamics.start(initial_state());
  OrbitDynamics::State state = start;
  for (int i = 1; i <= 100; ++i) state = dynamics.step(state, kStart + i * 1s);
  EXPECT_NEAR(state.orbit.mass_kg, kMass_kg - 100 * kFlow_kgps, 1e-13);
  for (int i = 99; i >= 0; --i) state = dynamics.step(state, kStart + i * 1s);
  EXPECT_NEAR(state.orbit.mass_kg, kMass_kg, 1e-13);
  EXPECT_LT(norm(state.orbit.r_ECI - start.orbit.r_ECI), 1e-7);
  EXPECT_LT(norm(state.orbit.v_ECI - start.orbit.v_ECI), 1e-10);
}

// The attitude jumps inside a step of 10 s. Announced, the burn delivers exactly its two
// parts, but for RK4 on cancelled gravity; observed 1.8e-9 m/s.
TEST(ThrustTest, BurnIsCutWhereTheAttitudeJumps) {
  const SimTime jump = kStart + 3s;
  const auto gain = [&](bool announces) {
    SpacecraftOrbitOptions options = free_space(10s);
    options.attitude = std::make_shared<Jump>(jump, announces);
    SpacecraftOrbit orbit(initial_state(), options);
    orbit.set_thrust(kStart, {.force_B = {kForce_N, 0, 0}});
    return orbit.at(kStart + 10s).v_ECI - initial_state().v_ECI;
  };
  const Vec3 expected = kForce_N / kMass_kg * Vec3{3, 7, 0};
  EXPECT_LT(norm(gain(true) - expected), 2e-8);
  EXPECT_GT(norm(gain(false) - expected), 0.1) << "the test would not notice";
}

TEST(ThrustTest, AttitudeChangesCutTheGridOnlyUnderBodyFixedThrust) {
  SpacecraftOrbitOptions options = earth_options();
  options.attitude = std::make_shared<Spin>(0);
  SpacecraftOrbit orbit(initial_state(), options);
  int changes = 0;
  const auto change = [&] { ++changes; };
  orbit.change_attitude(kStart + 3s, change);
  EXPECT_EQ(orbit.steps(), 0u);
  orbit.set_thrust(kStart + 4s, {.force_ECI = {1, 0, 0}});
  orbit.change_attitude(kStart + 5s, change);
  EXPECT_EQ(orbit.steps(), 1u) << "0, 4";
  orbit.set_thrust(kStart + 6s, {.force_B = {1, 0, 0}});
  orbit.change_attitude(kStart + 7s, change);
  EXPECT_EQ(orbit.steps(), 3u) << "0, 4, 6, 7";
  EXPECT_EQ(changes, 3);
}

TEST(ThrustTest, WrongThrustsAreRefusedAndChangeNothing) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto setting = [&](const Thrust& thrust) {
    return [&orbit, thrust] { orbit.set_thrust(kStart + 5s, thrust); };
  };
  EXPECT_THAT(setting({.force_ECI = {nan, 0, 0}}),
              ThrowsMessage<std::invalid_argument>(HasSubstr("not finite")));
  EXPECT_THAT(setting({.mass_flow_kgps = -1}),
              ThrowsMessage<std::invalid_argument>(HasSubstr("mass_flow_kgps = -1")));
  EXPECT_THAT(setting({.force_B = {1, 0, 0}}),
              ThrowsMessage<std::invalid_argument>(HasSubstr("needs an attitude")));
  EXPECT_THAT(
      [] {
        (void)Thrust::inertial({1, 0, 0}, 0);
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("isp_s = 0")));
  SpacecraftOrbit other(initial_state(), earth_options());
  EXPECT_EQ(orbit.at(kStart + 10s).v_ECI, other.at(kStart + 10s).v_ECI);
  EXPECT_EQ(orbit.propulsion(kStart + 10s).delta_v_mps, 0);
}

TEST(ThrustTest, AThrustThatUsesUpAllMassStopsThePropagation) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  orbit.set_thrust(kStart, {.force_ECI = {1e-3, 0, 0}, .mass_flow_kgps = 1});
  EXPECT_NO_THROW((void)orbit.at(kStart + 10s));
  EXPECT_THAT([&] { (void)orbit.at(kStart + 11s); },
              ThrowsMessage<PropagationError>(HasSubstr("used up all mass")));
}

}  // namespace
}  // namespace orrery
