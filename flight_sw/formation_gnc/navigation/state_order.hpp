/// The order of the filter's states: the one place where it is written down.
///
/// The spacecraft that runs the filter is `self`, its companion is `other`. Orbit and clock of the
/// companion are carried as differences, other less self: what both share then needs no
/// cancellation, and the accuracy of the relative state stands on the diagonal. Ambiguities are one
/// per receiver and channel, in cycles: GRAPHIC sees lambda N / 2, the single difference sees
/// lambda (N_other - N_self), and integers are a linear condition on the latter.
///
/// Clocks come first and ambiguities last, which a factor P = U D U^T with unit upper triangular U
/// rewards: a state in front can be forgotten without touching those behind it (clocks are white
/// from epoch to epoch), and constants at the end keep their block through a time update.
#pragma once

namespace formation_gnc {

constexpr int kChannels = 12;

// Of each state: unit, frame.
constexpr int kClockSelf = 0;                // c (receiver time - GPS time) [m]
constexpr int kClockDifference = 1;          // [m]
constexpr int kPositionSelf = 2;             // ECI, 3 [m]
constexpr int kVelocitySelf = 5;             // ECI, 3 [m/s]
constexpr int kAccelerationSelf = 8;         // empirical, RTN of self, 3 [m/s^2]
constexpr int kPositionDifference = 11;      // ECI, 3 [m]
constexpr int kVelocityDifference = 14;      // ECI, 3 [m/s]
constexpr int kAccelerationDifference = 17;  // empirical, RTN, 3 [m/s^2]
constexpr int kAmbiguitySelf = 20;           // one per channel [cycles of L1]
constexpr int kAmbiguityOther = kAmbiguitySelf + kChannels;
constexpr int kStates = kAmbiguityOther + kChannels;

constexpr int kClocks = 2;        // states in front of the orbits
constexpr int kOrbitStates = 18;  // of both orbits, 9 each: r, v, empirical acceleration
constexpr int kBiases = 2 * kChannels;

static_assert(kClocks + kOrbitStates == kAmbiguitySelf, "orbits follow the clocks");
static_assert(kAmbiguitySelf + kBiases == kStates, "ambiguities come last");

}  // namespace formation_gnc
