/// What happens to a signal between the antenna of a GPS satellite and that of a receiver.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>
#include <orrery/models/gnss/broadcast_orbit.hpp>

#include <numbers>

namespace orrery {

/// The receiving antenna's phase centre at one instant of GPS time.
struct AntennaPlace {
  SimTime t;
  Vec3 r_ECEF, v_ECEF, a_ECEF;  // derivatives taken in ECEF
  Mat3 R_AE;  // ECEF -> axes of the antenna: z is its boresight, x what wind-up counts from
};

struct SightOptions {
  double antenna_mask_rad = std::numbers::pi / 2;     // off boresight, 0 to pi
  double elevation_mask_rad = -std::numbers::pi / 2;  // above the local horizontal
  /// A line of sight that comes closer to the ground is blocked (kRadiusEarth_m, a sphere).
  double grazing_altitude_m = 50e3;
  double transmit_beam_rad = 23.5 * std::numbers::pi / 180;  // half angle of the main lobe
};

/// Direction of a satellite from an antenna at one instant, light time left out.
struct Sight {
  bool clear = false;
  double distance_m = 0;
  Vec3 u_ECEF;                   // towards the satellite
  double cos_off_boresight = 0;  // at the receiving antenna
  double sin_elevation = 0;      // above the plane normal to r
};

/// The same cosines and sines of the options, so that 31 satellites cost no trigonometry.
class SightCheck {
 public:
  /// @throws std::invalid_argument  an angle or altitude out of range.
  explicit SightCheck(const SightOptions& options);
  Sight operator()(const AntennaPlace& antenna, double radius_m, const Vec3& satellite_ECEF) const;

 private:
  double cos_mask_, sin_elevation_mask_, blocked_radius_m_, cos_beam_;
};

/// A signal received at an instant.
struct ReceivedSignal {
  double range_m = 0;            // geometric, from transmission to reception
  double range_rate_mps = 0;     // by time of reception
  double satellite_clock_s = 0;  // at transmission, relativity included
  double satellite_clock_rate_sps = 0;
};

/// Light time and the Earth's rotation during it.
///
/// Method      Both ends are carried from their instant `t` to reception and transmission with
///             second-order Taylor terms; the satellite is turned by omega tau. tau is taken from
///             the distance at `t` and the velocities, good to 2e-11 s, and improved once, which
///             contracts the error by v/c < 3e-6: 1e-8 m.
/// Valid for   |delay| <= 1 ms: the third-order term is 1e-12 m, for the satellite's 80 ms 1e-8 m.
/// @param sight    Of this satellite from this antenna.
/// @param delay_s  The signal is received at antenna.t + delay_s.
ReceivedSignal receive(const SatelliteState& satellite, const AntennaPlace& antenna,
                       const Sight& sight, double delay_s);

/// First-order delay of the code on L1 [m] above an orbit; the phase is advanced by the same, L2
/// has (f1/f2)^2 of it.
///
/// Source      40.3 TEC / f^2, with Lear's mapping 2.037 / (sqrt(sin^2 E + 0.076) + sin E); Lear,
///             NASA JSC (1987), as used by Montenbruck & Gill (2002). 1 at the zenith, 7.39 at the
///             horizontal; below it the path goes deeper and the mapping rises on.
/// @param vertical_tecu  Above the receiver, 1e16 electrons/m^2.
double ionosphere_L1_m(double vertical_tecu, double sin_elevation);

/// Phase wind-up [cycles], in (-1/2, 1/2]: what the carrier gains from the antennas' orientation.
///
/// Source      Wu, Wu, Hajj, Bertiger & Lichten, manuscripta geodaetica 18 (1993), with the
///             satellite's nominal yaw steering (z to the Earth, y normal to the Sun).
/// @param r_sun_ECEF  Geocentric.
double wind_up_cycles(const Vec3& satellite_ECEF, const Vec3& r_sun_ECEF,
                      const AntennaPlace& antenna);

}  // namespace orrery
