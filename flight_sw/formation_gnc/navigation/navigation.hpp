/// Absolute and relative navigation of two spacecraft by GPS, run alike on each of them.
///
/// Filter      One extended Kalman filter for both (formation_filter.hpp): GRAPHIC of each receiver
///             and single-difference carrier phase between them, integer ambiguities by LAMBDA.
///             D'Amico et al. (2006), Giralo & D'Amico (2019), Low & D'Amico (2025).
/// Order       Measurements are keyed by (spacecraft, epoch). They may come late, twice, in any
///             order or never: a ring of snapshots is rewound to the epoch concerned, and what had
///             come since is processed again. The result is that of arrival in order, to the bit.
/// Manoeuvres  Commanded ones enter at their instant with their covariance, and replays repeat
/// them.
/// Memory      Fixed, inside the object (about 400 kB); no allocation, no exceptions.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/navigation_test.cpp
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/broadcast_ephemeris.hpp"
#include "formation_gnc/navigation/epoch_ring.hpp"
#include "formation_gnc/navigation/formation_filter.hpp"
#include "formation_gnc/navigation/gnss_epoch.hpp"

namespace formation_gnc {

/// What happens to a measurement of the companion that is older than the filter.
enum class LatePolicy : std::uint8_t {
  kRewindReplay,  ///< used, as if it had come in time
  kFusionDelay,   ///< the filter stays `fusion_delay_s` behind; later ones are dropped
  kDiscard        ///< dropped, unless it belongs to the epoch the filter stands at
};

struct NavigationOptions {
  FilterOptions filter = {};
  LatePolicy late = LatePolicy::kRewindReplay;
  double fusion_delay_s = 10.0;
  int replay_depth = EpochRing::kCapacity;  ///< epochs that can be rewound, 2 to kCapacity
};

/// Both spacecraft at an instant.
struct FormationEstimate {
  bool valid = false;  ///< both orbits are known
  bool fixed = false;  ///< at least four satellites' ambiguities are held at integers
  int fixed_ambiguities = 0;
  std::int64_t t_ns = 0;
  std::int64_t last_own_ns = 0, last_remote_ns = 0;  ///< epochs of the latest measurements used
  Vec3 r_self_ECI, v_self_ECI;                       ///< [m], [m/s]; centres of mass
  Vec3 r_other_ECI, v_other_ECI;
  Vec3 r_relative_ECI, v_relative_ECI;  ///< other less self
  Vec3 r_relative_RTN, v_relative_RTN;  ///< of self; derivative taken in RTN
  /// Of other less self along track, what lasts for an orbit: differential drag [m/s^2].
  double drag_difference_mps2 = 0.0, sigma_drag_difference_mps2 = 0.0;
  /// Of (r_self, v_self, r_relative, v_relative), ECI.
  flight_support::Matrix<12, 12> covariance;
  flight_support::Matrix<6, 6> relative_covariance_RTN;  ///< of (r, v) relative, in RTN
};

/// The same, seen from the companion: self and other change places.
FormationEstimate seen_from_other(const FormationEstimate& estimate);

struct NavigationStatistics {
  std::uint32_t own_epochs = 0, remote_epochs = 0;
  std::uint32_t duplicates = 0;  ///< same key again: ignored
  std::uint32_t late = 0;        ///< older than the filter when they came, and used
  std::uint32_t dropped = 0;     ///< too old, not plausible, or by policy
  std::uint32_t replays = 0, replayed_epochs = 0;
  std::uint32_t restarts = 0;  ///< from the receiver's fix, the first start included
};

/// Of the epoch processed last.
struct UpdateReports {
  std::int64_t t_ns = 0;
  UpdateReport graphic_self, graphic_other, sdcp;
  IntegerReport integers;
};

class Navigation {
 public:
  explicit Navigation(const NavigationOptions& options = {});

  void ephemeris(const BroadcastEphemeris& ephemeris);
  /// An epoch of this spacecraft's receiver, q_BI its attitude then.
  void own_epoch(const GnssEpoch& epoch, const Quaternion& q_BI);
  /// An epoch of the companion's; in any order, as often as it comes.
  void remote_epoch(const GnssEpoch& epoch, const Quaternion& q_BI);
  /// In advance or afterwards, in any order. The same (who, t_ns) again replaces the former, with
  /// dv_ECI = 0 and sigma_mps = 0 it is taken back.
  void maneuver(const Maneuver& maneuver);
  void maneuver(Who who, std::int64_t t_ns, const Vec3& dv_ECI, double sigma_mps);

  /// At any instant, the filter's state moved there over the manoeuvres known; not valid before the
  /// start, more than 3 h past the last measurement, or before the oldest snapshot.
  FormationEstimate at(std::int64_t t_ns) const;
  /// The same without covariances (they are zero), at a third of the cost.
  FormationEstimate state_at(std::int64_t t_ns) const;

  const FormationFilter& filter() const { return filter_; }
  const NavigationStatistics& statistics() const { return statistics_; }
  const UpdateReports& reports() const { return reports_; }
  /// Forgets everything but ephemerides and manoeuvres; starts anew from the next fix.
  void reset();

 private:
  const FormationFilter* filter_for(std::int64_t t_ns) const;
  FormationEstimate told_by(const FormationFilter& filter) const;
  void insert(Who who, const GnssEpoch& epoch, const Quaternion& q_BI);
  bool accept_time(Who who, std::int64_t t_ns);
  struct Place;
  Place place_of(bool own, std::int64_t t_ns) const;
  bool may_take(bool own, const Place& place) const;
  int make_entry(std::int64_t t_ns);
  /// Works off entries from `first` on, the filter standing behind the one before.
  void process_from(int first);
  /// Puts the filter behind entry k, companion's measurements included; k = -1: not started.
  void rewind_behind(int k);
  void own_phase(EpochEntry* entry);
  void remote_phase(const EpochEntry& entry);
  void restart_if_lost(const EpochEntry& entry);
  std::int64_t newest_own_ns() const;

  NavigationOptions options_;
  EphemerisStore ephemerides_;
  FormationFilter filter_;
  SatelliteTable satellites_;
  EarthAttitude earth_;
  EpochRing ring_;
  int processed_ = 0;  // entries of the ring that the filter has passed
  ManeuverList maneuvers_;
  NavigationStatistics statistics_;
  UpdateReports reports_;
  std::int64_t last_own_ns_ = 0, last_remote_ns_ = 0;
  int strange_times_ = 0;  // own epochs in a row that lie before what is known
};

}  // namespace formation_gnc
