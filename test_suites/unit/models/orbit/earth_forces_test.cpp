#include <orrery/models/orbit/earth_forces.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

const SimTime kStart(days(16510));
const QuasiNonsingularElements kElements{6928137, 0.0003, 0.00095, 1.7033, 5.5, 0.2};

OrbitState initial_state(const QuasiNonsingularElements& elements = kElements) {
  const InertialState s = to_inertial(elements);
  return {kStart, s.r_ECI, s.v_ECI, 11};
}

std::shared_ptr<const EarthEnvironment> environment() {
  static const auto earth = std::make_shared<const EarthEnvironment>();
  return earth;
}

SpacecraftOrbit orbit_under(EarthForcesOptions forces, Duration step = 10s) {
  return {initial_state(),
          {.step = step, .forces = EarthForces(forces).on({}), .environment = environment()}};
}

std::vector<std::string> names(const EarthForcesOptions& options) {
  std::vector<std::string> list;
  for (const auto& force : EarthForces(options).on({})) list.emplace_back(force->name());
  return list;
}

bool same_bits(const OrbitState& a, const OrbitState& b) {
  return a.t == b.t && a.r_ECI == b.r_ECI && a.v_ECI == b.v_ECI && a.mass_kg == b.mass_kg;
}

TEST(EarthForcesTest, EachIsSwitchedAlone) {
  EXPECT_THAT(names({}),
              ElementsAre("gravity", "sun_gravity", "moon_gravity", "drag", "radiation_pressure"));
  EXPECT_THAT(names({.gravity_degree = 0}),
              ElementsAre("sun_gravity", "moon_gravity", "drag", "radiation_pressure"));
  EXPECT_THAT(names({.drag = false}),
              ElementsAre("gravity", "sun_gravity", "moon_gravity", "radiation_pressure"));
  EXPECT_THAT(names({.radiation_pressure = false}),
              ElementsAre("gravity", "sun_gravity", "moon_gravity", "drag"));
  EXPECT_THAT(names({.sun_gravity = false}),
              ElementsAre("gravity", "moon_gravity", "drag", "radiation_pressure"));
  EXPECT_THAT(names({.moon_gravity = false}),
              ElementsAre("gravity", "sun_gravity", "drag", "radiation_pressure"));
}

TEST(EarthForcesTest, PropertiesReachTheirForces) {
  const EarthForcesOptions no_sun_moon{
      .gravity_degree = 0, .sun_gravity = false, .moon_gravity = false};
  const EarthForces forces(no_sun_moon);
  const OrbitState state = initial_state();
  const Surroundings around = environment()->surroundings(kStart);
  const auto pushes = [&](const SpacecraftProperties& properties) {
    const OrbitDynamics::Forces on = forces.on(properties);
    return std::array{norm(on[0]->acceleration_ECI(state, around)),
                      norm(on[1]->acceleration_ECI(state, around))};
  };
  const auto plain = pushes({});
  ASSERT_GT(plain[0], 0) << "drag";
  ASSERT_GT(plain[1], 0) << "in sunlight";
  EXPECT_NEAR(pushes({.drag_area_m2 = 0.12})[0] / plain[0], 2, 1e-14);
  EXPECT_NEAR(pushes({.drag_coefficient = 1.1})[0] / plain[0], 0.5, 1e-14);
  EXPECT_NEAR(pushes({.radiation_area_m2 = 0.12})[1] / plain[1], 2, 1e-14);
  EXPECT_NEAR(pushes({.radiation_coefficient = 0.9})[1] / plain[1], 0.5, 1e-14);
  EXPECT_EQ(pushes({.radiation_area_m2 = 0.12})[0], plain[0]);
  EXPECT_EQ(pushes({.drag_area_m2 = 0.12})[1], plain[1]);
}

// Through four edges of the shadow, knots of the density, an impulse and a burn.
TEST(EarthForcesTest, LookingNeverChangesTheTruth) {
  SpacecraftOrbit seldom = orbit_under({.gravity_degree = 8});
  SpacecraftOrbit often = orbit_under({.gravity_degree = 8});
  const auto look = [&](Duration from, Duration to) {
    for (Duration d = from; d < to; d += 3s) (void)often.at(kStart + d + 77ns);
  };
  look(0s, 1800s);
  for (SpacecraftOrbit* orbit : {&seldom, &often}) {
    orbit->apply_impulse(kStart + 1800s + 5ms, {0.01, -0.02, 0.03});
  }
  look(1801s, 3000s);
  for (SpacecraftOrbit* orbit : {&seldom, &often}) {
    orbit->set_thrust(kStart + 3000s, Thrust::inertial({0.01, 0, 0}, 45));
    orbit->set_thrust(kStart + 3001s, {});
  }
  look(3002s, 12000s);
  for (const Duration d : {Duration(12000s), Duration(12001s), Duration(15004s + 1ns)}) {
    EXPECT_TRUE(same_bits(seldom.at(kStart + d), often.at(kStart + d))) << to_string(d);
  }
}

