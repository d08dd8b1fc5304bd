#include "formation_gnc/control/sun_direction.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::kPi;
using flight_support::StateEci;
using flight_support::Vec3;
using flight_support::vec3;

constexpr double kArcsec_rad = kPi / (180.0 * 3600.0);
constexpr double kAstronomicalUnit_m = 1.495978707e11;  // IAU 2012
constexpr double kSpeedOfLight_mps = 299792458.0;
// Constant of aberration times 1 - e^2: what the Earth's transverse speed makes of it at 1 au.
constexpr double kAberration_arcsec = 20.4898;
// From the dynamical frame of VSOP87 to FK5, in longitude: Meeus (1998), eq. 32.3.
constexpr double kFk5_arcsec = -0.09033;

// A cos(B + C tau), A in 1e-8 rad, tau in Julian millennia: VSOP87D, Earth.
struct Term {
  double amplitude, phase_rad, rate_radpky;
};
// Terms below 0.1" are left out; the root of the sum of their squares is 0.2".
constexpr Term kL0[] = {
    {175347046, 0, 0},
    {3341656, 4.6692568, 6283.0758500},
    {34894, 4.62610, 12566.15170},
    {3497, 2.7441, 5753.3849},
    {3418, 2.8289, 3.5231},
    {3136, 3.6277, 77713.7715},
    {2676, 4.4181, 7860.4194},
    {2343, 6.1352, 3930.2097},
    {1324, 0.7425, 11506.7698},
    {1273, 2.0371, 529.6910},
    {1199, 1.1096, 1577.3435},
    {990, 5.233, 5884.927},
    {902, 2.045, 26.298},
    {857, 3.508, 398.149},
    {780, 1.179, 5223.694},
    {753, 2.533, 5507.553},
    {505, 4.583, 18849.228},
    {492, 4.205, 775.523},
    {357, 2.920, 0.067},
    {317, 5.849, 11790.629},
    {284, 1.899, 796.298},
    {271, 0.315, 10977.079},
    {243, 0.345, 5486.778},
    {206, 4.806, 2544.314},
    {205, 1.869, 5573.143},
    {202, 2.458, 6069.777},
    {156, 0.833, 213.299},
    {132, 3.411, 2942.463},
    {126, 1.083, 20.775},
    {115, 0.645, 0.980},
    {103, 0.636, 4694.003},
    {102, 0.976, 15720.839},
    {102, 4.267, 7.114},
    {99, 6.21, 2146.17},
    {98, 0.68, 155.42},
    {86, 5.98, 161000.69},
    {85, 1.30, 6275.96},
    {85, 3.67, 71430.70},
    {80, 1.81, 17260.15},
    {79, 3.04, 12036.46},
    {75, 1.76, 5088.63},
    {74, 3.50, 3154.69},
    {74, 4.68, 801.82},
    {70, 0.83, 9437.76},
    {62, 3.98, 8827.39},
    {61, 1.82, 7084.90},
    {57, 2.78, 6286.60},
    {56, 4.39, 14143.50},
    {56, 3.47, 6279.55},
    {52, 0.19, 12139.55},
    {52, 1.33, 1748.02},
    {51, 0.28, 5856.48},
};
constexpr Term kL1[] = {
    {628331966747.0, 0, 0},     {206059, 2.678235, 6283.075850},
    {4303, 2.6351, 12566.1517}, {425, 1.590, 3.523},
    {119, 5.796, 26.298},       {109, 2.966, 1577.344},
};
constexpr Term kL2[] = {{52919, 0, 0}, {8720, 1.0721, 6283.0758}};
constexpr Term kB0[] = {{280, 3.199, 84334.662}, {102, 5.422, 5507.553}, {80, 3.88, 5223.69}};
// Distance, in 1e-8 au: enough for parallax and aberration.
constexpr Term kR0[] = {{100013989, 0, 0}, {1670700, 3.0984635, 6283.0758500}};

template <int N>
double sum(const Term (&terms)[N], double tau) {
  double total = 0.0;
  for (const Term& term : terms) {
    total += term.amplitude * std::cos(term.phase_rad + term.rate_radpky * tau);
  }
  return total * 1e-8;
}

struct Sun {
  Vec3 direction_EME2000;  // apparent, from the Earth's centre
  double distance_m;
};

Sun geocentric_sun(std::int64_t t_ns) {
  const double t_cy = flight_support::tt_centuries(t_ns);
  const double tau = t_cy / 10.0;
  const double earth_longitude = sum(kL0, tau) + (sum(kL1, tau) + sum(kL2, tau) * tau) * tau;
  const double distance_au = sum(kR0, tau);
  const double longitude =
      earth_longitude + kPi + (kFk5_arcsec - kAberration_arcsec / distance_au) * kArcsec_rad;
  const double latitude = -sum(kB0, tau);
  const double obliquity = flight_support::mean_obliquity_rad(t_cy);
  const double c = std::cos(latitude), ce = std::cos(obliquity), se = std::sin(obliquity);
  const double x = c * std::cos(longitude), y = c * std::sin(longitude), z = std::sin(latitude);
  const Vec3 of_date = vec3(x, ce * y - se * z, se * y + ce * z);
  return {transpose(flight_support::precession(t_cy)) * of_date, distance_au * kAstronomicalUnit_m};
}

Vec3 unit(const Vec3& v) {
  return (1.0 / norm(v)) * v;
}

}  // namespace

Vec3 sun_direction_EME2000(std::int64_t t_ns) {
  return geocentric_sun(t_ns).direction_EME2000;
}

Vec3 sun_direction_EME2000(std::int64_t t_ns, const StateEci& observer) {
  const Sun sun = geocentric_sun(t_ns);
  const Vec3 to_sun = unit(sun.distance_m * sun.direction_EME2000 - observer.r_ECI);
  return unit(to_sun + (1.0 / kSpeedOfLight_mps) * observer.v_ECI);
}

}  // namespace formation_gnc
