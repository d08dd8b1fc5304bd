/// The sums behind HarmonicGravity, compiled once for each width of vector register. Not installed.
#pragma once

namespace orrery::gravity_sums {

constexpr int kLanes = 8;  // orders side by side

/// Two rows, k = n - m even and k + 1, of eight orders m and their neighbours: [0] is the order
/// below the first lane, [9] the one above the last. gamma[i]: of the recursion to b_(k+2+i).
struct alignas(64) RowPair {
  double C[2][kLanes + 2], S[2][kLanes + 2];
  double gamma[2][kLanes];
};

/// Block after block of eight orders, 0 to degree + 1; in each, pairs_from(its first order) pairs.
struct Series {
  int degree;
  const RowPair* pairs;
};

// Static: no symbol may be shared between sources compiled for different processors.
/// Pairs of rows after which all coefficients are zero, for orders from `order` on.
static constexpr int pairs_from(const Series& series, int order) {
  return (series.degree + 3 - order) / 2;
}

static constexpr int block_count(const Series& series) {
  return (series.degree + 2 + kLanes - 1) / kLanes;
}

/// Where to sum, and the sums of each lane. re + i im = (x + iy)^m, for the first eight orders at
/// the beginning; step_re + i step_im is the eighth power.
struct Point {
  double z, rho2;
  double step_re, step_im;
  alignas(64) double re[kLanes], im[kLanes];
  alignas(64) double a_x[kLanes], a_y[kLanes], a_z[kLanes];
};

// Lane by lane the same operations in the same order, so the same bits.
void sum_plain(const Series& series, Point& point);
void sum_avx2(const Series& series, Point& point);
void sum_avx512(const Series& series, Point& point);
/// Loads each coefficient once for both.
void sum_two_avx512(const Series& series, Point& first, Point& second);

}  // namespace orrery::gravity_sums
