// All of Table 1: what the default step, the interpolated density and the split at the penumbra are
// worth, and drag against its closed form. relative_motion_test.cpp has another integrator.
#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/orbit/earth_forces.hpp>
#include <orrery/models/orbit/relative_elements.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace orrery {
namespace {

const SimTime kStart = gps_midnight(2025, 3, 20);
constexpr Duration kTenOrbits = 10 * 5739s;

QuasiNonsingularElements chief_at(double height_m) {
  return {6378137 + height_m, 0.0003, 0.00095, 1.70326682, 5.5, 0.2};
}

// On a safe ellipse, so that the distance is `separation_m` to twice that.
QuasiNonsingularElements beside(const QuasiNonsingularElements& chief, double separation_m) {
  return deputy_elements(
      chief, 1 / chief.a_m * RelativeElements{.dey = separation_m, .diy = separation_m});
}

/// The force itself, without edges and memory.
class Plain final : public ForceModel {
 public:
  explicit Plain(std::shared_ptr<const ForceModel> force) : force_(std::move(force)) {}
  std::string_view name() const override { return "plain"; }
  Vec3 acceleration_ECI(const OrbitState& state, const Surroundings& around) const override {
    return force_->acceleration_ECI(state, around);
  }

 private:
  std::shared_ptr<const ForceModel> force_;
};

/// Positions every 10 min.
std::vector<Vec3> flight(const QuasiNonsingularElements& elements, OrbitDynamics::Forces forces,
                         Duration step, Duration span) {
  static const auto environment = std::make_shared<const EarthEnvironment>();
  const InertialState s = to_inertial(elements);
  SpacecraftOrbit orbit({kStart, s.r_ECI, s.v_ECI, 11},
                        {.step = step, .forces = std::move(forces), .environment = environment});
  std::vector<Vec3> positions;
  for (Duration d = 0s; d <= span; d += 10min) positions.push_back(orbit.at(kStart + d).r_ECI);
  return positions;
}

double greatest_difference_m(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double greatest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) greatest = std::max(greatest, norm(a[k] - b[k]));
  return greatest;
}

std::vector<Vec3> relative(const std::vector<Vec3>& deputy, const std::vector<Vec3>& chief) {
  std::vector<Vec3> r;
  for (std::size_t k = 0; k < chief.size(); ++k) r.push_back(deputy[k] - chief[k]);
  return r;
}

/// What interpolating the density costs after 20 h: of one orbit, and of one relative to another
/// 1 km away, which decides how well formations are compared.
struct InterpolationError {
  double absolute_m, relative_m;
};

InterpolationError interpolation_error(double height_m) {
  const EarthForces interpolated, exact({.interpolate_density = false});
  const QuasiNonsingularElements chief = chief_at(height_m), deputy = beside(chief, 1000);
  const auto fly = [](const QuasiNonsingularElements& x, const EarthForces& forces) {
    return flight(x, forces.on({}), 10s, 20h);
  };
  const auto chief_i = fly(chief, interpolated), deputy_i = fly(deputy, interpolated);
  const auto chief_e = fly(chief, exact), deputy_e = fly(deputy, exact);
  return {greatest_difference_m(chief_i, chief_e),
          greatest_difference_m(relative(deputy_i, chief_i), relative(deputy_e, chief_e))};
}

struct DensityInterpolationValidation : testing::Test {
  void note(const InterpolationError& error) {
    RecordProperty("absolute_um", std::to_string(error.absolute_m * 1e6));
    RecordProperty("relative_um", std::to_string(error.relative_m * 1e6));
  }
};

// 1 mm and 0.1 mm after 20 h, as issued. An error of the density of mean b shifts an orbit by 3/2 b
// a t^2, a = 1.7e-7 m/s^2 at 550 km: 1 mm is a mean of 8e-7. Errors of 4e-6 alternate (they are
// fourth derivatives of an almost periodic function) and leave far less. Observed at 550 km 23 um
// and 1.4 um, at 400 km 0.31 mm and 1.5 um.
TEST_F(DensityInterpolationValidation, CostsAFractionOfAMillimetreAfterTwentyHours) {
  for (const double height_m : {550e3, 400e3}) {
    const InterpolationError error = interpolation_error(height_m);
    note(error);
    EXPECT_LT(error.absolute_m, 1e-3) << height_m;
    EXPECT_LT(error.relative_m, 1e-4) << height_m;
  }
}

// At exactly 450 km the published model stops correcting atomic nitrogen, and density steps by
// 1.6e-5. The interpolant passes over that step within 40 s or so of its place, differently for
// each spacecraft: 1e-5 of 6e-7 m/s^2 for some 20 s, 1e-10 m/s four times an orbit, which adds up
// to sqrt(50) 3 1e-10 20 h / sqrt(3) = 0.1 mm; the exact model under 10 s steps errs by 0.06 mm for
// the same reason. Five times that is accepted. Observed 0.12 mm and 22 um at 1 km, 0.2 mm
// relative at 300 m.
TEST_F(DensityInterpolationValidation, CostsMoreWhereTheModelItselfSteps) {
  const InterpolationError error = interpolation_error(450e3);
  note(error);
  EXPECT_LT(error.absolute_m, 1e-3);
  EXPECT_LT(error.relative_m, 5e-4);
}

