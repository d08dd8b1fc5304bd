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
using testing::Throws;
using testing::ThrowsMessage;

const SimTime kStart(days(16510));
const QuasiNonsingularElements kElements{6928137, 0.0003, 0.00095, 1.7033, 5.5, 0.2};

OrbitState initial_state(const QuasiNonsingularElements& elements = kElements) {
  const InertialState s = to_inertial(elements);
  return {kStart, s.r_ECI, s.v_ECI, 11};
}

SpacecraftOrbitOptions earth_options(int degree = 8) {
  static const auto environment = std::make_shared<const EarthEnvironment>();
  return {.forces = {make_earth_gravity(degree)}, .environment = environment};
}

bool same_bits(const OrbitState& a, const OrbitState& b) {
  return a.t == b.t && a.r_ECI == b.r_ECI && a.v_ECI == b.v_ECI;
}

TEST(SpacecraftOrbitTest, StartsWhereItWasPut) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  const OrbitState s = orbit.at(kStart);
  EXPECT_LT(norm(s.r_ECI - initial_state().r_ECI), 2e-8);
  EXPECT_LT(norm(s.v_ECI - initial_state().v_ECI), 2e-11);
  EXPECT_EQ(s.mass_kg, 11);
  EXPECT_EQ(orbit.steps(), 0u);
}

TEST(SpacecraftOrbitTest, LookingNeverChangesTheTruth) {
  SpacecraftOrbit seldom(initial_state(), earth_options()), often(initial_state(), earth_options());
  const Vec3 dv{0.01, -0.02, 0.03};
  for (int s = 0; s <= 333; s += 3) (void)often.at(kStart + s * 1s + 77ns);
  seldom.apply_impulse(kStart + 333s + 5ms, dv);
  often.apply_impulse(kStart + 333s + 5ms, dv);
  for (int s = 334; s < 2000; ++s) (void)often.at(kStart + s * 1s);
  for (const Duration d :
       {Duration(2000s), Duration(2001s), Duration(2004s + 1ns), Duration(3000s)}) {
    EXPECT_TRUE(same_bits(seldom.at(kStart + d), often.at(kStart + d))) << to_string(d);
  }
  EXPECT_GT(often.interpolations(), seldom.interpolations());
}

TEST(SpacecraftOrbitTest, LooksBetweenGridPointsCostNoSteps) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  for (int s = 0; s <= 100; ++s) (void)orbit.at(kStart + s * 1s);
  EXPECT_EQ(orbit.steps(), 10u);
  EXPECT_EQ(orbit.interpolations(), 90u);
}

TEST(SpacecraftOrbitTest, NothingIsPropagatedUnlessSomebodyLooks) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  EXPECT_EQ(orbit.steps(), 0u);
  (void)orbit.at(kStart + 1h);
  EXPECT_EQ(orbit.steps(), 360u);
}

// Without forces the elements move exactly, so what remains against Kepler's closed form is the
// interpolation: h^6/46080 |d6r/dt6| = 2.5e-10 m, and rounding of 7e6 m some ten times over.
TEST(SpacecraftOrbitTest, LooksBetweenGridPointsLieOnTheOrbit) {
  SpacecraftOrbitOptions options = earth_options();
  options.forces.clear();
  SpacecraftOrbit orbit(initial_state(), options);
  const double n = std::sqrt(kMuEarth_m3ps2 / kElements.a_m) / kElements.a_m;
  for (int s = 0; s <= 600; ++s) {
    QuasiNonsingularElements x = kElements;
    x.u_rad += n * s;
    const OrbitState look = orbit.at(kStart + s * 1s);
    EXPECT_LT(norm(look.r_ECI - to_inertial(x).r_ECI), 2e-8) << s;
    EXPECT_LT(norm(look.v_ECI - to_inertial(x).v_ECI), 2e-9) << s;
  }
}

