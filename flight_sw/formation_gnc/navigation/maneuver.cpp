#include "formation_gnc/navigation/maneuver.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

constexpr double kMostDuration_s = 600.0, kMostDv_mps = 100.0;

// Written so that NaN fails.
bool is_plausible(const Maneuver& m) {
  return m.t_ns > 0 && m.duration_s >= 0.0 && m.duration_s <= kMostDuration_s &&
         norm(m.dv_ECI) <= kMostDv_mps && m.sigma_mps >= 0.0 && m.sigma_mps <= kMostDv_mps &&
         m.more_along_mps >= 0.0 && m.more_along_mps <= kMostDv_mps;
}

struct Interval {
  std::int64_t from_ns, until_ns;
};

Interval of(const Maneuver& m) {
  const std::int64_t half_ns = flight_support::nanoseconds(m.duration_s) / 2;
  return {m.t_ns - half_ns, m.t_ns + half_ns};
}

}  // namespace

bool ManeuverList::add(const Maneuver& maneuver) {
  if (!is_plausible(maneuver)) return false;
  int at = count_;
  for (int k = 0; k < count_; ++k) {
    if (item_[k].who == maneuver.who && item_[k].t_ns == maneuver.t_ns) {
      item_[k] = maneuver;
      return true;
    }
  }
  while (at > 0 && item_[at - 1].t_ns > maneuver.t_ns) --at;
  if (count_ == kCapacity) {
    if (at == 0) return false;
    for (int k = 1; k < at; ++k) item_[k - 1] = item_[k];
    item_[at - 1] = maneuver;
    return true;
  }
  for (int k = count_; k > at; --k) item_[k] = item_[k - 1];
  item_[at] = maneuver;
  ++count_;
  return true;
}

double ManeuverList::share(int k, std::int64_t from_ns, std::int64_t until_ns) const {
  const Interval burn = of(item_[k]);
  if (burn.from_ns == burn.until_ns) {
    return burn.from_ns > from_ns && burn.from_ns <= until_ns ? 1.0 : 0.0;
  }
  const std::int64_t begin = burn.from_ns > from_ns ? burn.from_ns : from_ns;
  const std::int64_t end = burn.until_ns < until_ns ? burn.until_ns : until_ns;
  if (end <= begin) return 0.0;
  return static_cast<double>(end - begin) / static_cast<double>(burn.until_ns - burn.from_ns);
}

std::int64_t ManeuverList::middle_of_share(int k, std::int64_t from_ns,
                                           std::int64_t until_ns) const {
  const Interval burn = of(item_[k]);
  const std::int64_t begin = burn.from_ns > from_ns ? burn.from_ns : from_ns;
  const std::int64_t end = burn.until_ns < until_ns ? burn.until_ns : until_ns;
  return begin + (end - begin) / 2;
}

}  // namespace formation_gnc
