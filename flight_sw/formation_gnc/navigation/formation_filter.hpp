/// The filter: absolute and relative orbit of two spacecraft, their clocks and carrier-phase
/// ambiguities, in the order of state_order.hpp.
///
/// Orbits      Gravity to degree and order 20 (orbit_pair.hpp) and empirical accelerations in RTN,
///             first-order Gauss-Markov. The empirical acceleration of the companion is that of
///             self plus a much smaller difference, since both leave out almost the same field:
///             that is process noise with a correlation near 1.
/// Clocks      White from epoch to epoch, started from the codes: nothing is assumed of steering.
/// GRAPHIC     (code + phase) / 2 of one receiver: no ionosphere, half an ambiguity.
/// SDCP        Phase of other less phase of self; no satellite clock, no ionosphere to speak of.
///             Both are predicted at the true instant of reception, tag less clock error.
/// Screening   A scalar beyond `gate` sigmas is left out; the same satellite twice in a row, and
/// its
///             ambiguities start anew. Most phases at once, while lock times show no slip, mean a
///             burn that was not told: the relative orbit is opened, ambiguities stay. If that does
///             not help either, all ambiguities start anew, and in the end the filter says that it
///             is lost.
/// Integers    resolve() in integer_resolution.hpp.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/formation_filter_test.cpp
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/carrier_arcs.hpp"
#include "formation_gnc/navigation/integer_resolution.hpp"
#include "formation_gnc/navigation/maneuver.hpp"
#include "formation_gnc/navigation/orbit_pair.hpp"
#include "formation_gnc/navigation/signal_geometry.hpp"
#include "formation_gnc/navigation/ud_factor.hpp"

namespace formation_gnc {

/// Degree, step and time constant outside their ranges are brought to the nearest end.
struct FilterOptions {
  OrbitPairOptions orbit = {};

  /// Empirical acceleration of self, 1 sigma [m/s^2]. What a field of 20x20 omits at 550 km is 7e-6
  /// along R and 5e-6 along T and N (root mean square over a day), three times that above mountains
  /// and trenches.
  double empirical_sigma_mps2 = 1e-5;
  double empirical_tau_s = 200.0;  ///< at least four steps
  /// Of the difference. Drag, along track: 7 % (drag coefficients known to 5 % each, masses to 1 %)
  /// of 1.2e-7 m/s^2 (550 km, 150 sfu, 0.012 m^2/kg), over an orbit. Radiation pressure, each axis:
  /// 2 % (masses and reflectivities to 1 % each) of 4.5e-8 m/s^2, along R over the sixth of an
  /// orbit in which the Sun turns by a radian, along N over an orbit. Gravity that the field omits:
  /// kOmittedGradient, times the separation and this factor.
  double drag_difference_mps2 = 8.6e-9;
  double drag_tau_s = 5700.0;
  double radiation_difference_mps2 = 9e-10;
  double radiation_tau_s = 900.0;
  double omitted_gradient_factor = 1.0;

  Vec3 lever_arm_B = flight_support::vec3(0.05, 0.0, 0.10);  ///< antenna from centre of mass [m]
  /// Errors of GPS orbits along the line of sight change as the geometry turns: a random walk of
  /// the ambiguities of both receivers together [m/sqrt(s)].
  double broadcast_walk_mps05 = 0.008;
  double code_floor_m = 0.003;  ///< added to the thermal noise of GRAPHIC: codes come in cm
  double phase_floor_m = 1e-4;  ///< added to the thermal noise of each phase: multipath, attitude
  /// Vertical delay above the orbit [m of L1]: 0.8 for 5 TECU, and half as much again since errors
  /// of it last. What two spacecraft do not share is noise of their single difference: 10 mm at the
  /// horizon and 1 mm at 30 deg for 3 km.
  double ionosphere_m = 1.2;
  double gate = 5.0;  ///< sigmas

  double start_sigma_r_m = 5.0;  ///< at least, of a start from the receiver's fix
  double start_sigma_v_mps = 0.1;
  double start_sigma_relative_r_m = 5.0;
  double start_sigma_relative_v_mps = 0.1;
  double clock_sigma_m = 100.0;
  double ambiguity_sigma_cycles = 60.0;  ///< must cover code noise and twice the ionosphere

  IntegerOptions integers = {};
};

/// What one update did, for monitoring. Over scalars that were used, chi2 is the sum of nu^2 / S.
/// It has as many degrees of freedom, but for GRAPHIC one less for the clock, which was started
/// from the same codes, and one less for each ambiguity that was.
struct UpdateReport {
  int used = 0, rejected = 0;
  int degrees = 0;
  double chi2 = 0.0;
};

/// Of the latest epochs' single differences, older ones fading.
struct FadingChi2 {
  double chi2 = 0.0, mean = 0.0, variance = 0.0;
};

class FormationFilter {
 public:
  explicit FormationFilter(const FilterOptions& options = {});

