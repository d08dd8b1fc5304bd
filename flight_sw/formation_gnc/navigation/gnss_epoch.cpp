#include "formation_gnc/navigation/gnss_epoch.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

constexpr double kMinRadius_m = 6.3e6, kMaxRadius_m = 5.0e7, kMaxSpeed_mps = 1.2e4;
constexpr std::int64_t kMaxEpoch_ns = 6200 * flight_support::kWeek_ns;

// Comparisons are written so that NaN fails.
bool fix_is_plausible(const GnssEpoch& epoch) {
  const double r = norm(epoch.r_ECEF), v = norm(epoch.v_ECEF);
  return r > kMinRadius_m && r < kMaxRadius_m && v < kMaxSpeed_mps && epoch.sigma_r_m > 0.0f &&
         epoch.sigma_r_m < 1e6f && epoch.sigma_v_mps > 0.0f && epoch.sigma_v_mps < 1e4f;
}

}  // namespace

Mat3 rotation_of(const Quaternion& q) {
  const double s = 2.0 / (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  Mat3 R;
  R(0, 0) = 1.0 - s * (q.y * q.y + q.z * q.z);
  R(0, 1) = s * (q.x * q.y - q.w * q.z);
  R(0, 2) = s * (q.x * q.z + q.w * q.y);
  R(1, 0) = s * (q.x * q.y + q.w * q.z);
  R(1, 1) = 1.0 - s * (q.x * q.x + q.z * q.z);
  R(1, 2) = s * (q.y * q.z - q.w * q.x);
  R(2, 0) = s * (q.x * q.z - q.w * q.y);
  R(2, 1) = s * (q.y * q.z + q.w * q.x);
  R(2, 2) = 1.0 - s * (q.x * q.x + q.y * q.y);
  return R;
}

bool is_plausible(const Quaternion& q) {
  const double square = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  return square > 0.25 && square < 4.0;
}

bool is_plausible(const GnssEpoch& epoch) {
  if (epoch.t_ns <= 0 || epoch.t_ns >= kMaxEpoch_ns) return false;
  if (epoch.count < 0 || epoch.count > kChannels) return false;
  return !epoch.has_fix || fix_is_plausible(epoch);
}

bool is_plausible(const Observation& o) {
  return o.prn >= 1 && o.prn <= 32 && o.code_m > 1.5e7 && o.code_m < 5e7 &&
         std::fabs(o.phase_cycles) < 1099511627776.0 && o.cn0_dBHz >= 10.0f &&
         o.cn0_dBHz <= 60.0f && o.lock_s >= 0.0f;
}

}  // namespace formation_gnc
