#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/frames/interval_cache.hpp>
#include <orrery/models/frames/time_scales.hpp>

#include <erfa.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace orrery {
namespace {

constexpr double kTwoPi = 6.283185307179586476925287;
constexpr double kDay_s = 86400;
// Rate of GMST, IAU 1982 (Aoki et al., A&A 105, 1982).
constexpr double kGmstRate_radps = 1.002737909350795 * kTwoPi / kDay_s;

Mat3 to_mat3(const double (&m)[3][3]) {
  return {{m[0][0], m[0][1], m[0][2]}, {m[1][0], m[1][1], m[1][2]}, {m[2][0], m[2][1], m[2][2]}};
}

Mat3 precession_nutation(SimTime t, double dpsi_rad = 0, double deps_rad = 0) {
  const JulianDate tt = gps_to_tt(t);
  double dpsi = 0, deps = 0, P[3][3], N[3][3], NP[3][3];
  eraNut80(tt.day, tt.fraction, &dpsi, &deps);
  eraNumat(eraObl80(tt.day, tt.fraction), dpsi + dpsi_rad, deps + deps_rad, N);
  eraPmat76(tt.day, tt.fraction, P);
  eraRxr(N, P, NP);
  return to_mat3(NP);
}

// UT1 = TAI - leap_seconds + ut1_minus_utc_s.
double gast_rad(SimTime t, int leap_seconds, double ut1_minus_utc_s = 0) {
  JulianDate ut1 = gps_to_tt(t - 32184ms - leap_seconds * 1s);
  ut1.fraction += ut1_minus_utc_s / kDay_s;
  const JulianDate tt = gps_to_tt(t);
  return eraGmst82(ut1.day, ut1.fraction) + eraEqeq94(tt.day, tt.fraction);
}

double mean_obliquity_rad(SimTime t) {
  const JulianDate tt = gps_to_tt(t);
  return eraObl80(tt.day, tt.fraction);
}

double nutation_in_obliquity_rad(SimTime t) {
  const JulianDate tt = gps_to_tt(t);
  double dpsi = 0, deps = 0;
  eraNut80(tt.day, tt.fraction, &dpsi, &deps);
  return deps;
}

double nearest_turn(double angle_rad) {
  return std::remainder(angle_rad, kTwoPi);
}

// The table's own cubics over a piece of an interval in which there is no row, by time.
struct Orientation {
  SimTime from, to;
  Cubic ut1_minus_tai_s, x_pole_rad, y_pole_rad, dpsi_rad, deps_rad;

  double place(SimTime t) const {
    return 3 * static_cast<double>((t - from).count()) / static_cast<double>((to - from).count()) -
           1;
  }
  double per_second(double slope) const { return slope * 3 / to_seconds(to - from); }
};

Orientation orientation_around(const EarthOrientationTable& table, SimTime t, SimTime begin,
                               SimTime end) {
  const EarthOrientationTable::Span span = table.rows_around(t);
  SimTime from = std::max(span.from, begin), to = std::min(span.to, end);
  if (to - from < 1s) from = span.from, to = span.to;
  std::array<EarthOrientationParameters, 4> p;
  std::array<double, 4> ut1_minus_tai_s;
  for (int k = 0; k < 4; ++k) {
    const SimTime knot = k == 3 ? to : from + k * ((to - from) / 3);
    p[k] = table.at(knot);
    ut1_minus_tai_s[k] = p[k].ut1_minus_utc_s - leap_seconds(knot);
  }
  const auto through = [&](double EarthOrientationParameters::*q) {
    return Cubic::through(p[0].*q, p[1].*q, p[2].*q, p[3].*q);
  };
  using E = EarthOrientationParameters;
  return {from,
          to,
          Cubic::through(ut1_minus_tai_s[0], ut1_minus_tai_s[1], ut1_minus_tai_s[2],
                         ut1_minus_tai_s[3]),
          through(&E::x_pole_rad),
          through(&E::y_pole_rad),
          through(&E::dpsi_rad),
          through(&E::deps_rad)};
}

// Nutation changed by dPsi, dEps, without the turn about the pole, dPsi times the cosine of the
// true obliquity: the equation of the equinoxes takes it back, but for the mean obliquity that it
// has.
Mat3 with_pole_offset(const Mat3& NP, double dpsi_sin_eps, double deps) {
  return {NP.row_x - dpsi_sin_eps * NP.row_z, NP.row_y - deps * NP.row_z,
          NP.row_z + dpsi_sin_eps * NP.row_x + deps * NP.row_y};
}

// R1(-yp) R2(-xp), as eraPom00 has it, for angles whose fourth power does not count.
Mat3 polar_motion(double xp, double yp) {
  const double sx = xp - xp * xp * xp / 6, cx = 1 - xp * xp / 2;
  const double sy = yp - yp * yp * yp / 6, cy = 1 - yp * yp / 2;
  return {{cx, 0, sx}, {sy * sx, cy, -sy * cx}, {-cy * sx, sy, cy * cx}};
}

}  // namespace

struct EarthOrientation::Interval {
  int leap_seconds = 0;  // at its begin
  bool leap_second_inside = false;
  double gast_rad = 0;            // at its begin, UT1 = UTC
  double sin_obliquity = 0;       // true
  double cos_mean_less_true = 0;  // of the mean obliquity less that of the true
  Cubic gast_residual;            // GAST - gast_rad - mean rate * (t - begin)
  CubicVec3 NP_x, NP_y, NP_z;
  // A row of the table may lie within: what holds before, and from its instant on.
  std::array<Orientation, 2> orientation;