TEST(SpacecraftOrbitTest, ImpulseChangesTheVelocityByExactlyThat) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  SpacecraftOrbit free(initial_state(), earth_options());
  const SimTime t = kStart + 123s + 456ms;
  const Vec3 dv{0.1, -0.2, 0.3};
  orbit.apply_impulse(t, dv);
  // The free orbit is interpolated at t, the burnt one integrated to it: they differ by what RK4
  // errs in a step, 7e-8 m and, over its 10 s, 2e-8 m/s.
  EXPECT_LT(norm(orbit.at(t).r_ECI - free.at(t).r_ECI), 7e-8);
  EXPECT_LT(norm(orbit.at(t).v_ECI - free.at(t).v_ECI - dv), 2e-8);
  orbit.apply_impulse(t, -dv);
  EXPECT_LT(norm(orbit.at(t).v_ECI - free.at(t).v_ECI), 2e-8);
  // Undone at once, it leaves that: 2e-8 m/s drift by up to 3 dv t along track.
  EXPECT_LT(norm(orbit.at(kStart + 1h).r_ECI - free.at(kStart + 1h).r_ECI), 3 * 2e-8 * 3600);
}

// A force that is switched on for [begin, end) and announces it.
class Pulse final : public ForceModel {
 public:
  Pulse(SimTime begin, SimTime end, bool announces)
      : begin_(begin), end_(end), announces_(announces) {}
  std::string_view name() const override { return "pulse"; }
  Vec3 acceleration_ECI(const OrbitState& s, const Surroundings&) const override {
    return s.t >= begin_ && s.t < end_ ? Vec3{1e-3, 0, 0} : Vec3{};
  }
  std::optional<SimTime> next_discontinuity(SimTime t) const override {
    if (!announces_) return {};
    if (t < begin_) return begin_;
    if (t < end_) return end_;
    return {};
  }

 private:
  SimTime begin_, end_;
  bool announces_;
};

TEST(SpacecraftOrbitTest, StepsEndAtAnnouncedDiscontinuities) {
  const SimTime begin = kStart + 13s, end = kStart + 14s;
  SpacecraftOrbitOptions options = earth_options();
  options.forces.push_back(std::make_shared<Pulse>(begin, end, true));
  SpacecraftOrbit orbit(initial_state(), options);
  (void)orbit.at(kStart + 30s);
  EXPECT_EQ(orbit.steps(), 5u) << "0, 10, 13, 14, 20, 30";
}

// 1e-3 m/s^2 for a second along x. Steps that saw the force's value after a switch instead of
// before it would be wrong by a sixth of 10 s or 1 s of it. Tolerance: rounding of positions, 2e-9
// m, seen through the derivative of a look inside the 1 s interval; observed 3e-9 m/s.
TEST(SpacecraftOrbitTest, SwitchedForceDeliversExactlyItsImpulse) {
  SpacecraftOrbitOptions coasting = earth_options(), pushed = earth_options();
  coasting.forces.clear();
  pushed.forces = {std::make_shared<Pulse>(kStart + 13s, kStart + 14s, true)};
  SpacecraftOrbit free(initial_state(), coasting), orbit(initial_state(), pushed);
  const auto gain = [&](Duration at) {
    return orbit.at(kStart + at).v_ECI - free.at(kStart + at).v_ECI;
  };
  EXPECT_LT(norm(gain(12s)), 1e-8) << "before, between grid points";
  EXPECT_LT(norm(gain(13s)), 1e-8);
  EXPECT_LT(norm(gain(13s + 500ms) - Vec3{0.5e-3, 0, 0}), 1e-8) << "half way";
  EXPECT_LT(norm(gain(14s) - Vec3{1e-3, 0, 0}), 1e-8);
  EXPECT_LT(norm(gain(16s) - Vec3{1e-3, 0, 0}), 1e-8) << "after, between grid points";
}

TEST(SpacecraftOrbitTest, ForcesAreAddedBeforeTheStartOnly) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  EXPECT_THROW(orbit.add_force(nullptr), std::invalid_argument);
  orbit.add_force(std::make_shared<Pulse>(kStart, kStart + 1h, false));
  SpacecraftOrbit without(initial_state(), earth_options());
  const Vec3 d = orbit.at(kStart + 100s).r_ECI - without.at(kStart + 100s).r_ECI;
  EXPECT_NEAR(d.x, 5, 0.1) << "a t^2/2";
  EXPECT_THROW(orbit.add_force(std::make_shared<Pulse>(kStart, kStart, false)), std::logic_error);
}

TEST(SpacecraftOrbitTest, ThePastIsForgotten) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  (void)orbit.at(kStart + 95s);
  EXPECT_NO_THROW((void)orbit.at(kStart + 92s)) << "after the last grid point";
  EXPECT_THROW((void)orbit.at(kStart + 85s), std::logic_error);
  EXPECT_THROW((void)orbit.at(kStart - 1ns), std::logic_error);
  EXPECT_THROW(orbit.apply_impulse(kStart + 85s, {}), std::logic_error);
}

