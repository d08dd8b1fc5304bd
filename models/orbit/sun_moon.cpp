#include <orrery/models/frames/time_scales.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

#include <erfa.h>
#include <erfam.h>

#include <cmath>

namespace orrery {
namespace {

constexpr double kDeg = 1.745329251994329576923691e-2;
constexpr double kArcsec = kDeg / 3600;
constexpr double kObliquityJ2000_rad = 23.43929111 * kDeg;

Vec3 equatorial(double longitude_rad, double latitude_rad, double distance_m) {
  const double in_plane = distance_m * std::cos(latitude_rad);
  const double x = in_plane * std::cos(longitude_rad), y = in_plane * std::sin(longitude_rad);
  const double z = distance_m * std::sin(latitude_rad);
  const double c = std::cos(kObliquityJ2000_rad), s = std::sin(kObliquityJ2000_rad);
  return {x, c * y - s * z, s * y + c * z};
}

// A term of the lunar series: amplitude of a multiple of (l, l', F, D).
struct Term {
  double amplitude;
  int l, l_sun, F, D;
};

struct LunarArguments {
  double l, l_sun, F, D;
  double of(const Term& k) const { return k.l * l + k.l_sun * l_sun + k.F * F + k.D * D; }
};

constexpr Term kLongitude_arcsec[] = {
    {22640, 1, 0, 0, 0}, {769, 2, 0, 0, 0},   {-4586, 1, 0, 0, -2}, {2370, 0, 0, 0, 2},
    {-668, 0, 1, 0, 0},  {-412, 0, 0, 2, 0},  {-212, 2, 0, 0, -2},  {-206, 1, 1, 0, -2},
    {192, 1, 0, 0, 2},   {-165, 0, 1, 0, -2}, {148, 1, -1, 0, 0},   {-125, 0, 0, 0, 1},
    {-110, 1, 1, 0, 0},  {-55, 0, 0, 2, -2}};
constexpr Term kLatitude_arcsec[] = {{-526, 0, 0, 1, -2}, {44, 1, 0, 1, -2},  {-31, -1, 0, 1, -2},
                                     {-25, -2, 0, 1, 0},  {-23, 0, 1, 1, -2}, {21, -1, 0, 1, 0},
                                     {11, 0, -1, 1, -2}};
constexpr Term kDistance_km[] = {{-20905, 1, 0, 0, 0}, {-3699, -1, 0, 0, 2}, {-2956, 0, 0, 0, 2},
                                 {-570, 2, 0, 0, 0},   {246, 2, 0, 0, -2},   {-205, 0, 1, 0, -2},
                                 {-171, 1, 0, 0, 2},   {-152, 1, 1, 0, -2}};

}  // namespace

Vec3 sun_position_ECI(double T) {
  const double M = (357.5256 + 35999.049 * T) * kDeg;
  const double longitude =
      282.9400 * kDeg + M + (6892 * std::sin(M) + 72 * std::sin(2 * M)) * kArcsec;
  const double distance_m = (149.619 - 2.499 * std::cos(M) - 0.021 * std::cos(2 * M)) * 1e9;
  return equatorial(longitude, 0, distance_m);
}

Vec3 moon_position_ECI(double T) {
  // The last term refers the longitude to the equinox of J2000.
  const double L0 = (218.31617 + 481267.88088 * T - 1.3972 * T) * kDeg;
  const LunarArguments a{(134.96292 + 477198.86753 * T) * kDeg,
                         (357.52543 + 35999.04944 * T) * kDeg, (93.27283 + 483202.01873 * T) * kDeg,
                         (297.85027 + 445267.11135 * T) * kDeg};
  double longitude = 0, latitude = 0, distance_km = 385000;
  for (const Term& k : kLongitude_arcsec) longitude += k.amplitude * std::sin(a.of(k));
  for (const Term& k : kLatitude_arcsec) latitude += k.amplitude * std::sin(a.of(k));
  for (const Term& k : kDistance_km) distance_km += k.amplitude * std::cos(a.of(k));
  latitude +=
      18520 *
      std::sin(a.F + (longitude + 412 * std::sin(2 * a.F) + 541 * std::sin(a.l_sun)) * kArcsec);
  return equatorial(L0 + longitude * kArcsec, latitude * kArcsec, distance_km * 1e3);
}

Vec3 sun_position_ECI(SimTime t) {
  return sun_position_ECI(gps_to_tt_centuries(t));
}

Vec3 moon_position_ECI(SimTime t) {
  return moon_position_ECI(gps_to_tt_centuries(t));
}

Vec3 apparent_sun_direction_ECI(SimTime t) {
  const JulianDate tt = gps_to_tt(t);  // for TDB: 2 ms apart, 0.1 mas of the Sun
  double heliocentric[2][3], barycentric[2][3];
  eraEpv00(tt.day, tt.fraction, heliocentric, barycentric);
  const Vec3 r_sun_au{-heliocentric[0][0], -heliocentric[0][1], -heliocentric[0][2]};
  const double distance_au = norm(r_sun_au);
  const Vec3 natural = r_sun_au / distance_au;

  constexpr double kLightTime_day_per_au = ERFA_AULT / ERFA_DAYSEC;
  const Vec3 beta =
      kLightTime_day_per_au * Vec3{barycentric[1][0], barycentric[1][1], barycentric[1][2]};
  double pnat[3] = {natural.x, natural.y, natural.z}, v[3] = {beta.x, beta.y, beta.z}, seen[3];
  eraAb(pnat, v, distance_au, std::sqrt(1 - dot(beta, beta)), seen);
  return {seen[0], seen[1], seen[2]};
}

double apparent_solar_right_ascension_rad(SimTime t) {
  const Vec3 s = apparent_sun_direction_ECI(t);
  const double angle = std::atan2(s.y, s.x);
  return angle < 0 ? angle + ERFA_D2PI : angle;
}

}  // namespace orrery