TEST(EarthForcesTest, AnotherSpacecraftUnderTheSameForcesChangesNothing) {
  const EarthForces shared({.gravity_degree = 8});
  const auto orbit = [&](const OrbitState& initial) {
    return SpacecraftOrbit(initial, {.forces = shared.on({}), .environment = environment()});
  };
  SpacecraftOrbit alone = orbit_under({.gravity_degree = 8});
  SpacecraftOrbit one = orbit(initial_state());
  QuasiNonsingularElements other_elements = kElements;
  other_elements.u_rad += 1e-4;
  SpacecraftOrbit other = orbit(initial_state(other_elements));
  for (Duration d = 0s; d < 2h; d += 100s) {
    (void)other.at(kStart + d + 50s);
    (void)one.at(kStart + d);
  }
  EXPECT_TRUE(same_bits(one.at(kStart + 2h), alone.at(kStart + 2h)));
}

/// Instants at which the illumination changes along an orbit of steps of 1 s, by halves.
std::vector<SimTime> shadow_edges(EarthForcesOptions forces, Duration span) {
  SpacecraftOrbit orbit = orbit_under(forces, 1s);
  const auto region = [](const OrbitState& s) {
    return illumination(shadow_geometry(s.r_ECI, environment()->surroundings(s.t).r_sun_ECI));
  };
  std::vector<SimTime> edges;
  OrbitState last = orbit.at(kStart);
  for (Duration d = 1s; d <= span; d += 1s) {
    SimTime before = last.t, after = kStart + d;
    const Illumination was = region(last);
    const OrbitState next = orbit.at(after);
    if (region(next) != was) {
      while (after - before > 1ns) {
        const SimTime middle = before + (after - before) / 2;
        (region(orbit.recent(middle)) == was ? before : after) = middle;
      }
      edges.push_back(after);
    }
    last = next;
  }
  return edges;
}

// The edges are where an orbit without radiation pressure meets them, found by halves on steps of
// 1 s: radiation moves the spacecraft by 1 m in half an orbit and hence each edge by 1e-4 s, so
// it is left out by a sphere without area. Then both differ by what a step of 10 s errs, 1e-7 m or
// 1e-11 s, and by rounding of the position, 1e-9 m: one nanosecond.
TEST(EarthForcesTest, StepsEndAtTheEdgesOfThePenumbra) {
  const Duration span = 3h;
  const std::vector<SimTime> expected =
      shadow_edges({.gravity_degree = 8, .drag = false, .radiation_pressure = false}, span);
  ASSERT_EQ(expected.size(), 8u) << "in and out of two shadows, two edges each";

  const auto dark = std::make_shared<RadiationForce>(RadiationForceOptions{.area_m2 = 0});
  OrbitDynamics::Forces forces =
      EarthForces({.gravity_degree = 8, .drag = false, .radiation_pressure = false}).on({});
  forces.push_back(dark);
  const OrbitDynamics dynamics(environment(), forces);
  std::vector<SimTime> found;
  OrbitDynamics::State at = dynamics.start(initial_state());
  for (SimTime grid = kStart + 10s; grid <= kStart + span; grid += 10s) {
    OrbitDynamics::State next = dynamics.step(at, grid);
    while (const auto edge = dynamics.crossing(at, next)) {
      found.push_back(edge->t);
      at = dynamics.beyond(dynamics.step(at, edge->t), *edge);
      next = dynamics.step(at, grid);
    }
    at = next;
  }
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_NEAR(static_cast<double>((found[k] - expected[k]).count()), 0, 1) << k;
  }
}

// The same through SpacecraftOrbit, which makes one step to each edge and one from there on.
TEST(EarthForcesTest, EveryEdgeCostsTwoSteps) {
  SpacecraftOrbit orbit = orbit_under({.gravity_degree = 8, .drag = false});
  (void)orbit.at(kStart + 3h);
  EXPECT_EQ(orbit.steps(), 1080u + 2 * 8);
  SpacecraftOrbit never =
      orbit_under({.gravity_degree = 8, .drag = false, .shadow = ShadowModel::kNone});
  (void)never.at(kStart + 3h);
  EXPECT_EQ(never.steps(), 1080u);
}

