#include "gnss_fix.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace flight_support {
namespace {

// Anything outside is not a spacecraft near the Earth; it would only poison the filter.
constexpr double kMinRadius_m = 6.3e6;
constexpr double kMaxRadius_m = 5.0e7;
constexpr double kMaxSpeed_mps = 1.2e4;
constexpr std::int64_t kMaxEpoch_ns = 6200 * kWeek_ns;

Vec3 to_vec3(const double* v) {
  return vec3(v[0], v[1], v[2]);
}

double rms(const float* sigma) {
  const Vec3 s = vec3(static_cast<double>(sigma[0]), static_cast<double>(sigma[1]),
                      static_cast<double>(sigma[2]));
  return std::sqrt(dot(s, s) / 3.0);
}

bool has_solution(const novatel_bestxyz& log) {
  return log.position_status == NOVATEL_SOL_COMPUTED && log.position_type != 0 &&
         log.velocity_status == NOVATEL_SOL_COMPUTED && log.velocity_type != 0;
}

}  // namespace

bool is_plausible(const GnssFix& fix) {
  const double r = norm(fix.r_ECEF);
  const double v = norm(fix.v_ECEF);
  // Written so that a NaN is not plausible.
  return r > kMinRadius_m && r < kMaxRadius_m && v < kMaxSpeed_mps && fix.sigma_r_m > 0.0 &&
         std::isfinite(fix.sigma_r_m) && fix.epoch_ns > 0 && fix.epoch_ns < kMaxEpoch_ns &&
         fix.sigma_v_mps > 0.0 && std::isfinite(fix.sigma_v_mps);
}

bool repeats(const GnssFix& before, const GnssFix& fix) {
  bool same = before.epoch_ns != fix.epoch_ns;
  for (int k = 0; k < 3; ++k) {
    same = same && before.r_ECEF[k] == fix.r_ECEF[k] && before.v_ECEF[k] == fix.v_ECEF[k];
  }
  return same;
}

bool read_fix(const novatel_frame& frame, GnssFix* fix) {
  novatel_bestxyz log;
  if (novatel_get_bestxyz(&frame, &log) == 0 || !has_solution(log)) return false;
  GnssFix read;
  read.epoch_ns = novatel_time_ns(&frame);  // 0, hence not plausible, if the receiver has no time
  read.r_ECEF = to_vec3(log.r_ECEF);
  read.sigma_r_m = rms(log.sigma_r_ECEF);
  read.v_ECEF = to_vec3(log.v_ECEF);
  read.sigma_v_mps = rms(log.sigma_v_ECEF);
  if (!is_plausible(read)) return false;
  *fix = read;
  return true;
}

}  // namespace flight_support
