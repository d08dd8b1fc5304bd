/// Which double differences are integers by now, and which integers those are.
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/state_order.hpp"

namespace formation_gnc {

struct IntegerOptions {
  bool enabled = true;
  double success_rate = 0.99999;
  double ratio = 3.0;
  float lock_s = 60.0f;       ///< shorter arcs are not tried
  int repetitions = 3;        ///< the same integers at so many attempts in a row
  int fewest_satellites = 5;  ///< of a first fix
  double hold_sigma_cycles = 0.01;
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
  void release_all() { *this = IntegerSet(); }

 private:
  std::uint64_t held_ = 0;  // bit prn
  std::int32_t value_[33] = {};
};

}  // namespace formation_gnc
