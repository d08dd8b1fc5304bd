/// The latest epochs with what was measured at them and the filter as it stood: what rewinding
/// needs.
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/formation_filter.hpp"

namespace formation_gnc {

struct EpochEntry {
  std::int64_t t_ns = 0;
  bool has_own = false, has_remote = false;
  Quaternion q_own, q_remote;
  GnssEpoch own, remote;
  FormationFilter after_own;  ///< before the companion's measurements of this epoch were used
};

/// Entries by ascending time, of bounded number.
class EpochRing {
 public:
  static constexpr int kCapacity = 24;

  int count() const { return count_; }
  EpochEntry& operator[](int k) { return entry_[order_[k]]; }
  const EpochEntry& operator[](int k) const { return entry_[order_[k]]; }
  /// Index of the latest entry not after t, or -1.
  int last_until(std::int64_t t_ns) const;
  /// A blank entry at its place in time. With `depth` there already, the oldest goes.
  /// @return its index, or -1 if it would become the oldest of a full ring.
  int insert(std::int64_t t_ns, int depth);
  void clear() { count_ = 0; }

 private:
  EpochEntry entry_[kCapacity];
  int order_[kCapacity] = {};
  int count_ = 0;
};

}  // namespace formation_gnc
