/// States of an OEM between its lines, for a spacecraft that starts from one.
#pragma once

#include <orrery/models/ccsds/oem.hpp>
#include <orrery/models/orbit/force_model.hpp>

namespace orrery {

struct OemInterpolation {
  InterpolationMethod method = InterpolationMethod::kHermite;
  int degree = 7;  // of the polynomial, 1 to 100
};

/// A state in the frame and about the centre of oem.segments[segment].metadata.
struct OemPoint {
  std::size_t segment = 0;
  Vec3 r_km, v_kmps;
};

/// Method   INTERPOLATION and INTERPOLATION_DEGREE of the segment, or `otherwise` where it lacks
/// one
///          of them. Linear and Lagrange: position and velocity each through the degree + 1 lines
///          nearest. Hermite: position through the positions and velocities of the (degree + 1)/2
///          lines nearest, rounded up, at least two; its derivative is the velocity. At a line,
///          that line's own state.
/// Segments one whose USEABLE_START_TIME to USEABLE_STOP_TIME, and lines, reach around `t`; where
/// two
///          touch, the later one.
/// @throws std::out_of_range      `t` in no segment; the message gives what is covered.
/// @throws std::invalid_argument  segments that overlap at `t`; neither the segment nor `otherwise`
/// tells
///                                how to interpolate; fewer lines than the degree needs; a degree
///                                outside 1 to 100; errors of to_epoch.
OemPoint interpolate(const Oem& oem, SimTime t,
                     const std::optional<OemInterpolation>& otherwise = {});

/// The same as a state in ECI; the mass, of which an OEM knows nothing, is 0.
/// @throws as interpolate; std::invalid_argument  also a centre or frame other than the Earth and
///         EME2000.
OrbitState state_at(const Oem& oem, SimTime t,
                    const std::optional<OemInterpolation>& otherwise = {});

}  // namespace orrery