// Ten orbits at the default step against steps four times shorter with the model's own density,
// whose error is 4^4 times smaller; 0.05 mm as issued. RK4 itself leaves 2 to 9 um in 20 h of
// gravity alone. Observed: 1 um at 40 m, 4 um at 300 m, 14 um at 1 km. Unsplit, each kink would cost
// the fraction of its step that lies beyond it, at random: 0.28 mm at 1 km.
TEST(RelativeMotionValidation, DefaultStepIsWithinFiftyMicrometresAfterTenOrbits) {
  const EarthForces forces, exact({.interpolate_density = false});
  OrbitDynamics::Forces unsplit = forces.on({});
  for (auto& force : unsplit) {
    if (force->name() == "radiation_pressure") force = std::make_shared<const Plain>(force);
  }
  const QuasiNonsingularElements chief = chief_at(550e3);
  const auto chief_10 = flight(chief, forces.on({}), 10s, kTenOrbits);
  const auto chief_fine = flight(chief, exact.on({}), 2500ms, kTenOrbits);
  const auto chief_unsplit = flight(chief, unsplit, 10s, kTenOrbits);
  for (const double separation_m : {40.0, 300.0, 1000.0}) {
    const QuasiNonsingularElements deputy = beside(chief, separation_m);
    const auto fine = relative(flight(deputy, exact.on({}), 2500ms, kTenOrbits), chief_fine);
    const double error = greatest_difference_m(
        relative(flight(deputy, forces.on({}), 10s, kTenOrbits), chief_10), fine);
    RecordProperty("error_um_at_" + std::to_string(static_cast<int>(separation_m)) + "_m",
                   std::to_string(error * 1e6));
    EXPECT_LT(error, 5e-5) << separation_m;
    if (separation_m == 1000) {
      const double without = greatest_difference_m(
          relative(flight(deputy, unsplit, 10s, kTenOrbits), chief_unsplit), fine);
      RecordProperty("unsplit_um", std::to_string(without * 1e6));
      EXPECT_GT(without, 1e-4) << "what the split is for";
    }
  }
}

class StillEarth final : public SpaceEnvironment {
 public:
  Surroundings surroundings(SimTime) const override { return {}; }
};

class UniformAir final : public AtmosphereModel {
 public:
  static constexpr double kDensity_kgpm3 = 1e-12;
  double density_kgpm3(SimTime, const Vec3&) const override { return kDensity_kgpm3; }
};

// Air of uniform density at rest, a circular orbit: da/dt = -rho Cd A/m sqrt(mu a), hence
// sqrt(a) = sqrt(a0) - rho Cd A/m sqrt(mu) t / 2. It falls by 54 m in a day. The orbit does not
// stay a circle: e grows to 2 a'/(n a) = 1.7e-7 and drag along it by 3 e at times: 54 m * 5e-7 =
// 3e-5 m; rounding of a, 8640 times 5e-10 m at random, is 5e-8 m. Observed 3e-7 m.
TEST(DragValidation, CircularOrbitDecaysByTheClosedForm) {
  const double a0_m = 6928137, per_mass_m2pkg = 2.2 * 0.06 / 11;
  const InertialState s = to_inertial(QuasiNonsingularElements{a0_m, 0, 0, 1.7, 5.5, 0.2});
  SpacecraftOrbit orbit({kStart, s.r_ECI, s.v_ECI, 11},
                        {.forces = {std::make_shared<DragForce>(std::make_shared<UniformAir>())},
                         .environment = std::make_shared<StillEarth>()});
  double worst_m = 0;
  for (Duration d = 1h; d <= 24h; d += 1h) {
    const double root = std::sqrt(a0_m) - 0.5 * UniformAir::kDensity_kgpm3 * per_mass_m2pkg *
                                              std::sqrt(kMuEarth_m3ps2) * to_seconds(d);
    worst_m = std::max(worst_m, std::abs(orbit.elements_at(kStart + d).a_m - root * root));
  }
  RecordProperty("error_um", std::to_string(worst_m * 1e6));
  EXPECT_LT(worst_m, 3e-5);
}

// Sunlight of a Sun that is held in place has a potential, P0 Cr A/m au^2 / d; with the Kepler
// energy it is conserved where there is no shadow. Rounding of a, 5e-10 m or 4e-9 J/kg a step, 4320
// times at random: 3e-7 J/kg, against 0.08 J/kg of work to and fro. Observed 1.1e-7 J/kg.
TEST(RadiationValidation, WorkIsTheDifferenceOfItsPotential) {
  class SunHeld final : public SpaceEnvironment {
   public:
    Surroundings surroundings(SimTime) const override {
      return {{}, {}, {1.1e11, 0.9e11, 0.3e11}, {3.8e8, 0, 0}};
    }
  };
  const auto held = std::make_shared<SunHeld>();
  const Vec3 sun = held->surroundings(kStart).r_sun_ECI;
  const InertialState s = to_inertial(chief_at(550e3));
  SpacecraftOrbit orbit({kStart, s.r_ECI, s.v_ECI, 11},
                        {.forces = {std::make_shared<RadiationForce>(
                             RadiationForceOptions{.shadow = ShadowModel::kNone})},
                         .environment = held});
  const double strength = 4.56e-6 * 1.8 * 0.06 / 11 * 1.495978707e11 * 1.495978707e11;
  const auto energy = [&](const OrbitState& state) {
    return 0.5 * dot(state.v_ECI, state.v_ECI) - kMuEarth_m3ps2 / norm(state.r_ECI) +
           strength / norm(state.r_ECI - sun);
  };
  const double at_start = energy(orbit.at(kStart));
  double worst = 0, most_work = 0;
  for (Duration d = 0s; d < 12h; d += 100s) {
    const OrbitState state = orbit.at(kStart + d);
    worst = std::max(worst, std::abs(energy(state) - at_start));
    most_work = std::max(
        most_work, std::abs(strength / norm(state.r_ECI - sun) - strength / norm(s.r_ECI - sun)));
  }
  RecordProperty("error_uJ_per_kg", std::to_string(worst * 1e6));
  EXPECT_GT(most_work, 0.05);
  EXPECT_LT(worst, 1e-6);
}

}  // namespace
}  // namespace orrery
