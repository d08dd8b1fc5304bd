#include "earth_rotation.hpp"

#include <cmath>

#include "constants.hpp"

namespace flight_support {
namespace {

constexpr double kArcsec_rad = kPi / (180.0 * 3600.0);
constexpr double kDegree_rad = kPi / 180.0;
constexpr double kDay_s = 86400.0;
constexpr std::int64_t kDay_ns = 86400 * kSecond_ns;
constexpr double kCentury_d = 36525.0;
constexpr double kJ2000SinceGpsEpoch_d = 7300.5;  // JD 2451545.0 - JD 2444244.5
constexpr double kTtMinusGps_s = 51.184;          // TT - TAI + TAI - GPS = 32.184 + 19

// Rotations of the axes, so that R_x(angle) turns components into axes turned by +angle.
Mat3 rotation_x(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return Mat3{{{1, 0, 0}, {0, c, s}, {0, -s, c}}};
}
Mat3 rotation_y(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return Mat3{{{c, 0, -s}, {0, 1, 0}, {s, 0, c}}};
}
Mat3 rotation_z(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return Mat3{{{c, s, 0}, {-s, c, 0}, {0, 0, 1}}};
}

struct Nutation {
  double longitude_rad, obliquity_rad;
};

// A term of Wahr's series: multiples of (l, l', F, D, Omega), amplitudes in 0.1 mas and their rates
// in 0.1 mas per century. The largest term left out is 6.3 mas.
struct NutationTerm {
  int l, l_sun, f, d, omega;
  double sine, sine_rate, cosine, cosine_rate;
};
constexpr NutationTerm kNutationTerms[] = {
    {0, 0, 0, 0, 1, -171996, -174.2, 92025, 8.9},
    {0, 0, 2, -2, 2, -13187, -1.6, 5736, -3.1},
    {0, 0, 2, 0, 2, -2274, -0.2, 977, -0.5},
    {0, 0, 0, 0, 2, 2062, 0.2, -895, 0.5},
    {0, 1, 0, 0, 0, 1426, -3.4, 54, -0.1},
    {1, 0, 0, 0, 0, 712, 0.1, -7, 0},
    {0, 1, 2, -2, 2, -517, 1.2, 224, -0.6},
    {0, 0, 2, 0, 1, -386, -0.4, 200, 0},
    {1, 0, 2, 0, 2, -301, 0, 129, -0.1},
    {0, -1, 2, -2, 2, 217, -0.5, -95, 0.3},
    {1, 0, 0, -2, 0, -158, 0, 0, 0},
    {0, 0, 2, -2, 1, 129, 0.1, -70, 0},
    {-1, 0, 2, 0, 2, 123, 0, -53, 0},
};

Nutation nutation(double t_cy) {
  const double l = (134.96298139 + 477198.8673981 * t_cy) * kDegree_rad;
  const double l_sun = (357.52772333 + 35999.0503400 * t_cy) * kDegree_rad;
  const double f = (93.27191028 + 483202.0175381 * t_cy) * kDegree_rad;
  const double d = (297.85036306 + 445267.1114800 * t_cy) * kDegree_rad;
  const double omega = (125.04452222 - 1934.1362608 * t_cy) * kDegree_rad;
  double longitude = 0.0, obliquity = 0.0;
  for (const NutationTerm& term : kNutationTerms) {
    const double argument =
        term.l * l + term.l_sun * l_sun + term.f * f + term.d * d + term.omega * omega;
    longitude += (term.sine + term.sine_rate * t_cy) * std::sin(argument);
    obliquity += (term.cosine + term.cosine_rate * t_cy) * std::cos(argument);
  }
  return {longitude * 1e-4 * kArcsec_rad, obliquity * 1e-4 * kArcsec_rad};
}

#ifdef FORMATION_GNC_DEFECT_HIDDEN_STATIC
// Summed anew every ten minutes; time goes on, and this is the only Earth.
Nutation nutation_at(double t_cy) {
  static double last_cy = -1.0;
  static Nutation last;
  if (last_cy < 0.0 || (t_cy - last_cy) * kCentury_d * kDay_s > 600.0) {
    last = nutation(t_cy);
    last_cy = t_cy;
  }
  return last;
}
#else
Nutation nutation_at(double t_cy) {
  return nutation(t_cy);
}
#endif

// Aoki et al. (1982). The day and its fraction come apart, or the double loses 10 microseconds.
double gmst_rad(double whole_days_since_J2000, double extra_days) {
  const double t_cy = (whole_days_since_J2000 + extra_days) / kCentury_d;
  const double polynomial_s =
      67310.54841 + (8640184.812866 + (0.093104 - 6.2e-6 * t_cy) * t_cy) * t_cy;
  const double turns = polynomial_s / kDay_s + std::fmod(whole_days_since_J2000, 1.0) + extra_days;
  return kTwoPi * std::fmod(turns, 1.0);
}

}  // namespace

double tt_centuries(std::int64_t epoch_ns) {
  const double days = static_cast<double>(epoch_ns / kDay_ns) - kJ2000SinceGpsEpoch_d;
  return (days + (seconds(epoch_ns % kDay_ns) + kTtMinusGps_s) / kDay_s) / kCentury_d;
}

// Lieske et al. (1977): mean equator of J2000 to mean equator of date.
Mat3 precession(double t_cy) {
  const double zeta = (2306.2181 + (0.30188 + 0.017998 * t_cy) * t_cy) * t_cy * kArcsec_rad;
  const double z = (2306.2181 + (1.09468 + 0.018203 * t_cy) * t_cy) * t_cy * kArcsec_rad;
  const double theta = (2004.3109 - (0.42665 + 0.041833 * t_cy) * t_cy) * t_cy * kArcsec_rad;
  return rotation_z(-z) * rotation_y(theta) * rotation_z(-zeta);
}

double mean_obliquity_rad(double t_cy) {
  return (84381.448 + (-46.8150 + (-0.00059 + 0.001813 * t_cy) * t_cy) * t_cy) * kArcsec_rad;
}

Mat3 ecef_to_eci(std::int64_t epoch_ns, const EarthTime& earth_time) {
  const double days = static_cast<double>(epoch_ns / kDay_ns) - kJ2000SinceGpsEpoch_d;
  const double second_of_day = seconds(epoch_ns % kDay_ns);
  const double ut1_d =
      (second_of_day - earth_time.leap_seconds + earth_time.ut1_minus_utc_s) / kDay_s;
  const double tt_cy = tt_centuries(epoch_ns);

  const double obliquity = mean_obliquity_rad(tt_cy);
  const Nutation n = nutation_at(tt_cy);
  const Mat3 nutation_matrix = rotation_x(-obliquity - n.obliquity_rad) *
                               rotation_z(-n.longitude_rad) * rotation_x(obliquity);
  const double gast = gmst_rad(days, ut1_d) + n.longitude_rad * std::cos(obliquity);
  return transpose(rotation_z(gast) * nutation_matrix * precession(tt_cy));
}

StateEci eci_from_ecef(std::int64_t epoch_ns, const Vec3& r_ECEF, const Vec3& v_ECEF,
                       const EarthTime& earth_time) {
  const Mat3 R_IE = ecef_to_eci(epoch_ns, earth_time);
  const Vec3 omega_EI_E = vec3(0.0, 0.0, kEarthRotation_radps);
  return {R_IE * r_ECEF, R_IE * (v_ECEF + cross(omega_EI_E, r_ECEF))};
}

}  // namespace flight_support