  /// Starts self's orbit [ECI, centre of mass]; sigmas per axis.
  void start(std::int64_t t_ns, const Vec3& r_ECI, const Vec3& v_ECI, double sigma_r_m,
             double sigma_v_mps);
  /// Starts the companion's orbit relative to self's.
  void start_other(const Vec3& r_ECI, const Vec3& v_ECI, double sigma_r_m, double sigma_v_mps);

  // The four functions of the paper's Table 5; callable alone, in this order at an epoch.

  /// To `t_ns` (not before the filter's time), over the manoeuvres in between.
  void time_update(std::int64_t t_ns, const ManeuverList& maneuvers);
  /// Where time_update() would move both, at a third of its cost.
  OrbitPair orbits_at(std::int64_t t_ns, const ManeuverList& maneuvers) const;
  /// GRAPHIC of one receiver at the filter's time. `satellites` holds those of this epoch.
  UpdateReport graphic_update(Who who, const GnssEpoch& epoch, const Quaternion& q_BI,
                              const SatelliteTable& satellites);
  /// Differences of the phases of both, after graphic_update() of both.
  UpdateReport sdcp_update(const GnssEpoch& self, const Quaternion& q_self, const GnssEpoch& other,
                           const Quaternion& q_other, const SatelliteTable& satellites);
  /// Tries to fix ambiguities to integers, and holds them.
  IntegerReport resolve_ambiguities();

  bool started() const { return started_; }
  bool other_started() const { return other_started_; }
  /// True: neither new ambiguities nor an open relative orbit made measurements fit; start anew.
  bool lost() const { return lost_; }
  /// Times that the relative orbit was opened since most phases contradicted it: unknown burns.
  std::uint32_t openings() const { return openings_; }
  std::int64_t t_ns() const { return t_ns_; }
  const OrbitPair& orbits() const { return orbits_; }
  const UdFactor& covariance() const { return ud_; }
  double clock_m(Who who) const { return clock_m_[static_cast<int>(who)]; }
  const CarrierArcs& arcs(Who who) const { return arcs_[static_cast<int>(who)]; }
  const IntegerSet& integers() const { return integers_; }
  const FilterOptions& options() const { return options_; }
  /// From the next attempt on, such as by ground command.
  void set_integer_options(const IntegerOptions& integers) { options_.integers = integers; }

 private:
  struct Sight;
  struct Difference;
  struct Differences;

  EmpiricalAcceleration empirical_self() const;
  EmpiricalAcceleration empirical_difference() const;
  void forget_clocks();
  enum class What { kAll, kOrbitsOnly };
  void move_to(std::int64_t t_ns, const ManeuverList& maneuvers, What what);
  void step_to(std::int64_t t_ns, What what);
  void step(std::int64_t t_ns, What what);
  void push(const OrbitTransition& self, const OrbitTransition& difference);
  void apply_maneuver(const Maneuver& maneuver, double share);
  void walk_ambiguities();

  AntennaState antenna(int who, const Quaternion& q_BI) const;
  void look(int who, const GnssEpoch& epoch, const Quaternion& q_BI,
            const SatelliteTable& satellites, Sight* sight) const;
  void start_clock(int who, Sight* sight);
  void start_ambiguity(int who, int channel, const Observation& observation);
  void track_arcs(int who, const Sight& sight);
  bool take(const SparseRow& h, double r, double innovation, UpdateReport* report);
  Difference difference(const Observation& o_self, const Predicted& p_self,
                        const Observation& o_other, const Predicted& p_other);
  double unshared_ionosphere_m(const Vec3& line_of_sight) const;
  void sort_by_doubt(Differences* all) const;
  UpdateReport take_all(Differences* all);
  void settle();

  void judge(const UpdateReport& report, const Differences& all);
  void restart_ambiguities(const Difference& difference);
  void judge_graphic(int who, const UpdateReport& report);
  void release(int prn);
  void reset_ambiguities();
  void open_relative_orbit(double sigma_r_m, double sigma_v_mps);

  int find_candidates(IntegerCandidate* candidates) const;
  int find_reference(const IntegerCandidate* candidates, int count) const;
  int hold(const IntegerChoice& choice, const IntegerCandidate& reference, int fewest);
  void constrain(const IntegerCandidate& difference, const IntegerCandidate& reference,
                 double innovation);

  FilterOptions options_;
  bool started_ = false, other_started_ = false, lost_ = false;
  std::uint8_t bad_epochs_ = 0, good_epochs_ = 0, resets_in_a_row_ = 0;
  std::uint8_t bad_graphic_[2] = {};
  std::uint32_t openings_ = 0;
  FadingChi2 fading_;
  std::int64_t t_ns_ = 0;
  std::uint8_t walk_prn_ = 0;  // whose ambiguities walked last
  OrbitPair orbits_;
  EarthAttitude earth_;  // kept, since its base holds for many steps
  double clock_m_[2] = {};
  CarrierArcs arcs_[2];
  IntegerSet integers_;
  IntegerTrials trials_;
  UdFactor ud_;
  double correction_[kStates] = {};  // of the nominal state, pending within an update
};

}  // namespace formation_gnc
