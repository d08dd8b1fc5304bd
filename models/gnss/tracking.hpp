/// The channels of a GNSS receiver: which satellites it follows, and what it measures of them.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/gnss/antenna.hpp>
#include <orrery/models/gnss/constellation.hpp>
#include <orrery/models/gnss/novatel_messages.hpp>
#include <orrery/models/gnss/signal_path.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace orrery {

/// Bounds of a uniform distribution [s].
struct DelayRange {
  double from_s = 0, to_s = 0;
};

struct GnssTrackingOptions {
  int channels = 12;                // 1 to 24 (to 16 with L2)
  double hysteresis_dB = 3;         // a newcomer must be stronger by this to take a channel
  DelayRange acquire{10, 30};       // from a free channel to phase lock
  DelayRange reacquire{1, 5};       // of a satellite lost less than a minute ago
  DelayRange cold_acquire{20, 90};  // after a cold start, until its first solution
  Duration parity_delay = 6s;       // from phase lock to the sign of the data bits
  /// True: satellites whose parity is not known are reported, with that bit clear, half of them
  /// off by half a cycle. False: they are left out until it is.
  bool report_unknown_parity = false;

  /// C/N0 of L1 below which a satellite is lost, L2 with it [dB-Hz], 0 to 60; it is searched for
  /// again from `relock_hysteresis_dB` above that on. 0: never lost, as Table 2 reaches down to 21.
  /// Receivers in use lose lock at 25 to 28.
  double lose_lock_below_dBHz = 0;
  double relock_hysteresis_dB = 2;  // 0 to 24

  bool l2 = false;                // a second observation per satellite, L2P(Y) semi-codeless
  double l2_loss_dB = 2;          // of C/N0 against L1
  bool noise = true;              // code, phase and Doppler by C/N0
  double doppler_per_phase = 30;  // sigma of range rate over that of phase [1/s]
  double vertical_tecu = 5;       // above the orbit; 0: no ionosphere
  bool wind_up = false;           // phase wind-up

  /// Code and phase multipath, Gauss-Markov processes per satellite; 0: none.
  double code_multipath_m = 0, phase_multipath_m = 0;
  double multipath_time_s = 200;

  /// Integer ambiguity of an arc: uniform in -limit to limit. 5: Table 2; up to 1e9.
  std::int64_t ambiguity_limit = 5;
  /// Cycle slips by themselves: of each satellite, below the C/N0 given. Sizes 1 to 10 cycles.
  double slips_per_s = 0;
  double slips_below_dBHz = 60;

  SightOptions sight = {};
  Cn0Law cn0_law = Cn0Law::kStretched;
};

/// What the receiver knows of the satellites when it is switched on.
enum class GnssStart {
  kTracking,  // it has been running: in lock with all it can see, ephemerides known
  kWarm,      // almanac, time and ephemerides known: acquires as after an interruption
  kCold,      // nothing known
};

/// A satellite as the receiver follows it, for the device and for tests.
struct GnssChannel {
  int prn = 0;
  int number = 0;  // 0 to channels - 1
  bool locked = false;
  bool reported = false;  // among the observations
  double cn0_dBHz = 0, sin_elevation = 0, cos_off_boresight = 0;
  SimTime acquired;             // or will be
  double ambiguity_cycles = 0;  // multiple of 1/2 while parity is unknown, of 1 else
  double l2_ambiguity_cycles = 0;
  double wind_up_cycles = 0;
  double code_noise_m = 0, phase_noise_m = 0;  // as drawn at the last epoch, multipath included
};

/// Tracking of one receiver from epoch to epoch.
///
/// Observables  P = rho + c (b - dt_s + TGD) + I, L = rho + c (b - dt_s + TGD) - I + lambda (N +
/// w),
///              D = -dL/dt / lambda by the receiver's time; each with noise by C/N0 (antenna.hpp).
/// Streams      By satellite: "G07 noise" (a block an observation of L1, normal_triples()), "G07 L2
///              noise", "G07 arc" (delays, integers, slips), "G07 multipath": what happens to one
///              satellite moves no noise of another.
/// Allocation   None after the constructor.
/// Checked by   test_suites/unit/models/gnss/tracking_test.cpp
class GnssTracker {
 public:
  using Streams = std::function<RandomStream&(std::string_view purpose)>;

