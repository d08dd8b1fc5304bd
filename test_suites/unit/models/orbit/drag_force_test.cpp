#include <orrery/models/atmosphere/nrlmsise00_atmosphere.hpp>
#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/orbit/drag_force.hpp>
#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace orrery {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const SimTime kStart(days(16510));
constexpr double kEarthRate_radps = 7.292115146706979e-5;

/// A density given by the test; counts how often it was asked.
class TestAtmosphere final : public AtmosphereModel {
 public:
  using Density = std::function<double(SimTime, const Vec3&)>;
  explicit TestAtmosphere(Density density, std::optional<SimTime> jump = {})
      : density_(std::move(density)), jump_(jump) {}
  double density_kgpm3(SimTime t, const Vec3& r_ECEF) const override {
    ++calls;
    return density_(t, r_ECEF);
  }
  std::optional<SimTime> next_discontinuity(SimTime t) const override {
    return jump_ && t < *jump_ ? jump_ : std::nullopt;
  }
  mutable int calls = 0;

 private:
  Density density_;
  std::optional<SimTime> jump_;
};

std::shared_ptr<TestAtmosphere> uniform(double density_kgpm3) {
  return std::make_shared<TestAtmosphere>(
      [density_kgpm3](SimTime, const Vec3&) { return density_kgpm3; });
}

Surroundings around(SimTime t) {
  return {rotation_about_z(kEarthRate_radps * to_seconds(t - kStart)),
          {0, 0, kEarthRate_radps},
          {1.5e11, 0, 0},
          {3.8e8, 0, 0}};
}

const QuasiNonsingularElements kElements{6928137, 0.0003, 0.00095, 1.7033, 5.5, 0.2};

// Kepler's motion.
OrbitState on_orbit(SimTime t) {
  QuasiNonsingularElements x = kElements;
  x.u_rad += std::sqrt(kMuEarth_m3ps2 / x.a_m) / x.a_m * to_seconds(t - kStart);
  const InertialState s = to_inertial(x);
  return {t, s.r_ECI, s.v_ECI, 11};
}

class UniformRotation final : public SpaceEnvironment {
 public:
  Surroundings surroundings(SimTime t) const override { return around(t); }
};

/// Three stages of each step of 10 s in a 20x20 field.
std::vector<OrbitState> flight_of_three_hours() {
  SpacecraftOrbit orbit(on_orbit(kStart), {.forces = {make_earth_gravity(20)},
                                           .environment = std::make_shared<UniformRotation>()});
  std::vector<OrbitState> stages;
  for (SimTime t = kStart; t < kStart + 3h; t += 10s) {
    for (const Duration stage : {Duration(0s), Duration(5s), Duration(10s - 1ns)}) {
      stages.push_back(orbit.at(t + stage));
    }
  }
  return stages;
}

// 1/2 rho Cd A/m v^2 by hand: 0.5 * 1e-12 * 2.2 * 0.06 / 11 * (7500 - 7e6 * 7.292115e-5)^2.
TEST(DragForceTest, IsTheTextbooksForceInAnAtmosphereThatTurns) {
  const DragForce drag(uniform(1e-12));
  const double along = 7500 - 7e6 * kEarthRate_radps, magnitude = 6e-15 * along * along;
  const Vec3 east = drag.acceleration_ECI({kStart, {7e6, 0, 0}, {0, 7500, 0}, 11}, around(kStart));
  EXPECT_NEAR(east.y, -magnitude, 1e-14 * magnitude);
  EXPECT_EQ(east.x, 0);
  EXPECT_EQ(east.z, 0);
  const double against = 7500 + 7e6 * kEarthRate_radps;
  const Vec3 west = drag.acceleration_ECI({kStart, {7e6, 0, 0}, {0, -7500, 0}, 11}, around(kStart));
  EXPECT_NEAR(west.y, 6e-15 * against * against, 1e-14 * 6e-15 * against * against);
  const Vec3 lighter =
      drag.acceleration_ECI({kStart, {7e6, 0, 0}, {0, 7500, 0}, 5.5}, around(kStart));
  EXPECT_NEAR(lighter.y / east.y, 2, 1e-14) << "with the inverse of the present mass";
}

