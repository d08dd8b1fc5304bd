#include <orrery/models/orbit/thrust.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

double mass_flow(double force_N, double isp_s) {
  if (!(isp_s > 0)) {
    throw std::invalid_argument("Thrust: isp_s = " + std::to_string(isp_s) +
                                " s; accepted: above 0");
  }
  return force_N / (kStandardGravity_mps2 * isp_s);
}

// Integral of dt / m over a span that begins at mass_kg: ln(m0/m1) / flow.
double time_over_mass(double span_s, double mass_kg, double flow_kgps) {
  if (flow_kgps == 0) return span_s / mass_kg;
  return -std::log1p(-flow_kgps * span_s / mass_kg) / flow_kgps;
}

}  // namespace

Thrust Thrust::body_fixed(const Vec3& force_B, double isp_s) {
  const double force_N = norm(force_B);
  return {.force_B = force_B,
          .force_ECI = {},
          .mass_flow_kgps = mass_flow(force_N, isp_s),
          .nozzle_N = force_N};
}

Thrust Thrust::inertial(const Vec3& force_ECI, double isp_s) {
  const double force_N = norm(force_ECI);
  return {.force_B = {},
          .force_ECI = force_ECI,
          .mass_flow_kgps = mass_flow(force_N, isp_s),
          .nozzle_N = force_N};
}

Thrust operator+(const Thrust& a, const Thrust& b) {
  return {.force_B = a.force_B + b.force_B,
          .force_ECI = a.force_ECI + b.force_ECI,
          .mass_flow_kgps = a.mass_flow_kgps + b.mass_flow_kgps,
          .nozzle_N = a.nozzle_N + b.nozzle_N};
}

void PropulsionAccount::thrust(SimTime t, const Thrust& thrust, double mass_kg) {
  closed_.impulse_Ns += thrust_.nozzle_N * to_seconds(t - begin_);
  firing_ = firing_until(t);
  if (thrust.is_off()) {
    closed_.delta_v_mps += norm(firing_.dv_B) + norm(firing_.dv_ECI);
    firing_ = {};
  }
  thrust_ = thrust;
  begin_ = t;
  mass_kg_ = mass_kg;
}

void PropulsionAccount::impulse(double dv_mps, double mass_kg) {
  closed_.delta_v_mps += dv_mps;
  closed_.impulse_Ns += dv_mps * mass_kg;
}

Propulsion PropulsionAccount::at(SimTime t) const {
  const Firing firing = firing_until(t);
  return {closed_.delta_v_mps + norm(firing.dv_B) + norm(firing.dv_ECI),
          closed_.impulse_Ns + thrust_.nozzle_N * to_seconds(t - begin_)};
}

PropulsionAccount::Firing PropulsionAccount::firing_until(SimTime t) const {
  if (thrust_.is_off()) return firing_;
  const double s_per_kg = time_over_mass(to_seconds(t - begin_), mass_kg_, thrust_.mass_flow_kgps);
  return {firing_.dv_B + s_per_kg * thrust_.force_B, firing_.dv_ECI + s_per_kg * thrust_.force_ECI};
}

}  // namespace orrery
