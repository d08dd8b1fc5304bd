#include "formation_gnc/mission/bus_attitude.hpp"

#include <cmath>

namespace formation_gnc {

using flight_support::Vec3;

namespace {

// The bus speaks every second; older than some minutes a rate says nothing.
constexpr double kRateLasts_s = 300.0;

// The turn of q by omega_B over dt, of a body whose rate is constant.
Quaternion turned(const Quaternion& q, const Vec3& omega_B, double dt_s) {
  const double rate = norm(omega_B);
  const double half = 0.5 * rate * dt_s;
  const double k = rate > 0.0 ? std::sin(half) / rate : 0.0;
  // q_BI turns components from ECI to body, so the turn of the body comes with the opposite sign.
  const Quaternion d{std::cos(half), -k * omega_B[0], -k * omega_B[1], -k * omega_B[2]};
  return {
      d.w * q.w - d.x * q.x - d.y * q.y - d.z * q.z, d.w * q.x + d.x * q.w + d.y * q.z - d.z * q.y,
      d.w * q.y - d.x * q.z + d.y * q.w + d.z * q.x, d.w * q.z + d.x * q.y - d.y * q.x + d.z * q.w};
}

}  // namespace

void BusAttitude::take(std::int64_t t_ns, const Quaternion& q_BI, const Vec3& omega_B) {
  t_ns_ = t_ns;
  q_BI_ = q_BI;
  omega_B_ = omega_B;
}

Quaternion BusAttitude::at(std::int64_t t_ns) const {
  const double dt_s = 1e-9 * static_cast<double>(t_ns - t_ns_);
  return std::fabs(dt_s) < kRateLasts_s ? turned(q_BI_, omega_B_, dt_s) : q_BI_;
}

}  // namespace formation_gnc
