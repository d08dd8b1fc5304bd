/// When something begins or ends along an orbit: shadow, sight, passes.
#pragma once

#include <orrery/models/frames/geodetic.hpp>
#include <orrery/models/orbit/force_model.hpp>

#include <functional>
#include <string>
#include <vector>

namespace orrery {

/// An event is where `value` crosses zero: continuous, of all spacecraft's states at one instant.
struct EventFunction {
  std::string name;
  std::function<double(const std::vector<OrbitState>&, const Surroundings&)> value;
};

struct OrbitEvent {
  SimTime t;
  std::string name;  // of its function
  bool begins;       // later in time the value is positive
};

// The ready ones. Numbers say which spacecraft of the propagator's list. Each begins and ends what
// its name says. @throws std::invalid_argument  a range that is not met, at once;
// std::out_of_range, when asked: no such spacecraft.

/// "sunlight of 0": no part of the Sun's disc is covered by the Earth, a sphere without an
/// atmosphere. Ends with the entry into the penumbra, begins with the exit.
EventFunction full_sunlight(std::size_t spacecraft = 0);
/// "umbra of 0": the Sun's disc is covered.
EventFunction umbra(std::size_t spacecraft = 0);
/// "sight from 0 to 1": the straight line between them passes the Earth's sphere, grown by
/// `grazing_height_m` (0 or more).
EventFunction line_of_sight(std::size_t from, std::size_t to, double grazing_height_m = 0);
/// "pass of 0 over NAME": the spacecraft stands above `mask_rad` (-pi/2 to pi/2) at the station's
/// geodetic horizon.
EventFunction pass(std::size_t spacecraft, std::string station, const Geodetic& place,
                   double mask_rad);

}  // namespace orrery
