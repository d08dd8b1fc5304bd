// Formations under all of Table 1 against another integrator in other variables.
#include <orrery/models/orbit/earth_forces.hpp>
#include <orrery/models/orbit/relative_elements.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>
#include <orrery/models/reference/reference_propagator.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "../../accuracy.hpp"

namespace orrery {
namespace {

const SimTime kStart = gps_midnight(2025, 3, 20);
constexpr Duration kTenOrbits = 10 * 5739s;

OrbitState initial(const QuasiNonsingularElements& elements) {
  const InertialState s = to_inertial(elements);
  return {kStart, s.r_ECI, s.v_ECI, 11};
}

/// Instants at which one of them meets an edge of its penumbra, by the reference's own root
/// finding. A Runge-Kutta step of any order errs where one lies inside it, and its error control
/// sees only part: 0.6 mm of the relative position at 1 km after ten orbits.
std::vector<SimTime> penumbra_edges(const std::vector<ReferenceSpacecraft>& spacecraft,
                                    const std::shared_ptr<const SpaceEnvironment>& environment,
                                    SimTime end) {
  std::vector<EventFunction> edges;
  for (std::size_t k = 0; k < spacecraft.size(); ++k) {
    for (const Illumination region : {Illumination::kSunlight, Illumination::kUmbra}) {
      edges.push_back({"edge", [k, region](const auto& states, const Surroundings& around) {
                         return margin_rad(shadow_geometry(states[k].r_ECI, around.r_sun_ECI),
                                           region);
                       }});
    }
  }
  ReferencePropagator scout(spacecraft, environment);
  std::vector<SimTime> found;
  for (const OrbitEvent& event : scout.advance_to(end, edges)) found.push_back(event.t);
  return found;
}

// The truth as worlds have it, 10 s steps, density interpolated, steps split at the penumbra;
// against adaptive steps of order 8 up to 30 s long in Cartesian coordinates, the model's own
// density, stopped at each edge. Positions every 10 min over ten orbits. 0.05 mm of the relative
// position, as issued; 1 mm of each orbit, a day's promise in gravity alone.
TEST(RelativeMotionValidation, TruthIsWithinFiftyMicrometresOfTheReferenceAfterTenOrbits) {
  const QuasiNonsingularElements chief{6928137, 0.0003, 0.00095, 1.70326682, 5.5, 0.2};
  const std::vector<double> separations_m = {40, 300, 1000};
  std::vector<OrbitState> starts = {initial(chief)};
  for (const double a : separations_m) {
    starts.push_back(
        initial(deputy_elements(chief, 1 / chief.a_m * RelativeElements{.dey = a, .diy = a})));
  }
  const auto environment = std::make_shared<const EarthEnvironment>();
  const EarthForces forces;
  std::vector<ReferenceSpacecraft> spacecraft;
  std::vector<SpacecraftOrbit> orbits;
  for (const OrbitState& start : starts) {
    spacecraft.push_back({start, forces.on({})});
    orbits.emplace_back(
        start, SpacecraftOrbitOptions{.forces = forces.on({}), .environment = environment});
  }
  ReferencePropagator reference(spacecraft, environment);
  const std::vector<SimTime> edges = penumbra_edges(spacecraft, environment, kStart + kTenOrbits);
  EXPECT_EQ(edges.size(), starts.size() * 40) << "two in and two out of each shadow";
  auto edge = edges.begin();

  double absolute_m = 0;
  std::vector<double> relative_m(starts.size(), 0);
  for (Duration d = 0s; d <= kTenOrbits; d += 10min) {
    for (; edge != edges.end() && *edge < kStart + d; ++edge) reference.advance_to(*edge);
    reference.advance_to(kStart + d);
    std::vector<Vec3> error;
    for (std::size_t k = 0; k < starts.size(); ++k) {
      error.push_back(orbits[k].at(kStart + d).r_ECI - reference.state(k).r_ECI);
      absolute_m = std::max(absolute_m, norm(error[k]));
      relative_m[k] = std::max(relative_m[k], norm(error[k] - error[0]));
    }
  }
  expect_accuracy({"truth under all forces, ten orbits", "ARKODE, order 8(7)", 1000, "um"},
                  absolute_m * 1e6);
  for (std::size_t k = 1; k < starts.size(); ++k) {
    const std::string distance = std::to_string(static_cast<int>(separations_m[k - 1])) + " m";
    expect_accuracy({"truth under all forces, ten orbits, relative position at " + distance,
                     "ARKODE, order 8(7)", 50, "um"},
                    relative_m[k] * 1e6);
  }
}

}  // namespace
}  // namespace orrery
