#include "formation_gnc/navigation/epoch_ring.hpp"

namespace formation_gnc {

int EpochRing::last_until(std::int64_t t_ns) const {
  int k = count_ - 1;
  while (k >= 0 && (*this)[k].t_ns > t_ns) --k;
  return k;
}

int EpochRing::insert(std::int64_t t_ns, int depth) {
  int at = last_until(t_ns) + 1;
  if (count_ >= depth) {
    if (at <= 1) return -1;  // nothing would be left behind it to start from
    const int freed = order_[0];
    for (int k = 1; k < count_; ++k) order_[k - 1] = order_[k];
    order_[count_ - 1] = freed;
    --count_;
    --at;
  } else {
    order_[count_] = count_;  // entries are never freed one by one: these are the unused ones
  }
  const int slot = order_[count_];
  for (int k = count_; k > at; --k) order_[k] = order_[k - 1];
  order_[at] = slot;
  ++count_;
  EpochEntry& entry = entry_[slot];
  entry.t_ns = t_ns;
  entry.has_own = entry.has_remote = false;
  return at;
}

}  // namespace formation_gnc
