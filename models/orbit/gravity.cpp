#include <orrery/models/orbit/gravity.hpp>

#include <cmath>
#include <cstring>
#include <stdexcept>

// Notation, after Pines with normalised coefficients. With u = z/r, rho = R/r and
//   A_nm(u) = d^m P_n/du^m, normalised, = s_nm p_nm(u), p_nm monic of degree n - m,
// the potential is U = mu/r sum_n rho^n sum_m A_nm (C_nm r_m + S_nm i_m), r_m + i i_m = ((x +
// iy)/r)^m. The recursion runs in b_nm = rho^(n-m) p_nm: b_mm = 1 and
//   b_nm = (rho u) b_(n-1)m - gamma_nm rho^2 b_(n-2)m,  gamma_nm = ((n-1)^2 - m^2)/((2n-1)(2n-3)),
// so powers of rho need no array of their own, and dA_nm/du = (n - m) s_nm p_n(m+1) turns
// derivatives into values of the next order.

namespace orrery {
namespace {

// Two doubles: what every 64-bit processor has. Both compilers take wider vectors apart badly.
using Pair = double __attribute__((vector_size(16)));

// Four orders. No lane ever meets another.
struct Four {
  Pair low{}, high{};

  void operator+=(const Four& b) { low += b.low, high += b.high; }
  friend Four operator*(const Four& a, const Four& b) { return {a.low * b.low, a.high * b.high}; }
  friend Four operator*(double a, const Four& b) { return {a * b.low, a * b.high}; }
  friend Four operator-(const Four& a, const Four& b) { return {a.low - b.low, a.high - b.high}; }
  double operator[](int lane) const { return lane < 2 ? low[lane] : high[lane - 2]; }
};

Four load(const std::array<double, 4>& lanes) {
  Four v;
  std::memcpy(&v.low, &lanes[0], sizeof v.low);
  std::memcpy(&v.high, &lanes[2], sizeof v.high);
  return v;
}

constexpr std::array<std::array<double, 4>, 4> kUnit = {
    {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};

// s_nm: leading coefficient of the normalised A_nm, row-major triangle. Long double, rounded once.
std::vector<double> leading_coefficients(int degree) {
  std::vector<double> s;
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
    for (const long double value : current) s.push_back(static_cast<double>(value));
    previous.swap(current);
  }
  return s;
}

double recursion_factor(int n, int m) {
  if (n < m + 2) return 0;
  return (static_cast<double>(n - 1) * (n - 1) - static_cast<double>(m) * m) /
         (static_cast<double>(2 * n - 1) * (2 * n - 3));
}

}  // namespace

// Sums over the degree, per order. below: of order m - 1 over b of order m.
struct HarmonicGravity::OrderSums {
  Four C, S, nC, nS, C_below, S_below;
};

HarmonicGravity::HarmonicGravity(const GravityField& field, int degree)
    : degree_(degree), mu_m3ps2_(field.mu_m3ps2()), radius_m_(field.radius_m()) {
  if (degree < 2 || degree > field.degree()) {
    throw std::out_of_range("HarmonicGravity: degree = " + std::to_string(degree) +
                            "; accepted: 2 to " + std::to_string(field.degree()) + " (" +
                            field.name() + ")");
  }
  const std::vector<double> scale = leading_coefficients(degree);
  for (int block = 0; block * kLanes <= degree; ++block) {
    block_start_.push_back(rows_.size());
    for (int n = block * kLanes; n <= degree; ++n) {
      rows_.emplace_back();
      fill_row(field, scale, n, block, rows_.back());
    }
  }
}

void HarmonicGravity::fill_row(const GravityField& field, const std::vector<double>& scale, int n,
                               int block, Row& row) const {
  row = Row{};
  for (int lane = 0; lane < kLanes; ++lane) {
    const int m = block * kLanes + lane;
    row.gamma[lane] = recursion_factor(n, m);
    if (n < 2) continue;  // degree 0 is the central term, degree 1 is zero
    const double* scale_n = &scale[static_cast<std::size_t>(n * (n + 1) / 2)];
    if (m <= n) {
      row.C[lane] = scale_n[m] * field.C(n, m);
      row.S[lane] = scale_n[m] * field.S(n, m);
    }
    if (m >= 1 && m <= n) {
      row.C_below[lane] = (n - m + 1) * scale_n[m - 1] * field.C(n, m - 1);
      row.S_below[lane] = (n - m + 1) * scale_n[m - 1] * field.S(n, m - 1);
    }
  }
}

void HarmonicGravity::sum_order_block(int block, double z, double rho2, OrderSums* sums) const {
  const int first = block * kLanes;
  const Row* row = &rows_[block_start_[block]];
  Four b, b1, b2;  // of degree n, n - 1, n - 2; zero below the order
  OrderSums sum;
  for (int n = first; n <= degree_; ++n, ++row) {
    b = z * b1 - load(row->gamma) * (rho2 * b2);
    if (n < first + kLanes) b += load(kUnit[n - first]);  // b_mm = 1
    const Four C = load(row->C) * b, S = load(row->S) * b;
    sum.C += C;
    sum.S += S;
    sum.nC += static_cast<double>(n) * C;
    sum.nS += static_cast<double>(n) * S;
    sum.C_below += load(row->C_below) * b;
    sum.S_below += load(row->S_below) * b;
    b2 = b1;
    b1 = b;
  }
  *sums = sum;
}

Vec3 HarmonicGravity::perturbation_ECEF(const Vec3& r_ECEF) const {
  const double r = checked_radius(r_ECEF);
  const double rho = radius_m_ / r;
  const Vec3 direction = r_ECEF / r;
  const double x = rho * direction.x, y = rho * direction.y;

  double along_x = 0, along_y = 0, along_z = 0, radial = 0;  // Pines' a1 ... a4, without mu/r^2
  double re = 1, im = 0;                                     // (x + iy)^m
  double re_below = 0, im_below = 0;                         // (x + iy)^(m - 1)
  OrderSums sums;
  for (int m = 0; m <= degree_; ++m) {
    const int lane = m % kLanes;
    if (lane == 0) sum_order_block(m / kLanes, rho * direction.z, rho * rho, &sums);
    const double X = sums.C[lane], Y = sums.S[lane];
    along_x += m * (X * re_below + Y * im_below);
    along_y += m * (Y * re_below - X * im_below);
    along_z += sums.C_below[lane] * re_below + sums.S_below[lane] * im_below;
    radial += (sums.nC[lane] + (m + 1) * X) * re + (sums.nS[lane] + (m + 1) * Y) * im;
    re_below = re;
    im_below = im;
    re = x * re_below - y * im_below;
    im = x * im_below + y * re_below;
  }
  radial += rho * along_z * direction.z;
  const double scale = mu_m3ps2_ / (r * r);
  return scale * (rho * Vec3{along_x, along_y, along_z} - radial * direction);
}

Vec3 HarmonicGravity::acceleration_ECEF(const Vec3& r_ECEF) const {
  const Vec3 perturbation = perturbation_ECEF(r_ECEF);
  const double r2 = dot(r_ECEF, r_ECEF);
  return perturbation - mu_m3ps2_ / (r2 * std::sqrt(r2)) * r_ECEF;
}

double HarmonicGravity::checked_radius(const Vec3& r_ECEF) const {
  const double r = norm(r_ECEF);
  if (!(r >= radius_m_) || !std::isfinite(r)) {  // also catches NaN
    throw std::domain_error("HarmonicGravity: |r_ECEF| = " + std::to_string(r) +
                            " m; accepted: finite and at least the reference radius, " +
                            std::to_string(radius_m_) + " m");
  }
  return r;
}

}  // namespace orrery
