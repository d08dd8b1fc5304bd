#include "formation_gnc/navigation/signal_geometry.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::kMuEarth_m3ps2;
using flight_support::vec3;

SatelliteState to_ECI(const SatelliteState& s, const Mat3& R_IE) {
  SatelliteState out = s;
  const Vec3 turning = vec3(-flight_support::kEarthRotation_radps * s.r[1],
                            flight_support::kEarthRotation_radps * s.r[0], 0.0);
  out.r = R_IE * s.r;
  out.v = R_IE * (s.v + turning);
  return out;
}

// The satellite `dt_s` later, up to 0.1 s.
Vec3 moved(const SatelliteState& s, double pull_ps2, double dt_s) {
  const double a = 1.0 - 0.5 * pull_ps2 * dt_s * dt_s;
  return vec3(a * s.r[0] + dt_s * s.v[0], a * s.r[1] + dt_s * s.v[1], a * s.r[2] + dt_s * s.v[2]);
}

double thermal_sigma_m(double scale_m, double bandwidth_Hz, double cn0_dBHz) {
  return scale_m * std::sqrt(bandwidth_Hz / std::exp(cn0_dBHz * 0.23025850929940457));
}

}  // namespace

void SatelliteTable::prepare(const GnssEpoch& epoch, const EphemerisStore& ephemerides,
                             const flight_support::EarthTime& earth_time, EarthAttitude* earth) {
  if (epoch.t_ns != t_ns_) {
    t_ns_ = epoch.t_ns;
    count_ = 0;
  }
  const std::int64_t before_ns = t_ns_ - flight_support::nanoseconds(kBefore_s);
  const Mat3 R_IE = turned_with_earth(earth->ecef_to_eci(t_ns_, earth_time), -kBefore_s);
  for (int k = 0; k < epoch.count && count_ < kCapacity; ++k) {
    const int prn = epoch.observation[k].prn;
    if (prn < 1 || prn > 32 || find(prn) != nullptr) continue;
    const BroadcastEphemeris* ephemeris = ephemerides.find(prn, t_ns_);
    if (ephemeris == nullptr) continue;
    prn_[count_] = static_cast<std::uint8_t>(prn);
    state_[count_++] = to_ECI(satellite_ECEF(*ephemeris, before_ns), R_IE);
  }
}

const SatelliteState* SatelliteTable::find(int prn) const {
  for (int k = 0; k < count_; ++k) {
    if (prn_[k] == prn) return &state_[k];
  }
  return nullptr;
}

Predicted predict(const AntennaState& antenna, const SatelliteState& satellite) {
  constexpr double kPerMetre_s = 1.0 / kSpeedOfLight_mps;
  const double late_s = antenna.clock_m * kPerMetre_s;
  const Vec3 r = antenna.r_ECI - late_s * antenna.v_ECI;
  const double r2 = dot(satellite.r, satellite.r);
  const double pull_ps2 = kMuEarth_m3ps2 / (r2 * std::sqrt(r2));
  // Of the receive time, relative to the instant of the table.
  const double reception_s = SatelliteTable::kBefore_s - late_s;
  const double first_m = norm(satellite.r - r);
  const double dt_s = reception_s - first_m * kPerMetre_s;
  const Vec3 d = moved(satellite, pull_ps2, dt_s) - r;
  const double second_m = norm(d);
  Predicted p;
  p.line_of_sight = (1.0 / second_m) * d;
  const double along_mps = dot(p.line_of_sight, satellite.v);
  // What the light time was wrong by moves the satellite once more.
  const double range_m = second_m - (second_m - first_m) * kPerMetre_s * along_mps;
  const double clock_m = satellite.clock_m + satellite.clock_rate_mps * dt_s;
  p.range_m = range_m - clock_m + antenna.clock_m;
  p.clock_factor = 1.0 + (dot(p.line_of_sight, antenna.v_ECI) - along_mps) * kPerMetre_s;
  return p;
}

double code_sigma_m(double cn0_dBHz) {
  return thermal_sigma_m(kSpeedOfLight_mps / 1.023e6, 7.6e-3, cn0_dBHz);
}

double phase_sigma_m(double cn0_dBHz) {
  return thermal_sigma_m(kWavelength_m / flight_support::kTwoPi, 15.0, cn0_dBHz);
}

}  // namespace formation_gnc