  const Orientation& orientation_at(SimTime t) const {
    return orientation[t < orientation[1].from ? 0 : 1];
  }
};

struct EarthOrientation::Kept {
  IntervalCache<Interval> intervals;
};

EarthOrientation::EarthOrientation(EarthOrientationTable eop)
    : eop_(std::move(eop)), kept_(std::make_unique<Kept>()) {}

EarthOrientation::~EarthOrientation() = default;

Mat3 rotation_about_z(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {{c, s, 0}, {-s, c, 0}, {0, 0, 1}};
}

Mat3 EarthOrientation::exact_R_EI(SimTime t, const EarthOrientationParameters& eop) {
  const double gast = gast_rad(t, orrery::leap_seconds(t), eop.ut1_minus_utc_s) +
                      eop.dpsi_rad * std::cos(mean_obliquity_rad(t));
  double W[3][3];
  eraPom00(eop.x_pole_rad, eop.y_pole_rad, 0, W);
  return to_mat3(W) * (rotation_about_z(gast) * precession_nutation(t, eop.dpsi_rad, eop.deps_rad));
}

EarthOrientation::Interval EarthOrientation::make_interval(std::int64_t index) const {
  const SimTime begin = interval_begin(index), end = interval_begin(index + 1);
  Interval in;
  in.leap_seconds = orrery::leap_seconds(begin);
  in.leap_second_inside = orrery::leap_seconds(end) != in.leap_seconds;
  in.gast_rad = nearest_turn(gast_rad(begin, in.leap_seconds));
  const double mean = mean_obliquity_rad(begin),
               obliquity = mean + nutation_in_obliquity_rad(begin);
  in.sin_obliquity = std::sin(obliquity);
  in.cos_mean_less_true = std::cos(mean) - std::cos(obliquity);

  std::array<double, 4> residual{};
  std::array<Vec3, 4> row_x, row_y, row_z;
  for (int k = 0; k < 4; ++k) {
    const SimTime t = begin + k * kKnotSpacing;
    const Mat3 NP = precession_nutation(t);
    row_x[k] = NP.row_x, row_y[k] = NP.row_y, row_z[k] = NP.row_z;
    residual[k] = nearest_turn(gast_rad(t, in.leap_seconds) - in.gast_rad -
                               kGmstRate_radps * kKnotSpacing_s * k);
  }
  in.gast_residual = Cubic::through(residual[0], residual[1], residual[2], residual[3]);
  in.NP_x = CubicVec3::through(row_x);
  in.NP_y = CubicVec3::through(row_y);
  in.NP_z = CubicVec3::through(row_z);
  if (!eop_.is_none()) {
    in.orientation[0] = orientation_around(eop_, std::max(begin, eop_.first()), begin, end);
    in.orientation[1] = orientation_around(eop_, std::min(end, eop_.last()), begin, end);
  }
  return in;
}

EarthAttitude EarthOrientation::at(SimTime t) const {
  if (!eop_.is_none() && (t < eop_.first() || t > eop_.last())) (void)eop_.at(t);  // throws
  const std::int64_t index = interval_index(t);
  const double s = interval_place(index, t);
  const auto make = [this](std::int64_t i) { return make_interval(i); };
  return kept_->intervals.use(index, make, [&](const Interval& in) -> EarthAttitude {
    const Cubic& residual = in.gast_residual;
    double gast = in.gast_rad + kGmstRate_radps * kKnotSpacing_s * (s + 1) + residual.at(s);
    double rate = kGmstRate_radps + residual.slope(s) / kKnotSpacing_s;
    Mat3 NP{in.NP_x.at(s), in.NP_y.at(s), in.NP_z.at(s)};
    // dR/dt R^T = -[omega x]; precession and nutation contribute 1e-11 rad/s.
    Vec3 slow = Vec3{dot(in.NP_y.slope(s), NP.row_z), dot(in.NP_z.slope(s), NP.row_x),
                     dot(in.NP_x.slope(s), NP.row_y)} /
                kKnotSpacing_s;
    if (eop_.is_none()) {
      // UTC, and with it UT1, falls back by a second in mid-interval.
      if (in.leap_second_inside)
        gast -= kGmstRate_radps * (orrery::leap_seconds(t) - in.leap_seconds);
      const Mat3 spin = rotation_about_z(gast);
      return {spin * NP, spin * slow + Vec3{0, 0, rate}};
    }
    const Orientation& o = in.orientation_at(t);
    const double p = o.place(t);
    gast += kGmstRate_radps * (o.ut1_minus_tai_s.at(p) + in.leap_seconds) +
            o.dpsi_rad.at(p) * in.cos_mean_less_true;
    rate += kGmstRate_radps * o.per_second(o.ut1_minus_tai_s.slope(p));
    NP = with_pole_offset(NP, o.dpsi_rad.at(p) * in.sin_obliquity, o.deps_rad.at(p));
    slow += {-o.per_second(o.deps_rad.slope(p)),
             o.per_second(o.dpsi_rad.slope(p)) * in.sin_obliquity, 0};
    const Mat3 spin = rotation_about_z(gast);
    const Mat3 W = polar_motion(o.x_pole_rad.at(p), o.y_pole_rad.at(p));
    const Vec3 pole_rate{-o.per_second(o.y_pole_rad.slope(p)), -o.per_second(o.x_pole_rad.slope(p)),
                         0};
    return {W * (spin * NP), W * (spin * slow + Vec3{0, 0, rate}) + pole_rate};
  });
}

}  // namespace orrery