  /// What faults do at an epoch.
  struct Faults {
    std::uint32_t blocked = 0;  // satellites not heard, bit prn - 1
    std::uint32_t slipped = 0;  // cycles[prn - 1] are added to the phase
    std::array<double, gps::kSatellites> cycles{};
  };

  /// @throws std::invalid_argument  an option out of range.
  GnssTracker(const GnssTrackingOptions& options, const AntennaPattern& pattern,
              const Streams& streams);

  /// As after power-on: channels free. For kTracking the next epoch() finds all in lock.
  void start(GnssStart how);
  /// The first solution after a cold start: from now on satellites are acquired as usual.
  void solution_found() { cold_ = false; }

  /// One epoch, `antenna.t` being its tag and also the snapshot's instant; epochs come in order.
  /// @param bias_s, drift_sps  Of the receiver's clock at the tag; |bias| <= 1 ms.
  void epoch(const GpsSnapshot& gps, const GpsConstellation& constellation,
             const AntennaPlace& antenna, const Vec3& r_sun_ECEF, double bias_s, double drift_sps,
             const Faults& faults);

  /// Of the last epoch, by channel; L2 follows its L1.
  std::span<const novatel::RangeObservation> observations() const { return observations_; }
  /// Occupied ones, by number.
  std::span<const GnssChannel> channels() const { return channels_; }
  /// Satellites not blocked and in sight at the last epoch, bit prn - 1.
  std::uint32_t in_sight() const { return in_sight_; }

 private:
  struct Candidate {
    int prn;
    double rank_dBHz;
    Sight sight;
    double cn0_dBHz;
  };
  struct Satellite {
    RandomStream *noise = nullptr, *l2_noise = nullptr, *arc = nullptr, *multipath = nullptr;
    bool lost_before = false;
    SimTime lost;
    SimTime lock_start, parity_known;
    bool half_cycle = false;  // the phase is off by half a cycle until parity is known
    bool half_cycle_added = false;
    double code_multipath_m = 0, phase_multipath_m = 0;
  };

  Satellite& satellite(int prn) { return satellites_[static_cast<std::size_t>(prn - 1)]; }
  void find_candidates(const GpsSnapshot& gps, const AntennaPlace& antenna, std::uint32_t blocked);
  void drop_channels(SimTime t);
  void take_channels(SimTime t);
  void acquire(GnssChannel& channel, SimTime t);
  void lock(GnssChannel& channel);
  void slip(GnssChannel& channel, double cycles, SimTime t);
  void slip_by_itself(GnssChannel& channel, SimTime t, double dt_s);
  void settle_parity(GnssChannel& channel, SimTime t);
  void wander(GnssChannel& channel, double dt_s);
  struct Epoch;
  void measure(GnssChannel& channel, const Epoch& e, std::size_t place);
  void append(GnssChannel& channel, const Epoch& e, const ReceivedSignal& signal,
              const std::array<double, 3>& normals, bool l2);
  void draw_noise();
  const Candidate* candidate(int prn) const;

  GnssTrackingOptions options_;
  SightCheck sight_;
  Cn0Model cn0_;
  std::array<Satellite, gps::kSatellites> satellites_;
  std::vector<Candidate> candidates_;  // by rank, the chosen ones first
  std::size_t chosen_ = 0;
  std::array<const Candidate*, gps::kSatellites> chosen_of_{};  // of each satellite, or null
  std::uint32_t in_sight_ = 0;
  std::vector<GnssChannel> channels_;
  std::vector<novatel::RangeObservation> observations_;
  std::vector<RandomStream*> noise_streams_;    // of those in lock: all of L1, then all of L2
  std::vector<std::array<double, 3>> normals_;  // of each: code, phase, Doppler
  bool first_ = true, tracking_start_ = true, cold_ = false;
  SimTime last_;
};

}  // namespace orrery
