/// Which double differences are integers by now, and which integers those are.
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/state_order.hpp"
#include "formation_gnc/navigation/ud_factor.hpp"

namespace formation_gnc {

struct IntegerOptions {
  bool enabled = true;
  double success_rate = 0.99999;
  double ratio = 3.0;
  float lock_s = 120.0f;      ///< shorter arcs are not tried
  int repetitions = 3;        ///< the same integers at so many attempts in a row
  int fewest_satellites = 5;  ///< of a first fix
  /// An integer that is right is exact; 0.06 mm keeps the factor regular. 0.01 would leave
  /// 2 mm in the covariance that are not in the estimate.
  double hold_sigma_cycles = 3e-4;
  double residual_gate = 4.0;  ///< sigmas, of each double difference against its integer
};

struct IntegerReport {
  bool tried = false;
  int candidates = 0;  ///< double differences tried
  int fixed = 0;       ///< newly held
  double success_rate = 0.0, ratio = 0.0;
};

/// The integers held: N_other - N_self of a satellite (bases of the arcs taken off) less an unknown
/// integer common to all.
class IntegerSet {
 public:
  bool holds(int prn) const { return (held_ >> prn & 1u) != 0; }
  std::int32_t value(int prn) const { return value_[prn]; }
  int count() const;
  void hold(int prn, std::int32_t value);
  /// One that is left alone says nothing and goes too.
  void release(int prn);
  void release_all() { held_ = 0; }

 private:
  std::uint64_t held_ = 0;  // bit prn
  std::int32_t value_[33] = {};
};

/// What the attempts so far agreed on.
class IntegerTrials {
 public:
  /// Notes the integer of a difference that passed all tests. @return how often in a row by now.
  int note(int prn, int reference_prn, std::int32_t value);
  /// Ends the rows that were not continued since the last call.
  void end_attempt();
  void forget(int prn) { streak_[prn] = 0; }
  int reference() const { return reference_; }

 private:
  std::uint8_t reference_ = 0;
  bool noted_[33] = {};
  std::uint8_t streak_[33] = {};
  std::int32_t value_[33] = {};
};

/// A satellite whose phases of both receivers may be differenced and fixed.
struct IntegerCandidate {
  int prn = 0;
  int channel_self = 0, channel_other = 0;
  double cycles = 0.0;  ///< float N_other - N_self
  double lock_s = 0.0;  ///< the shorter of both
  bool held = false;
};

/// Differences to the reference that the tests accept, after partial fixing.
struct IntegerChoice {
  int count = 0;
  IntegerCandidate difference[kChannels];
  std::int32_t value[kChannels];
  double success_rate = 0.0, ratio = 0.0;
};

/// Float double differences and their covariance, solved; the least certain are left out until
/// success rate and ratio pass, or `fewest` would not be left.
IntegerChoice choose_integers(const IntegerCandidate* candidates, int count,
                              const IntegerCandidate& reference, const UdFactor& covariance,
                              int fewest, const IntegerOptions& options);

}  // namespace formation_gnc