// Three states: the force jumps at each edge. Were a stage to see the wrong side of one, a sixth of
// a step of up to 10 s of half the force, 4e-8 m/s, would be missing and 4 h later have become
// 3 * 4e-8 * 14400 = 2 mm along track. Steps of 10 s and of 2.5 s agree to 1/40 of that; observed
// 1.8e-5 m.
TEST(EarthForcesTest, AForceThatJumpsAtAnEdgeIsDeliveredExactly) {
  const EarthForcesOptions jumps{.gravity_degree = 2,
                                 .drag = false,
                                 .sun_gravity = false,
                                 .moon_gravity = false,
                                 .shadow = ShadowModel::kThreeStates};
  SpacecraftOrbit coarse = orbit_under(jumps), fine = orbit_under(jumps, 2500ms);
  const double error = norm(coarse.at(kStart + 4h).r_ECI - fine.at(kStart + 4h).r_ECI);
  RecordProperty("error_um", std::to_string(error * 1e6));
  EXPECT_LT(error, 5e-5);
  // And half of the light in the penumbra is not the conical fraction: 8 passages of 9 s.
  SpacecraftOrbit conical = orbit_under(
      {.gravity_degree = 2, .drag = false, .sun_gravity = false, .moon_gravity = false});
  EXPECT_GT(norm(coarse.at(kStart + 4h).r_ECI - conical.at(kStart + 4h).r_ECI), 1e-6);
}

// The mass in OrbitState is the present one: half of it burnt makes twice the push.
TEST(EarthForcesTest, LighterAfterABurnItIsPushedMore) {
  const EarthForcesOptions radiation_only{.gravity_degree = 0,
                                          .drag = false,
                                          .sun_gravity = false,
                                          .moon_gravity = false,
                                          .shadow = ShadowModel::kNone};
  const auto drift_m = [&](double burnt_kg) {
    SpacecraftOrbit pushed = orbit_under(radiation_only);
    SpacecraftOrbit free = orbit_under({.gravity_degree = 0,
                                        .drag = false,
                                        .radiation_pressure = false,
                                        .sun_gravity = false,
                                        .moon_gravity = false});
    for (SpacecraftOrbit* orbit : {&pushed, &free}) {
      // A leak without a force.
      orbit->set_thrust(kStart, {.mass_flow_kgps = burnt_kg});
      orbit->set_thrust(kStart + 1s, {});
    }
    return norm(pushed.at(kStart + 101s).r_ECI - free.at(kStart + 101s).r_ECI);
  };
  // 1/2 a t^2 = 2.3e-4 m, of rounding 2e-9 m; during the first second the masses are not yet 2:1.
  EXPECT_NEAR(drift_m(5.5) / drift_m(0), 2, 0.03);
}

TEST(EarthForcesTest, LeavingTheAtmosphereStopsWithTimeAndState) {
  QuasiNonsingularElements high = kElements;
  high.a_m = 7200e3, high.ex = 0.07, high.ey = 0;
  high.u_rad = 0;  // perigee at 318 km, apogee at 1326 km
  SpacecraftOrbit orbit(initial_state(high), {.forces = EarthForces({.gravity_degree = 2}).on({}),
                                              .environment = environment()});
  EXPECT_THAT([&] { (void)orbit.at(kStart + 1h); },
              ThrowsMessage<PropagationError>(testing::AllOf(
                  HasSubstr("altitude_km"), HasSubstr("last good state"), HasSubstr("GPST"))));
  SpacecraftOrbit without(initial_state(high),
                          {.forces = EarthForces({.gravity_degree = 2, .drag = false}).on({}),
                           .environment = environment()});
  EXPECT_NO_THROW((void)without.at(kStart + 1h));
}

TEST(EarthForcesTest, SpaceWeatherThatEndsStopsWithTimeAndState) {
  // The monthly table ends with 2025-11-21.
  OrbitState initial = initial_state();
  initial.t = gps_midnight(2025, 11, 21) + 23h;
  SpacecraftOrbit orbit(
      initial,
      {.forces =
           EarthForces({.gravity_degree = 2, .space_weather = SpaceWeather::monthly()}).on({}),
       .environment = environment()});
  EXPECT_NO_THROW((void)orbit.at(initial.t + 30min));
  EXPECT_THAT([&] { (void)orbit.at(initial.t + 2h); },
              ThrowsMessage<PropagationError>(HasSubstr("2014-02-10 to 2025-11-21")));
}

}  // namespace
}  // namespace orrery