TEST(DragForceTest, AreaCoefficientAndDensityScaleIt) {
  const OrbitState state = on_orbit(kStart);
  const Vec3 a = DragForce(uniform(1e-12)).acceleration_ECI(state, around(kStart));
  const Vec3 b = DragForce(uniform(2e-12), {.area_m2 = 0.12, .drag_coefficient = 1.1})
                     .acceleration_ECI(state, around(kStart));
  EXPECT_NEAR(norm(b) / norm(a), 2, 1e-14);
}

// A wind with the satellite's own velocity over ground leaves no drag; its axes are ECEF's.
TEST(DragForceTest, WindIsTheAirsVelocityOverGround) {
  const SimTime t = kStart + 3h;
  const OrbitState state = on_orbit(t);
  const Surroundings s = around(t);
  const Vec3 over_ground_ECEF =
      s.R_EI * (state.v_ECI - cross({0, 0, kEarthRate_radps}, state.r_ECI));
  const DragForce calm(uniform(1e-12)),
      carried(uniform(1e-12), {.wind_ECEF = [&](SimTime, Vec3) { return over_ground_ECEF; }});
  EXPECT_LT(norm(carried.acceleration_ECI(state, s)),
            1e-14 * norm(calm.acceleration_ECI(state, s)));
  const DragForce head_wind(uniform(1e-12),
                            {.wind_ECEF = [&](SimTime, Vec3) { return -1 * over_ground_ECEF; }});
  EXPECT_NEAR(norm(head_wind.acceleration_ECI(state, s)) / norm(calm.acceleration_ECI(state, s)), 4,
              1e-13);
}

/// Asks for the density as the integrator does; gives its largest relative error.
double worst_error(const DragForce& drag, const AtmosphereModel& exact) {
  static const std::vector<OrbitState> stages = flight_of_three_hours();
  double worst = 0;
  ForceMemory memory = drag.begin(stages[0], around(kStart));
  for (std::size_t k = 0; k < stages.size(); ++k) {
    const OrbitState& state = stages[k];
    const Surroundings s = around(state.t);
    if (k > 0 && k % 3 == 0) memory = drag.next(memory, state, s);
    const double truth = exact.density_kgpm3(state.t, s.R_EI * state.r_ECI);
    worst = std::max(worst, std::abs(drag.density_kgpm3(state, s, memory) / truth - 1));
  }
  return worst;
}

// A cubic in time is interpolated exactly, and a height that falls off with the scale height found
// at the first knot costs nothing wherever the orbit is. Rounding of ln(rho) = -30 and of the
// divided differences; observed 6e-14.
TEST(DragForceTest, InterpolationIsExactForCubicsAndAnExponential) {
  const auto height = [](const Vec3& r) {
    return norm(r) - 6378136.3 * (1 - r.z * r.z / dot(r, r) / 298.257);
  };
  const auto air = std::make_shared<TestAtmosphere>([&](SimTime t, const Vec3& r) {
    const double T = to_seconds(t - kStart) / 1e4;
    return 1e-13 * std::exp(0.1 + T - 2 * T * T + T * T * T - (height(r) - 550e3) / 60e3);
  });
  EXPECT_LT(worst_error(DragForce(air), *air), 1e-12);
}

