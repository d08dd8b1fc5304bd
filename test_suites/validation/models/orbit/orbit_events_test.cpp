// Events of the reference propagator where a closed form says when, and along the truth.
#include <orrery/models/orbit/drag_force.hpp>
#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/radiation_force.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>
#include <orrery/models/orbit/third_body_force.hpp>
#include <orrery/models/reference/reference_propagator.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../accuracy.hpp"

namespace orrery {
namespace {

const SimTime kStart(days(16510));
constexpr double kPi = 3.141592653589793, kRadius_m = 7000e3, kSun_m = 1.5e11,
                 kSunRadius_m = 6.957e8;

/// The Sun stands still on the x axis, the Earth turns about z.
class StillSun final : public SpaceEnvironment {
 public:
  Surroundings surroundings(SimTime t) const override {
    const double rate_radps = 7.292115146706979e-5;
    return {rotation_about_z(rate_radps * to_seconds(t - kStart)),
            {0, 0, rate_radps},
            {kSun_m, 0, 0},
            {}};
  }
};

double mean_motion(double r_m) {
  return std::sqrt(kMuEarth_m3ps2 / r_m) / r_m;
}

/// On a circle in the x-z plane, at angle `u_rad` from +x towards +z.
OrbitState polar_circle(double r_m, double u_rad, double mass_kg = 11) {
  const double v = mean_motion(r_m) * r_m, c = std::cos(u_rad), s = std::sin(u_rad);
  return {kStart, {r_m * c, 0, r_m * s}, {-v * s, 0, v * c}, mass_kg};
}

struct Expected {
  double t_s;
  std::string name;
  bool begins;
};

/// Largest distance from what is expected [s]; names and senses must agree.
double worst_s(const std::vector<OrbitEvent>& events, const std::vector<Expected>& expected) {
  EXPECT_EQ(events.size(), expected.size());
  double worst = 0;
  for (std::size_t i = 0; i < std::min(events.size(), expected.size()); ++i) {
    EXPECT_EQ(events[i].name, expected[i].name) << i;
    EXPECT_EQ(events[i].begins, expected[i].begins) << i;
    worst = std::max(worst, std::abs(to_seconds(events[i].t - kStart) - expected[i].t_s));
  }
  return worst;
}

struct OrbitEventsValidation : testing::Test {
  const std::shared_ptr<const SpaceEnvironment> still = std::make_shared<const StillSun>();
  const std::shared_ptr<const SpaceEnvironment> earth = std::make_shared<const EarthEnvironment>();
};

// Tangents of both spheres: the penumbra's make the angle alpha with the axis, sin alpha = (Rs +
// Re)/d, the umbra's beta, sin beta = (Rs - Re)/d. On a circle, at phi from the Earth's shadow side
// of the axis, they are met where sin(phi - alpha) = Re/r and sin(phi + beta) = Re/r. Observed
// error 2 ns: the integrator's 1e-13 of a revolution is 1 ns. Accepted: what the header says.
TEST_F(OrbitEventsValidation, ShadowEdgesOfACircleAreWhereTheTangentsAre) {
  const double n = mean_motion(kRadius_m), psi = std::asin(kRadiusEarth_m / kRadius_m);
  const double penumbra = psi + std::asin((kSunRadius_m + kRadiusEarth_m) / kSun_m);
  const double full = psi - std::asin((kSunRadius_m - kRadiusEarth_m) / kSun_m);
  std::vector<Expected> expected;
  for (const double turn : {kPi, 3 * kPi}) {
    expected.push_back({(turn - penumbra) / n, "sunlight of 0", false});
    expected.push_back({(turn - full) / n, "umbra of 0", true});
    expected.push_back({(turn + full) / n, "umbra of 0", false});
    expected.push_back({(turn + penumbra) / n, "sunlight of 0", true});
  }
  ReferencePropagator orbit({{polar_circle(kRadius_m, 0)}}, still);
  const std::vector<EventFunction> functions = {full_sunlight(), umbra()};
  const double forward = worst_s(orbit.advance_to(kStart + 3h, functions), expected);
  // Back the same events are met in reverse; what begins in time still does.
  std::vector<OrbitEvent> back = orbit.advance_to(kStart, functions);
  std::reverse(back.begin(), back.end());
  expect_accuracy({"entry and exit of penumbra and umbra", "closed form on a circle", 1, "us"},
                  1e6 * std::max(forward, worst_s(back, expected)));
}

// A station at the pole, height 0: at b = 6356752.3142 m, up along z. Above the elevation e within
// the central angle acos(b cos(e)/r) - e.
TEST_F(OrbitEventsValidation, PassesOverThePoleLastAsLongAsTheTriangleSays) {
  const double n = mean_motion(kRadius_m), mask = 10 * kPi / 180;
  const double half = std::acos(6356752.314245 * std::cos(mask) / kRadius_m) - mask;
  std::vector<Expected> expected;
  for (const double over : {kPi / 2, 5 * kPi / 2}) {
    expected.push_back({(over - half) / n, "pass of 0 over Pole", true});
    expected.push_back({(over + half) / n, "pass of 0 over Pole", false});
  }
  ReferencePropagator orbit({{polar_circle(kRadius_m, 0)}}, still);
  const auto events =
      orbit.advance_to(kStart + 3h, {pass(0, "Pole", {.latitude_rad = kPi / 2}, mask)});
  expect_accuracy({"begin and end of a pass", "closed form on a circle", 1, "us"},
                  1e6 * worst_s(events, expected));
}

// The line between two circles in a plane grazes the sphere at the sum of the angles to its tangent
// points.
TEST_F(OrbitEventsValidation, SightBetweenTwoCirclesEndsAtTheTangent) {
  const double high_m = 8000e3, grazing_m = kRadiusEarth_m + 100e3;
  const double far = std::acos(grazing_m / kRadius_m) + std::acos(grazing_m / high_m);
  const double rate = mean_motion(kRadius_m) - mean_motion(high_m);
  ReferencePropagator orbits({{polar_circle(kRadius_m, 0)}, {polar_circle(high_m, 0)}}, still);
  const auto events = orbits.advance_to(kStart + 12h, {line_of_sight(0, 1, 100e3)});
  const std::string name = "sight from 0 to 1";
  expect_accuracy(
      {"end and begin of sight between two spacecraft", "closed form on circles", 1, "us"},
      1e6 * worst_s(events, {{far / rate, name, false},
                             {(2 * kPi - far) / rate, name, true},
                             {(2 * kPi + far) / rate, name, false}}));
}

// With all forces: the truth of SpacecraftOrbit crosses the edges where the reference does. Its 10
// s steps err by 0.1 mm along track, 15 ns; asked here 10 us before and after.
TEST_F(OrbitEventsValidation, TruthCrossesTheShadowWhereTheReferenceDoes) {
  const InertialState s =
      to_inertial(QuasiNonsingularElements{6928137, 0.0003, 0.00095, 1.7, 5.5, 0.2});
  const OrbitState initial{kStart, s.r_ECI, s.v_ECI, 11};
  const OrbitDynamics::Forces forces = {make_earth_gravity(20), make_sun_gravity(),
                                        make_moon_gravity(),
                                        std::make_shared<const RadiationForce>()};
  ReferencePropagator reference({{initial, forces}}, earth);
  const auto events = reference.advance_to(kStart + 6h, {full_sunlight(), umbra()});
  SpacecraftOrbit truth(initial, {.forces = forces, .environment = earth});
  const auto light_at = [&](SimTime t) {
    return illumination(shadow_geometry(truth.at(t).r_ECI, earth->surroundings(t).r_sun_ECI));
  };
  ASSERT_GE(events.size(), 12u);  // three or four revolutions
  for (const OrbitEvent& event : events) {
    const bool of_sunlight = event.name == "sunlight of 0";
    const Illumination region = of_sunlight ? Illumination::kSunlight : Illumination::kUmbra;
    const auto before = light_at(event.t - 10us), after = light_at(event.t + 10us);
    EXPECT_EQ(event.begins ? after : before, region) << event.name << " " << to_string(event.t);
    EXPECT_EQ(event.begins ? before : after, Illumination::kPenumbra) << event.name;
  }
}

/// 1 mm/s^2 along x for 100 s.
class Push final : public ForceModel {
 public:
  std::string_view name() const override { return "push"; }
  Vec3 acceleration_ECI(const OrbitState& s, const Surroundings&) const override {
    return s.t >= kOn && s.t < kOff ? Vec3{1e-3, 0, 0} : Vec3{};
  }
  std::optional<SimTime> next_discontinuity(SimTime t) const override {
    if (t < kOn) return kOn;
    if (t < kOff) return kOff;
    return {};
  }
  static constexpr SimTime kOn = SimTime(days(16510) + 1234567ms);
  static constexpr SimTime kOff = SimTime(days(16510) + 1334567ms);
};

// The truth's integrator splits its steps at the same instants: 10 s of RK4 under 1e-3 m/s^2 err
// far below a millimetre in two hours. A step across the edge would cost centimetres. Observed 3
// um.
TEST_F(OrbitEventsValidation, ForcesThatAreSwitchedAreMetExactly) {
  const OrbitDynamics::Forces forces = {std::make_shared<const Push>()};
  ReferencePropagator reference({{polar_circle(kRadius_m, 0.3)}}, earth),
      pushed({{polar_circle(kRadius_m, 0.3), forces}}, earth);
  SpacecraftOrbit truth(polar_circle(kRadius_m, 0.3), {.forces = forces, .environment = earth});
  reference.advance_to(kStart + 2h);
  pushed.advance_to(kStart + 2h);
  const Vec3 r_ECI = pushed.state().r_ECI;
  EXPECT_GT(norm(r_ECI - reference.state().r_ECI), 100);
  EXPECT_LT(norm(r_ECI - truth.at(kStart + 2h).r_ECI), 1e-4);
  pushed.advance_to(kStart);
  EXPECT_LT(norm(pushed.state().r_ECI - polar_circle(kRadius_m, 0.3).r_ECI), 1e-6);
}

// A burn and an impulse, with edges off any grid, against the truth's propagator: observed 2 um.
TEST_F(OrbitEventsValidation, BurnsAndImpulsesGiveTheTruthsOrbit) {
  const Thrust burn = Thrust::inertial({0.2, 0.1, 0}, 50);
  const SimTime on = kStart + 1001234567ns, off = on + 33333333ns * 1000;
  ReferencePropagator reference({{polar_circle(kRadius_m, 0.3)}}, earth);
  SpacecraftOrbit truth(polar_circle(kRadius_m, 0.3), {.environment = earth});
  reference.advance_to(on);
  reference.set_thrust(0, burn);
  truth.set_thrust(on, burn);
  reference.advance_to(off);
  reference.set_thrust(0, {});
  truth.set_thrust(off, {});
  reference.apply_impulse(0, {0, 0, 0.5});
  truth.apply_impulse(off, {0, 0, 0.5});
  reference.advance_to(kStart + 1h);
  EXPECT_LT(norm(reference.state().r_ECI - truth.at(kStart + 1h).r_ECI), 5e-5);
  EXPECT_DOUBLE_EQ(reference.state().mass_kg, truth.at(kStart + 1h).mass_kg);
  EXPECT_LT(reference.state().mass_kg, 11);
}

template <class Function>
std::string refusal(Function function) {
  try {
    function();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "accepted";
}

TEST_F(OrbitEventsValidation, BadInputIsNamed) {
  using testing::HasSubstr;
  const OrbitState good = polar_circle(kRadius_m, 0);
  OrbitState later = good, low = good;
  later.t += 1s;
  low.r_ECI = {1000, 0, 0};
  EXPECT_THAT(refusal([&] { ReferencePropagator({}, earth); }), HasSubstr("no spacecraft"));
  EXPECT_THAT(refusal([&] {
                ReferencePropagator({{good}, {later}}, earth);
              }),
              HasSubstr("another at"));
  EXPECT_THAT(refusal([&] { ReferencePropagator({{low}}, earth); }), HasSubstr("the ground"));
  EXPECT_THAT(refusal([&] {
                ReferencePropagator({{good, {nullptr}}}, earth);
              }),
              HasSubstr("a force is null"));
  EXPECT_THAT(refusal([&] { ReferencePropagator({{good}}, nullptr); }),
              HasSubstr("no environment"));
  EXPECT_THAT(refusal([&] { ReferencePropagator({{good}}, earth, {.tolerance = 0}); }),
              HasSubstr("tolerance = 0"));
  EXPECT_THAT(refusal([&] { ReferencePropagator({{good}}, earth, {.longest_step = 0s}); }),
              HasSubstr("longest_step"));
  EXPECT_THAT(refusal([&] { ReferencePropagator({{good}}, earth, {.fixed_step = -1s}); }),
              HasSubstr("fixed_step = -1 s"));
  EXPECT_THAT(refusal([&] { ReferencePropagator({{good}}, earth).state(1); }),
              HasSubstr("spacecraft 1; accepted: below 1"));
  EXPECT_THAT(refusal([&] { pass(0, "x", {}, 2); }), HasSubstr("mask_rad = 2"));
  EXPECT_THAT(refusal([&] { line_of_sight(0, 1, -1); }), HasSubstr("grazing_height_m = -1"));
  // What a callback throws comes through the C code.
  OrbitState falling = good;
  falling.v_ECI = {0, 0, 1000};
  EXPECT_THROW(ReferencePropagator({{falling}}, earth).advance_to(kStart + 1h), PropagationError);
  EXPECT_THAT(
      refusal([&] { ReferencePropagator({{good}}, earth).advance_to(kStart + 1h, {umbra(3)}); }),
      HasSubstr("spacecraft 3; accepted: below 1"));
}

}  // namespace
}  // namespace orrery
