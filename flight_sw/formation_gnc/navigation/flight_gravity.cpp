#include "formation_gnc/navigation/flight_gravity.hpp"

#include "formation_gnc/navigation/pair.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

constexpr int kRows = kGravityDegree + 2;  // degrees 0 to kGravityDegree + 1

struct Row {
  int n, m;
  double c, s;
};
constexpr Row kTable[] = {
#include "ggm05s_d20.inc"
};

// Square root by Newton's method, for constants only.
constexpr double root(double x) {
  double y = x > 1.0 ? x : 1.0;
  for (int k = 0; k < 100; ++k) y = 0.5 * (y + x / y);
  return y;
}

/// What unnormalised coefficients and the recursion need, worked out by the compiler.
struct Coefficients {
  double c[kRows][kRows] = {}, s[kRows][kRows] = {};  // [m][n], unnormalised
  double first[kRows][kRows] = {};                    // [m][n] (2n-1)/(n-m)
  double second[kRows][kRows] = {};                   // [m][n] (n+m-1)/(n-m)
};

// sqrt((2 - d_m0)(2n + 1)(n - m)!/(n + m)!), below 1 and above 1e-23 here.
constexpr double normalisation(int n, int m) {
  double ratio = (m == 0 ? 1.0 : 2.0) * (2 * n + 1);
  for (int k = n - m + 1; k <= n + m; ++k) ratio /= k;
  // Newton's start at 1 is far from such small numbers: scale by an even power of ten.
  double scale = 1.0;
  while (ratio < 1.0) {
    ratio *= 100.0;
    scale /= 10.0;
  }
  return root(ratio) * scale;
}

constexpr Coefficients make_coefficients() {
  Coefficients k;
  k.c[0][0] = 1.0;
  for (const Row& row : kTable) {
    k.c[row.m][row.n] = normalisation(row.n, row.m) * row.c;
    k.s[row.m][row.n] = normalisation(row.n, row.m) * row.s;
  }
  for (int m = 0; m < kRows; ++m) {
    for (int n = m + 1; n < kRows; ++n) {
      k.first[m][n] = static_cast<double>(2 * n - 1) / (n - m);
      k.second[m][n] = static_cast<double>(n + m - 1) / (n - m);
    }
  }
  return k;
}
constexpr Coefficients kField = make_coefficients();

// The two points side by side.
struct Harmonics {
  Pair v[kRows][kRows], w[kRows][kRows];  // [m][n]
};

struct Place {
  Pair x0, y0, z0, rho, start;  // R x / r^2 and so on, R^2 / r^2, R / r
};

Place place_of(const flight_support::Vec3 r[2]) {
  constexpr double R = flight_support::kRadiusEarth_m;
  Place p;
  for (int k = 0; k < 2; ++k) {
    const double r2 = dot(r[k], r[k]);
    p.x0[k] = R * r[k][0] / r2;
    p.y0[k] = R * r[k][1] / r2;
    p.z0[k] = R * r[k][2] / r2;
    p.rho[k] = R * R / r2;
    p.start[k] = R / std::sqrt(r2);
  }
  return p;
}

// Of one order: all degrees from m to `last`, given the sectorial ones.
void fill_order(const Place& p, int m, int last, Pair* v, Pair* w) {
  if (m + 1 > last) return;
  v[m + 1] = kField.first[m][m + 1] * p.z0 * v[m];
  w[m + 1] = kField.first[m][m + 1] * p.z0 * w[m];
  for (int n = m + 2; n <= last; ++n) {
    const Pair a = kField.first[m][n] * p.z0, b = kField.second[m][n] * p.rho;
    v[n] = a * v[n - 1] - b * v[n - 2];
    w[n] = a * w[n - 1] - b * w[n - 2];
  }
}

void fill(const Place& p, int last, Harmonics* h) {
  h->v[0][0] = p.start;
  h->w[0][0] = Pair{0.0, 0.0};
  fill_order(p, 0, last, h->v[0], h->w[0]);
  for (int m = 1; m <= last; ++m) {
    const Pair v = h->v[m - 1][m - 1], w = h->w[m - 1][m - 1];
    h->v[m][m] = (2.0 * m - 1.0) * (p.x0 * v - p.y0 * w);
    h->w[m][m] = (2.0 * m - 1.0) * (p.x0 * w + p.y0 * v);
    fill_order(p, m, last, h->v[m], h->w[m]);
  }
}

struct Sums {
  Pair x = {0.0, 0.0}, y = {0.0, 0.0}, z = {0.0, 0.0};
};

void add_zonal(const Harmonics& h, int degree, Sums* sum) {
  for (int n = 0; n <= degree; ++n) {
    const double c = kField.c[0][n];
    sum->x -= c * h.v[1][n + 1];
    sum->y -= c * h.w[1][n + 1];
    sum->z -= (c * (n + 1)) * h.v[0][n + 1];
  }
}

void add_order(const Harmonics& h, int m, int degree, Sums* sum) {
  for (int n = m; n <= degree; ++n) {
    const double c = 0.5 * kField.c[m][n], s = 0.5 * kField.s[m][n];
    const double up = static_cast<double>((n - m + 1) * (n - m + 2));
    const Pair vp = h.v[m + 1][n + 1], wp = h.w[m + 1][n + 1];
    const Pair vm = up * h.v[m - 1][n + 1], wm = up * h.w[m - 1][n + 1];
    sum->x += c * (vm - vp) + s * (wm - wp);
    sum->y += s * (vp + vm) - c * (wp + wm);
    sum->z -= (2.0 * (n - m + 1)) * (c * h.v[m][n + 1] + s * h.w[m][n + 1]);
  }
}

}  // namespace

void gravity_ECEF(int degree, const flight_support::Vec3 r_ECEF[2],
                  flight_support::Vec3 a_ECEF[2]) {
  Harmonics h;
  fill(place_of(r_ECEF), degree + 1, &h);
  Sums sum;
  add_zonal(h, degree, &sum);
  for (int m = 1; m <= degree; ++m) add_order(h, m, degree, &sum);
  constexpr double scale = flight_support::kMuEarth_m3ps2 /
                           (flight_support::kRadiusEarth_m * flight_support::kRadiusEarth_m);
  for (int k = 0; k < 2; ++k) {
    a_ECEF[k] = flight_support::vec3(scale * sum.x[k], scale * sum.y[k], scale * sum.z[k]);
  }
}

}  // namespace formation_gnc
