/// The GPS satellites of a world: where they are, what their clocks show, what they broadcast.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/gnss/almanac.hpp>
#include <orrery/models/gnss/broadcast_ephemeris.hpp>
#include <orrery/models/gnss/broadcast_orbit.hpp>
#include <orrery/models/gnss/gps_constants.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace orrery {

struct GpsConstellationOptions {
  GpsAlmanac almanac = {};  // empty: the carried one of 2016
  /// True: the almanac is read as one of the epoch's own week, so that its geometry over the Earth
  /// is kept whatever the epoch. False: its week is the published one (modulo 1024, the nearest to
  /// the epoch), and the orbits are carried on from there.
  bool shift_almanac_to_epoch = true;
  /// Of a RINEX navigation file, in place of an almanac. Covers toe - 2 h to toe + 2 h of each.
  std::vector<BroadcastEphemeris> ephemerides = {};
  double sigma_orbit_m = 1;  // truth less broadcast, per axis of RTN, 0 to 1 km; Table 2
  bool interpolate = true;   // false: the user algorithm at every epoch
};

/// All satellites at one instant.
struct GpsSnapshot {
  SimTime t;
  std::uint32_t transmitting = 0;  // bit prn - 1
  std::array<SatelliteState, gps::kSatellites> satellites;

  bool has(int prn) const { return (transmitting >> (prn - 1) & 1u) != 0; }
  const SatelliteState& operator[](int prn) const {
    return satellites[static_cast<std::size_t>(prn - 1)];
  }
};

/// Truth and broadcast of up to 32 satellites; one object serves all spacecraft of a world.
///
/// Truth       The broadcast model's orbit and clock, moved by a vector that is constant in the
///             satellite's RTN and drawn once per satellite, N(0, sigma_orbit_m) per axis, from the
///             stream ("gps", "orbit perturbation", "G07"). All receivers see the same.
/// Almanac     A satellite's elements are rounded once to the steps of the LNAV message, rates of
///             node and clock to 2^-36, and the mean motion (through delta n) so that two hours are
///             whole steps of M0 within 1/256. So each issue says the same orbit: what an issue
///             still differs from the truth without perturbation is M0's rounding, below 1 cm in
///             the first two days and at most 4 cm ever, of which a receiver sees a quarter.
/// Issues      From an almanac: every even 2 h of the week a new one, toe at its end, IODC counting
///             up modulo 1024. From a file: its own; the truth passes from one to the next with a
///             quintic smooth step between their toes, so that phases stay continuous.
/// Orbits      Quintic Hermite between knots every 120 s on a fixed grid; the result depends on t
///             alone. Against the user algorithm: 1e-6 m. Guard: a midpoint of each interval is
///             checked, and an error above 0.1 mm is std::logic_error.
/// Threads     Not safe: the knots and the last snapshot are kept. Two objects give equal bits.
/// Checked by  test_suites/unit/models/gnss/constellation_test.cpp
class GpsConstellation {
 public:
  /// @param epoch    Of the world: almanacs are placed in its week.
  /// @param streams  Drawn from here, in the constructor only.
  /// @throws std::invalid_argument  options out of range; an almanac or file without satellites.
  GpsConstellation(const GpsConstellationOptions& options, SimTime epoch, RandomStreams& streams);

  /// The truth at `t`; evaluated once per instant, valid until the next call.
  const GpsSnapshot& at(SimTime t);
  /// The truth of one satellite by the user algorithm itself, or none if it has no orbit then.
  std::optional<SatelliteState> exact(int prn, SimTime t) const;

  /// What the satellite broadcasts at `t` (quantised as the message is); null if it transmits
  /// nothing. Valid until the call after next for that satellite.
  const BroadcastEphemeris* broadcast(int prn, SimTime t);

  /// TGD: the codes of L1 leave later by this than the clock says, those of L2 by (f1/f2)^2 of it.
  double group_delay_s(int prn) const { return group_delays_s_[static_cast<std::size_t>(prn - 1)]; }

  /// The satellite transmits nothing in [from, until).
  void add_outage(int prn, SimTime from, SimTime until);
  /// Its broadcast says `health` (6 bits, 0: good) in issues that begin in [from, until).
  void add_health(int prn, int health, SimTime from, SimTime until);

  /// The truth less the broadcast model of the satellite, RTN [m].
  const Vec3& perturbation_RTN(int prn) const { return vehicle(prn).perturbation_RTN; }
  /// PRNs that have an orbit, bit prn - 1.
  std::uint32_t satellites() const { return satellites_; }
  /// What an almanac of this constellation says, in the week of `t`.
  GpsAlmanac almanac(SimTime t) const;

 private:
  /// One that broadcast() made of an almanac.
  struct Issue {
    std::int64_t number = INT64_MIN;
    BroadcastEphemeris data;
  };
  struct Vehicle {
    bool from_almanac = false;
    int health = 0;
    BroadcastEphemeris base;                 // of an almanac: the truth, toe near the epoch
    std::vector<BroadcastEphemeris> issues;  // of a file, by toe
    Vec3 perturbation_RTN;
    std::array<Issue, 2> kept;  // even and odd ones: at a change receivers look at both
  };
  struct Window {
    int prn;
    int health;
    SimTime from, until;
  };
  /// r and clock as a polynomial of s = (t - knot) / 120 s, by power and channel.
  struct Polynomial {
    double c[6][4];
  };

  const Vehicle& vehicle(int prn) const;
  Vehicle& vehicle(int prn) { return vehicles_[static_cast<std::size_t>(prn - 1)]; }
  void add_from_almanac(const GpsAlmanac& almanac, SimTime epoch, bool shift);
  void add_from_file(const std::vector<BroadcastEphemeris>& ephemerides);
  std::optional<SatelliteState> unperturbed(const Vehicle& v, SimTime t) const;
  bool silent(int prn, SimTime t) const;
  void make_interval(std::int64_t index);
  void fill_knots(std::int64_t index, std::array<SatelliteState, gps::kSatellites>& knots,
                  std::uint32_t& valid) const;
  void guard(int prn, std::int64_t index) const;
  static SatelliteState evaluate(const Polynomial& p, double s);

  bool interpolate_;
  std::array<Vehicle, gps::kSatellites> vehicles_;
  std::uint32_t satellites_ = 0;
  std::array<double, gps::kSatellites> group_delays_s_{};  // of the file's first issue
  std::vector<Window> outages_, healths_;

  std::int64_t interval_ = INT64_MIN;
  std::uint32_t interval_valid_ = 0, right_valid_ = 0;
  std::array<Polynomial, gps::kSatellites> polynomials_;
  std::array<SatelliteState, gps::kSatellites> right_knots_;
  bool has_snapshot_ = false;
  GpsSnapshot snapshot_;
};

}  // namespace orrery
