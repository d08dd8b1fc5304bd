#include <orrery/models/orbit/gravity.hpp>
#include <orrery/models/orbit/gravity_sums.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

// With u = z/r, rho = R/r, the normalised A_nm(u) = d^m P_n/du^m = s_nm p_nm(u), p_nm monic of
// degree n - m, and (X + iY) = rho (x + iy)/r, the potential is
//   U = mu/R rho sum_nm s_nm b_nm (C_nm Re + S_nm Im) (X + iY)^m,   b_nm = rho^(n-m) p_nm,
// and the recursion, with k = n - m and Z = rho u, is b_0 = 1, b_1 = Z,
//   b_k = Z b_(k-1) - gamma_k rho^2 b_(k-2),   gamma_k = (k-1)(2m+k-1) / ((2m+2k-1)(2m+2k-3)).
// Odd b_k are Z times f_k, which saves products. Cunningham's rules for the gradient need, in monic
// terms, the same factor 2n + 1 in all directions: with V + iW = rho b_(n+1) (X + iY)^m and
// T_nm = (2n+1) s_nm C_nm, the order m receives
//   R^2/mu (a_x, a_y, a_z): 1/2 V (T_n(m+1) - T_n(m-1)), -1/2 W (T_n(m+1) + T_n(m-1)), -V T_nm
// from the C and in the same way from the S, where T_n0 counts twice in order 1.

namespace orrery {
namespace {

using gravity_sums::kLanes;

// s_nm: leading coefficient of the normalised A_nm, row-major triangle.
std::vector<long double> leading_coefficients(int degree) {
  std::vector<long double> s;
  s.reserve(static_cast<std::size_t>((degree + 1) * (degree + 2) / 2));
  std::vector<long double> previous, current;
  long double sectoral = 1;
  for (int n = 0; n <= degree; ++n) {
    current.assign(static_cast<std::size_t>(n) + 1, 0);
    for (int m = 0; m < n; ++m) {
      const long double numerator = static_cast<long double>(2 * n + 1) * (2 * n - 1);
      const long double denominator = static_cast<long double>(n - m) * (n + m);
      current[m] = previous[m] * std::sqrt(numerator / denominator);
    }
    // The factor 2 - delta(0, m) enters once, from order 0 to order 1.
    if (n == 1) sectoral = std::sqrt(3.0L);
    if (n > 1) sectoral *= std::sqrt(static_cast<long double>(2 * n + 1) / (2 * n));
    current[n] = sectoral;
    s.insert(s.end(), current.begin(), current.end());
    previous.swap(current);
  }
  return s;
}

double recursion_factor(int k, int m) {
  return static_cast<double>(k - 1) * (2 * m + k - 1) /
         (static_cast<double>(2 * m + 2 * k - 1) * (2 * m + 2 * k - 3));
}

// __builtin_cpu_supports asks the operating system, too.
bool has(VectorPath path) {
#if defined(ORRERY_GRAVITY_AVX)
  if (path == VectorPath::kAvx2) return __builtin_cpu_supports("avx2") != 0;
  if (path == VectorPath::kAvx512) return __builtin_cpu_supports("avx512f") != 0;
#endif
  return path == VectorPath::kPlain;
}

void sum(VectorPath path, const gravity_sums::Series& series, gravity_sums::Point& point) {
#if defined(ORRERY_GRAVITY_AVX)
  if (path == VectorPath::kAvx512) return gravity_sums::sum_avx512(series, point);
  if (path == VectorPath::kAvx2) return gravity_sums::sum_avx2(series, point);
#endif
  (void)path;
  gravity_sums::sum_plain(series, point);
}

// (X + iY)^m for the first eight orders: each from the one at half its order.
void fill_powers(double X, double Y, gravity_sums::Point& point) {
  double re[kLanes + 1] = {1, X}, im[kLanes + 1] = {0, Y};
  for (int m = 2; m <= kLanes; ++m) {
    const int a = m / 2, b = m - a;
    re[m] = re[a] * re[b] - im[a] * im[b];
    im[m] = re[a] * im[b] + im[a] * re[b];
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    point.re[lane] = re[lane];
    point.im[lane] = im[lane];
    point.a_x[lane] = point.a_y[lane] = point.a_z[lane] = 0;
  }
  point.step_re = re[kLanes];
  point.step_im = im[kLanes];
}

gravity_sums::Point point_at(const Vec3& r_ECEF, double radius_m) {
  const double q = radius_m / dot(r_ECEF, r_ECEF);  // R/r^2
  gravity_sums::Point point;
  point.z = q * r_ECEF.z;
  point.rho2 = q * radius_m;
  fill_powers(q * r_ECEF.x, q * r_ECEF.y, point);
  return point;
}

double over_lanes(const double (&a)[kLanes]) {
  return ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]));
}

Vec3 gradient(const gravity_sums::Point& point, double mu_m3ps2, double radius_m) {
  const double scale = mu_m3ps2 / (radius_m * radius_m) * std::sqrt(point.rho2);
  return {0.5 * scale * over_lanes(point.a_x), 0.5 * scale * over_lanes(point.a_y),
          scale * over_lanes(point.a_z)};
}

}  // namespace

struct HarmonicGravity::Coefficients {
  std::vector<gravity_sums::RowPair> pairs;

  Coefficients(const GravityField& field, int degree);
  gravity_sums::Series series(int degree) const { return {degree, pairs.data()}; }
};

