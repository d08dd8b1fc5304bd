#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/gnss/gps_constants.hpp>
#include <orrery/models/gnss/signal_path.hpp>
#include <orrery/models/orbit/earth.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

using gps::kOmegaEarth_radps;
using gps::kSpeedOfLight_mps;

double checked(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return value;
  throw std::invalid_argument("SightOptions: " + std::string(name) + " = " + to_text(value) +
                              "; accepted: " + to_text(low) + " to " + to_text(high));
}

/// Components in ECEF of `angle` later, of what stood still in space: angles up to 1e-5 rad.
Vec3 earth_turned(const Vec3& r, double angle_rad) {
  const double c = -0.5 * angle_rad * angle_rad;
  return {r.x + c * r.x + angle_rad * r.y, r.y + c * r.y - angle_rad * r.x, r.z};
}

Vec3 effective_dipole(const Vec3& x, const Vec3& k_cross_y, const Vec3& k, double sign) {
  return x - dot(k, x) * k + sign * k_cross_y;
}

}  // namespace

SightCheck::SightCheck(const SightOptions& options)
    : cos_mask_(
          std::cos(checked("antenna_mask_rad", options.antenna_mask_rad, 0, std::numbers::pi))),
      sin_elevation_mask_(std::sin(checked("elevation_mask_rad", options.elevation_mask_rad,
                                           -std::numbers::pi / 2, std::numbers::pi / 2))),
      blocked_radius_m_(kRadiusEarth_m +
                        checked("grazing_altitude_m", options.grazing_altitude_m, 0, 1e6)),
      cos_beam_(
          std::cos(checked("transmit_beam_rad", options.transmit_beam_rad, 0, std::numbers::pi))) {
  // cos(pi/2) is 6e-17 in double precision: the mask at 90 deg includes the edge.
  if (options.antenna_mask_rad == std::numbers::pi / 2) cos_mask_ = 0;
}

Sight SightCheck::operator()(const AntennaPlace& antenna, double radius_m,
                             const Vec3& satellite_ECEF) const {
  Sight s;
  const Vec3 d = satellite_ECEF - antenna.r_ECEF;
  const double along_boresight_m = dot(antenna.R_AE.row_z, d);
  if (along_boresight_m < 0 && cos_mask_ >= 0) return s;  // half the sky without a root
  s.distance_m = norm(d);
  s.u_ECEF = (1 / s.distance_m) * d;
  s.cos_off_boresight = along_boresight_m / s.distance_m;
  if (s.cos_off_boresight < cos_mask_) return s;
  const double along_r = dot(antenna.r_ECEF, s.u_ECEF);
  s.sin_elevation = along_r / radius_m;
  if (s.sin_elevation < sin_elevation_mask_) return s;
  // The point nearest to the Earth's centre lies on the way only if the satellite is below the
  // horizontal.
  const double nearest2 = radius_m * radius_m - along_r * along_r;
  if (along_r < 0 && nearest2 < blocked_radius_m_ * blocked_radius_m_) return s;
  s.clear = dot(satellite_ECEF, s.u_ECEF) >= cos_beam_ * norm(satellite_ECEF);
  return s;
}

ReceivedSignal receive(const SatelliteState& satellite, const AntennaPlace& antenna,
                       const Sight& sight, double delay_s) {
  const Vec3 r = antenna.r_ECEF + delay_s * (antenna.v_ECEF + (0.5 * delay_s) * antenna.a_ECEF);
  const Vec3 v = antenna.v_ECEF + delay_s * antenna.a_ECEF;
  // During tau the satellite moves in space, where ECEF turns.
  const Vec3 v_space =
      satellite.v_ECEF + kOmegaEarth_radps * Vec3{-satellite.r_ECEF.y, satellite.r_ECEF.x, 0};
  const double u_v = dot(sight.u_ECEF, v_space);
  const double opening_mps = dot(sight.u_ECEF, satellite.v_ECEF - v);
  const double tau_s = (sight.distance_m + delay_s * opening_mps) / (kSpeedOfLight_mps + u_v);
  const double dt_s = delay_s - tau_s;
  const Vec3 r_s =
      earth_turned(satellite.r_ECEF + dt_s * (satellite.v_ECEF + (0.5 * dt_s) * satellite.a_ECEF),
                   kOmegaEarth_radps * tau_s);
  const Vec3 d = r_s - r;
  ReceivedSignal out;
  const double range_m = norm(d);
  const Vec3 u = (1 / range_m) * d;
  const Vec3 v_s =
      earth_turned(satellite.v_ECEF + dt_s * satellite.a_ECEF, kOmegaEarth_radps * tau_s);
  const Vec3 turning_back{kOmegaEarth_radps * r_s.y, -kOmegaEarth_radps * r_s.x, 0};
  // What tau was wrong by moves the satellite once more, by its velocity in space.
  const double u_v_space = dot(u, v_s - turning_back);
  constexpr double kSecondsPerMetre = 1 / kSpeedOfLight_mps;
  const double correction_s = kSecondsPerMetre * range_m - tau_s;
  out.range_m = range_m - correction_s * u_v_space;
  // rho' = u . (v_s (1 - tau') + omega tau' (r_s turning back) - v) with tau' = rho'/c.
  out.range_rate_mps = dot(u, v_s - v) / (1 + u_v_space / kSpeedOfLight_mps);
  out.satellite_clock_s =
      satellite.clock_s +
      dt_s * (satellite.clock_rate_sps + 0.5 * dt_s * satellite.clock_acceleration_sps2);
  out.satellite_clock_rate_sps =
      satellite.clock_rate_sps + dt_s * satellite.clock_acceleration_sps2;
  return out;
}

double ionosphere_L1_m(double vertical_tecu, double sin_elevation) {
  constexpr double kMetresPerTecu = 40.3e16 / (gps::kL1_Hz * gps::kL1_Hz);
  return kMetresPerTecu * vertical_tecu * 2.037 /
         (std::sqrt(sin_elevation * sin_elevation + 0.076) + sin_elevation);
}

double wind_up_cycles(const Vec3& satellite_ECEF, const Vec3& r_sun_ECEF,
                      const AntennaPlace& antenna) {
  const Vec3 k = unit(antenna.r_ECEF - satellite_ECEF);  // from the satellite
  const Vec3 z_s = -unit(satellite_ECEF);
  const Vec3 y_s = unit(cross(z_s, r_sun_ECEF - satellite_ECEF));
  const Vec3 x_s = cross(y_s, z_s);
  const Vec3 transmit = effective_dipole(x_s, cross(k, y_s), k, -1);
  const Vec3 receive = effective_dipole(antenna.R_AE.row_x, cross(k, antenna.R_AE.row_y), k, 1);
  return std::atan2(dot(k, cross(transmit, receive)), dot(transmit, receive)) /
         (2 * std::numbers::pi);
}

}  // namespace orrery
