/// Changes of velocity that the two spacecraft were commanded to make.
#pragma once

#include <cstdint>

#include "support/matrix.hpp"

namespace formation_gnc {

enum class Who : std::uint8_t { kSelf = 0, kOther = 1 };

struct Maneuver {
  Who who = Who::kSelf;
  std::int64_t t_ns = 0;        ///< its middle, GPS time
  double duration_s = 0.0;      ///< valves open, 0 to 600; spread evenly over that time
  flight_support::Vec3 dv_ECI;  ///< [m/s]
  double sigma_mps = 0.0;       ///< per axis, of the execution
  double more_along_mps = 0.0;  ///< and as an error of its own along dv_ECI
};

/// The latest ones, by time; of bounded number, so that old ones make room for new ones.
class ManeuverList {
 public:
  static constexpr int kCapacity = 32;

  /// The same (who, t_ns) again replaces the former.
  /// @return false, and nothing changed, for values that are not finite or out of range, and for
  /// one
  ///         that is older than a full list.
  bool add(const Maneuver& maneuver);

  int count() const { return count_; }
  const Maneuver& operator[](int k) const { return item_[k]; }

  /// The share [0, 1] of item k that falls into (from, until].
  double share(int k, std::int64_t from_ns, std::int64_t until_ns) const;
  /// Where that share acts: the middle of the part inside (from, until].
  std::int64_t middle_of_share(int k, std::int64_t from_ns, std::int64_t until_ns) const;

 private:
  Maneuver item_[kCapacity];
  int count_ = 0;
};

}  // namespace formation_gnc