HarmonicGravity::Coefficients::Coefficients(const GravityField& field, int degree) {
  const std::vector<long double> scale = leading_coefficients(degree);
  const auto scaled = [&](double (GravityField::*coefficient)(int, int) const, int n, int m) {
    if (m < 0 || m > n || n < 2 || n > degree) return 0.0;  // the central term is not in the sums
    const auto index = static_cast<std::size_t>(n * (n + 1) / 2 + m);
    return static_cast<double>((2 * n + 1) * scale[index] * (field.*coefficient)(n, m));
  };
  for (int block = 0; block < gravity_sums::block_count({degree, nullptr}); ++block) {
    const int first = block * kLanes;
    for (int pair = 0; pair < gravity_sums::pairs_from({degree, nullptr}, first); ++pair) {
      gravity_sums::RowPair& row = pairs.emplace_back();
      for (int odd = 0; odd < 2; ++odd) {
        const int k = 2 * pair + odd;
        for (int lane = 0; lane < kLanes; ++lane)
          row.gamma[odd][lane] = recursion_factor(k + 2, first + lane);
        for (int i = 0; i < kLanes + 2; ++i) {
          const int m = first + i - 1;
          row.C[odd][i] = scaled(&GravityField::C, m + k, m);
          row.S[odd][i] = scaled(&GravityField::S, m + k, m);
        }
      }
    }
  }
}

std::string_view to_string(VectorPath path) {
  switch (path) {
    case VectorPath::kPlain:
      return "plain";
    case VectorPath::kAvx2:
      return "avx2";
    case VectorPath::kAvx512:
      return "avx512";
  }
  return "unknown";
}

std::vector<VectorPath> HarmonicGravity::available_paths() {
  std::vector<VectorPath> paths;
  for (const VectorPath path : {VectorPath::kPlain, VectorPath::kAvx2, VectorPath::kAvx512}) {
    if (has(path)) paths.push_back(path);
  }
  return paths;
}

HarmonicGravity::HarmonicGravity(const GravityField& field, int degree,
                                 std::optional<VectorPath> path)
    : degree_(degree),
      mu_m3ps2_(field.mu_m3ps2()),
      radius_m_(field.radius_m()),
      path_(path.value_or(available_paths().back())) {
  if (degree < 2 || degree > field.degree()) {
    throw std::out_of_range("HarmonicGravity: degree = " + std::to_string(degree) +
                            "; accepted: 2 to " + std::to_string(field.degree()) + " (" +
                            field.name() + ")");
  }
  if (!has(path_)) {
    throw std::invalid_argument("HarmonicGravity: path = " + std::string(to_string(path_)) +
                                "; this processor has none wider than " +
                                std::string(to_string(available_paths().back())));
  }
  coefficients_ = std::make_shared<const Coefficients>(field, degree);
}

Vec3 HarmonicGravity::sum_one(const Vec3& r_ECEF) const {
  gravity_sums::Point point = point_at(r_ECEF, radius_m_);
  sum(path_, coefficients_->series(degree_), point);
  return gradient(point, mu_m3ps2_, radius_m_);
}

void HarmonicGravity::sum_two(const Vec3* r_ECEF, Vec3* a_ECEF) const {
#if defined(ORRERY_GRAVITY_AVX)
  if (path_ == VectorPath::kAvx512) {
    gravity_sums::Point a = point_at(r_ECEF[0], radius_m_), b = point_at(r_ECEF[1], radius_m_);
    gravity_sums::sum_two_avx512(coefficients_->series(degree_), a, b);
    a_ECEF[0] = gradient(a, mu_m3ps2_, radius_m_);
    a_ECEF[1] = gradient(b, mu_m3ps2_, radius_m_);
    return;
  }
#endif
  // Sixteen registers hold the sums of one only.
  const Vec3 first = sum_one(r_ECEF[0]), second = sum_one(r_ECEF[1]);
  a_ECEF[0] = first;
  a_ECEF[1] = second;
}

Vec3 HarmonicGravity::perturbation_ECEF(const Vec3& r_ECEF) const {
  require_valid(r_ECEF);
  return sum_one(r_ECEF);
}

Vec3 HarmonicGravity::acceleration_ECEF(const Vec3& r_ECEF) const {
  return perturbation_ECEF(r_ECEF) + central(r_ECEF);
}

void HarmonicGravity::perturbations_ECEF(std::span<const Vec3> r_ECEF,
                                         std::span<Vec3> a_ECEF) const {
  if (r_ECEF.size() != a_ECEF.size()) {
    throw std::invalid_argument("HarmonicGravity: " + std::to_string(r_ECEF.size()) +
                                " positions but " + std::to_string(a_ECEF.size()) +
                                " accelerations; accepted: as many");
  }
  for (const Vec3& r : r_ECEF) require_valid(r);
  std::size_t i = 0;
  for (; i + 1 < r_ECEF.size(); i += 2) sum_two(&r_ECEF[i], &a_ECEF[i]);
  if (i < r_ECEF.size()) a_ECEF[i] = sum_one(r_ECEF[i]);
}

void HarmonicGravity::accelerations_ECEF(std::span<const Vec3> r_ECEF,
                                         std::span<Vec3> a_ECEF) const {
  perturbations_ECEF(r_ECEF, a_ECEF);
  for (std::size_t i = 0; i < r_ECEF.size(); ++i) a_ECEF[i] += central(r_ECEF[i]);
}

Vec3 HarmonicGravity::central(const Vec3& r_ECEF) const {
  const double r2 = dot(r_ECEF, r_ECEF);
  return -(mu_m3ps2_ / (r2 * std::sqrt(r2))) * r_ECEF;
}

void HarmonicGravity::require_valid(const Vec3& r_ECEF) const {
  const double r = norm(r_ECEF);
  if (!(r >= radius_m_) || !std::isfinite(r)) {  // also catches NaN
    throw std::domain_error("HarmonicGravity: |r_ECEF| = " + std::to_string(r) +
                            " m; accepted: finite and at least the reference radius, " +
                            std::to_string(radius_m_) + " m");
  }
}

}  // namespace orrery