// NRLMSISE-00 along an orbit: harmonics m of the orbital rate n with amplitudes A_m in ln(rho).
// (9/16)/24 (m n T)^4 A_m of the middle interval and spacing T = 40 s is 6e-8 for m = 1 and A_1 =
// 0.7, 2e-6 for A_4 = 0.1, twice that in the first interval; 16 times as much at 80 s. The guide's
// bound for 60 s is 1e-4. Observed 3.9e-6 and 6.1e-5.
TEST(DragForceTest, InterpolatedDensityFollowsNrlmsise00) {
  const auto air = std::make_shared<Nrlmsise00Atmosphere>(
      Nrlmsise00AtmosphereOptions{.weather = SpaceWeather::constant({.ap_daily = 4})});
  const double at_40_s = worst_error(DragForce(air), *air);
  const double at_80_s = worst_error(DragForce(air, {.knot_spacing = 80s}), *air);
  RecordProperty("error_40_s_1e6", std::to_string(at_40_s * 1e6));
  RecordProperty("error_80_s_1e6", std::to_string(at_80_s * 1e6));
  EXPECT_LT(at_40_s, 1e-5);
  EXPECT_LT(at_80_s, 16e-5);
}

TEST(DragForceTest, AsksTheAtmosphereLessThanTwiceAMinute) {
  const auto air = uniform(1e-12), counted = uniform(1e-12);
  const DragForce drag(counted);
  (void)worst_error(drag, *air);
  EXPECT_LE(counted->calls, 180 * 1.5 + 6) << "every 40 s; four knots and a scale height to begin";
  const DragForce exact(counted, {.interpolate_density = false});
  counted->calls = 0;
  (void)worst_error(exact, *air);
  EXPECT_EQ(counted->calls, 3 * 1080) << "at each stage";
}

// The density doubles at an instant off every grid. Steps end there; before it no knot, and after
// it every knot has seen the jump.
TEST(DragForceTest, KnotsDoNotReachAcrossAJump) {
  for (const Duration when : {Duration(597s + 3ns), Duration(601s), Duration(2s), Duration(1ns)}) {
    const SimTime jump = kStart + when;
    const auto air = std::make_shared<TestAtmosphere>(
        [jump](SimTime t, const Vec3&) { return t < jump ? 1e-13 : 2e-13; }, jump);
    const DragForce drag(air);
    ForceMemory memory = drag.begin(on_orbit(kStart), around(kStart));
    for (SimTime t = kStart; t < kStart + 20min;) {
      const SimTime grid = t + 10s - (t - kStart) % 10s;
      const SimTime end = t < jump ? std::min(grid, jump) : grid;
      if (t != kStart) memory = drag.next(memory, on_orbit(t), around(t));
      for (const SimTime now : {t, t + (end - t) / 2, end - 1ns}) {
        const double expected = now < jump ? 1e-13 : 2e-13;
        // A constant; heights cancel to the rounding of 550 km over a scale height that is inf.
        EXPECT_NEAR(drag.density_kgpm3(on_orbit(now), around(now), memory) / expected, 1, 1e-12)
            << to_string(now - kStart) << ", jump at " << to_string(when);
      }
      t = end;
    }
  }
}

TEST(DragForceTest, RefusesWhatCannotBe) {
  EXPECT_THAT([] { DragForce(nullptr); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("no atmosphere")));
  EXPECT_THAT([] { DragForce(uniform(1), {.area_m2 = -1}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("area_m2 = -1")));
  EXPECT_THAT([] { DragForce(uniform(1), {.drag_coefficient = INFINITY}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("drag_coefficient = inf")));
  EXPECT_THAT([] { DragForce(uniform(1), {.knot_spacing = 0s}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("knot_spacing = 0")));
}

TEST(DragForceTest, WhereTheAtmosphereEndsTheErrorNamesTheHeight) {
  const DragForce drag(std::make_shared<Nrlmsise00Atmosphere>());
  OrbitState high = on_orbit(kStart);
  high.r_ECI *= 1.1;
  EXPECT_THAT([&] { (void)drag.begin(high, around(kStart)); },
              ThrowsMessage<std::domain_error>(HasSubstr("altitude")));
}

}  // namespace
}  // namespace orrery
