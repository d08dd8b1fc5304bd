#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/frames/time_scales.hpp>

#include <erfa.h>

#include <cmath>

namespace orrery {
namespace {

constexpr Duration kInterval = 3h;
constexpr double kInterval_s = 10800;
constexpr double kTwoPi = 6.283185307179586476925287;
// Rate of GMST, IAU 1982 (Aoki et al., A&A 105, 1982).
constexpr double kGmstRate_radps = 1.002737909350795 * kTwoPi / 86400;

SimTime begin_of(std::int64_t index) {
  return SimTime(index * kInterval);
}

std::int64_t interval_index(SimTime t) {
  const std::int64_t ns = to_ns(t), width = to_ns(kInterval);
  return ns / width - (ns % width < 0 ? 1 : 0);
}

Mat3 precession_nutation(SimTime t) {
  const JulianDate tt = gps_to_tt(t);
  double m[3][3];
  eraPnm80(tt.day, tt.fraction, m);
  return {{m[0][0], m[0][1], m[0][2]}, {m[1][0], m[1][1], m[1][2]}, {m[2][0], m[2][1], m[2][2]}};
}

double gast_rad(SimTime t, int leap_seconds) {
  JulianDate ut1 = gps_to_tt(t - 32184ms - leap_seconds * 1s);  // UT1 = UTC = TT - 32.184 s - leap
  const JulianDate tt = gps_to_tt(t);
  return eraGmst82(ut1.day, ut1.fraction) + eraEqeq94(tt.day, tt.fraction);
}

double nearest_turn(double angle_rad) {
  return std::remainder(angle_rad, kTwoPi);
}

}  // namespace

Mat3 rotation_about_z(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {{c, s, 0}, {-s, c, 0}, {0, 0, 1}};
}

Mat3 EarthOrientation::exact_R_EI(SimTime t) {
  return rotation_about_z(gast_rad(t, orrery::leap_seconds(t))) * precession_nutation(t);
}

EarthOrientation::Cubic EarthOrientation::through(double a, double b, double c, double d) {
  return {b, c - a / 3 - b / 2 - d / 6, (a + c) / 2 - b, (d - a) / 6 + (b - c) / 2};
}

EarthOrientation::Interval EarthOrientation::make_interval(std::int64_t index) {
  Interval in;
  in.index = index;
  in.valid = true;
  in.leap_seconds = orrery::leap_seconds(begin_of(index));
  in.leap_second_inside = orrery::leap_seconds(begin_of(index + 1)) != in.leap_seconds;
  in.gast_rad = nearest_turn(gast_rad(begin_of(index), in.leap_seconds));

  std::array<double, 4> residual{};
  std::array<Mat3, 4> matrix;
  for (int k = 0; k < 4; ++k) {
    const SimTime t = begin_of(index - 1 + k);
    matrix[k] = precession_nutation(t);
    residual[k] = nearest_turn(gast_rad(t, in.leap_seconds) - in.gast_rad -
                               kGmstRate_radps * kInterval_s * (k - 1));
  }
  in.gast_residual = through(residual[0], residual[1], residual[2], residual[3]);
  const Vec3 Mat3::*rows[] = {&Mat3::row_x, &Mat3::row_y, &Mat3::row_z};
  for (int i = 0; i < 9; ++i) {
    const auto element = [&](int k) { return (matrix[k].*rows[i / 3])[i % 3]; };
    in.NP[i] = through(element(0), element(1), element(2), element(3));
  }
  return in;
}

EarthOrientation::Interval EarthOrientation::interval(std::int64_t index) const {
  const std::size_t slot = static_cast<std::size_t>(index & 3);
  {
    const std::lock_guard lock(mutex_);
    if (kept_[slot].valid && kept_[slot].index == index) return kept_[slot];
  }
  const Interval made = make_interval(index);
  const std::lock_guard lock(mutex_);
  return kept_[slot] = made;
}

double EarthOrientation::gast(const Interval& in, SimTime t, double tau, double* rate) {
  const Cubic& q = in.gast_residual;
  *rate = kGmstRate_radps + (q.c1 + tau * (2 * q.c2 + tau * 3 * q.c3)) / kInterval_s;
  double angle = in.gast_rad + kGmstRate_radps * kInterval_s * tau +
                 (q.c0 + tau * (q.c1 + tau * (q.c2 + tau * q.c3)));
  // UTC, and with it UT1, falls back by a second in mid-interval.
  if (in.leap_second_inside) angle -= kGmstRate_radps * (orrery::leap_seconds(t) - in.leap_seconds);
  return angle;
}

EarthAttitude EarthOrientation::at(SimTime t) const {
  const std::int64_t index = interval_index(t);
  const Interval in = interval(index);
  const double tau = 1e-9 * static_cast<double>((t - begin_of(index)).count()) / kInterval_s;

  std::array<double, 9> m, rate;
  for (std::size_t i = 0; i < 9; ++i) {
    const Cubic& q = in.NP[i];
    m[i] = q.c0 + tau * (q.c1 + tau * (q.c2 + tau * q.c3));
    rate[i] = (q.c1 + tau * (2 * q.c2 + tau * 3 * q.c3)) / kInterval_s;
  }
  const Mat3 NP{{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}};
  const Mat3 NP_rate{
      {rate[0], rate[1], rate[2]}, {rate[3], rate[4], rate[5]}, {rate[6], rate[7], rate[8]}};

  double gast_rate = 0;
  const Mat3 spin = rotation_about_z(gast(in, t, tau, &gast_rate));
  // dR/dt R^T = -[omega x]; precession and nutation contribute 1e-11 rad/s.
  const Vec3 slow{dot(NP_rate.row_y, NP.row_z), dot(NP_rate.row_z, NP.row_x),
                  dot(NP_rate.row_x, NP.row_y)};
  return {spin * NP, spin * slow + Vec3{0, 0, gast_rate}};
}

}  // namespace orrery