// Looks at 1 s, kept; then burns, on and off the grid, and long spans without a look.
TEST(SpacecraftOrbitTest, RecentPastIsWhatALookGaveAtThatTime) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  std::vector<OrbitState> looks;
  for (int s = 0; s < 900; ++s) {
    if (s == 640) orbit.apply_impulse(kStart + 640s, {0.1, 0, 0});
    if (s == 705) orbit.apply_impulse(kStart + 705s, {0, 0.1, 0});
    looks.push_back(orbit.at(kStart + s * 1s));
  }
  for (int s = 290; s < 900; ++s) {
    const OrbitState past = orbit.recent(kStart + s * 1s);
    if (s <= 700 || s >= 705) {
      EXPECT_TRUE(same_bits(past, looks[s])) << s;
    } else {
      // Interpolated towards 710 s at the time, towards the burn's 705 s now: what a step errs.
      EXPECT_LT(norm(past.r_ECI - looks[s].r_ECI), 7e-8) << s;
      EXPECT_LT(norm(past.v_ECI - looks[s].v_ECI), 2e-8) << s;
    }
  }
  EXPECT_TRUE(same_bits(orbit.recent(kStart + 950s), orbit.at(kStart + 950s))) << "not past at all";
}

TEST(SpacecraftOrbitTest, RecentPastEndsTenMinutesBack) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  EXPECT_THROW((void)orbit.recent(kStart - 1ns), std::logic_error);
  (void)orbit.at(kStart + 1h);
  EXPECT_NO_THROW((void)orbit.recent(kStart + 50min));
  EXPECT_THAT([&] { (void)orbit.recent(kStart + 50min - 1ns); },
              ThrowsMessage<std::logic_error>(HasSubstr("accepted: from 2025-03-20T00:50:00")));
}

TEST(SpacecraftOrbitTest, WrongOptionsAreRefusedAtOnce) {
  const auto with = [](auto change) {
    SpacecraftOrbitOptions options = earth_options();
    OrbitState state = initial_state();
    change(options, state);
    return [=] { SpacecraftOrbit(state, options); };
  };
  using Options = SpacecraftOrbitOptions;
  EXPECT_THAT(with([](Options& o, OrbitState&) { o.step = 0s; }), Throws<std::invalid_argument>());
  EXPECT_THAT(with([](Options& o, OrbitState&) { o.environment = nullptr; }),
              Throws<std::invalid_argument>());
  EXPECT_THAT(with([](Options& o, OrbitState&) { o.forces.push_back(nullptr); }),
              Throws<std::invalid_argument>());
  EXPECT_THAT(with([](Options&, OrbitState& s) { s.mass_kg = 0; }),
              Throws<std::invalid_argument>());
  EXPECT_THAT(with([](Options&, OrbitState& s) { s.v_ECI *= 0.95; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("orbit below the ground")));
  EXPECT_THAT(
      with([](Options&, OrbitState& s) { s.r_ECI.x = std::numeric_limits<double>::quiet_NaN(); }),
      Throws<std::invalid_argument>());
}

TEST(SpacecraftOrbitTest, GoingBelowTheGroundStopsWithTimeAndState) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  orbit.apply_impulse(kStart + 60s, -300.0 * unit(initial_state().v_ECI));  // perigee 530 km lower
  try {
    (void)orbit.at(kStart + 2h);
    FAIL() << "flew through the Earth";
  } catch (const PropagationError& error) {
    EXPECT_THAT(error.what(), HasSubstr("below the ground"));
    EXPECT_THAT(error.what(), HasSubstr("GPST"));
    EXPECT_GT(error.state().t, kStart + 60s);
    EXPECT_LT(error.state().t, kStart + 1h);
    EXPECT_NEAR(norm(error.state().r_ECI), kRadiusEarth_m, 20e3);
  }
}

TEST(SpacecraftOrbitTest, ImpulseOutOfTheEllipseIsRefused) {
  SpacecraftOrbit orbit(initial_state(), earth_options());
  EXPECT_THROW(orbit.apply_impulse(kStart, {std::numeric_limits<double>::infinity(), 0, 0}),
               std::domain_error);
  EXPECT_THROW(orbit.apply_impulse(kStart, 4000.0 * unit(initial_state().v_ECI)), PropagationError);
}

}  // namespace
}  // namespace orrery
