#include "formation_gnc/navigation/carrier_arcs.hpp"

#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

constexpr double kLockTolerance_s = 0.1;
constexpr float kSaturatedLock_s = 65000.0f;  // RANGECMP ends at 65535.97 s
constexpr std::int64_t kLongestGap_ns = 600 * flight_support::kSecond_ns;

}  // namespace

int CarrierArcs::find(int prn) const {
  for (int k = 0; k < kChannels; ++k) {
    if (arc_[k].prn == prn) return k;
  }
  return -1;
}

bool CarrierArcs::seen(int prn, std::int64_t t_ns) const {
  const int channel = find(prn);
  return channel >= 0 && arc_[channel].last_ns == t_ns;
}

bool CarrierArcs::continues(int channel, const Observation& o, std::int64_t t_ns) const {
  const CarrierArc& arc = arc_[channel];
  if (arc.prn != o.prn || arc.half_cycle != o.half_cycle) return false;
  const std::int64_t gap_ns = t_ns - arc.last_ns;
  if (gap_ns < 0 || gap_ns > kLongestGap_ns) return false;
  const double expected_s = static_cast<double>(arc.lock_s) + flight_support::seconds(gap_ns);
  return o.lock_s > kSaturatedLock_s ||
         static_cast<double>(o.lock_s) > expected_s - kLockTolerance_s;
}

int CarrierArcs::channel_for(int prn) const {
  const int own = find(prn);
  if (own >= 0) return own;
  int oldest = 0;
  for (int k = 0; k < kChannels; ++k) {
    if (arc_[k].prn == 0) return k;
    if (arc_[k].last_ns < arc_[oldest].last_ns) oldest = k;
  }
  return oldest;
}

}  // namespace formation_gnc
