#include "formation_gnc/navigation/ud_factor.hpp"

namespace formation_gnc {
namespace {

// Rounding cannot bring a weight below zero, but can to zero; a floor far below any variance here.
constexpr double kLeastWeight = 1e-40;

constexpr int kSelf = kPositionSelf, kDifference = kPositionDifference;
constexpr int kHalf = 9;  // states of one orbit

void apply(const flight_support::Mat3& A, const double* x, double* y) {
  for (int r = 0; r < 3; ++r) y[r] += A(r, 0) * x[0] + A(r, 1) * x[1] + A(r, 2) * x[2];
}

// y = Phi x of one orbit.
void apply(const OrbitTransition& t, const double x[kHalf], double y[kHalf]) {
  for (int k = 0; k < 6; ++k) y[k] = 0.0;
  apply(t.rr, x, y);
  apply(t.rv, x + 3, y);
  apply(t.ra, x + 6, y);
  apply(t.vr, x, y + 3);
  apply(t.vv, x + 3, y + 3);
  apply(t.va, x + 6, y + 3);
  for (int k = 6; k < 9; ++k) y[k] = t.aa[k - 6] * x[k];
}

}  // namespace

UdFactor::UdFactor() {
  for (double& d : d_) d = 1.0;
}

Projection UdFactor::project(const SparseRow& h) const {
  // By pairs: where h is not zero, in ascending order.
  Pair part[SparseRow::kMost];
  int place[SparseRow::kMost], count = 0;
  Projection out;
  for (double& f : out.f) f = 0.0;
  for (int k = 0; k < h.count; ++k) {
    const int p = h.state[k] / 2;
    if (count == 0 || place[count - 1] != p) {
      part[count] = Pair{0.0, 0.0};
      place[count++] = p;
    }
    part[count - 1][h.state[k] % 2] = h.value[k];
    out.f[h.state[k]] = h.value[k];
  }
  // An even column and the odd one behind it, which has one pair more.
  int above = 0;  // parts above the diagonal of both
  for (int j = 2 * place[0]; j < kStates; j += 2) {
    const Pair *even = upper_ + offset(j), *odd = upper_ + offset(j + 1);
    Pair sum0 = {0.0, 0.0}, sum1 = {0.0, 0.0};
    for (int k = 0; k < above; ++k) {
      sum0 += part[k] * even[place[k]];
      sum1 += part[k] * odd[place[k]];
    }
    if (above < count && place[above] == j / 2) {
      sum1 += part[above] * odd[j / 2];
      ++above;
    }
    out.f[j] += sum0[0] + sum0[1];
    out.f[j + 1] += sum1[0] + sum1[1];
    out.variance += out.f[j] * out.f[j] * d_[j];
    out.variance += out.f[j + 1] * out.f[j + 1] * d_[j + 1];
  }
  return out;
}

namespace {

// The inner loop of Bierman's update for two columns: each number goes through his operations in
// their order.
struct Columns {
  Pair lambda0, lambda1, v0, v1;

  void at(Pair* even, Pair* odd, Pair* b) const {
    const Pair u0 = *even, u1 = *odd, b0 = *b, b1 = b0 + v0 * u0;
    *even = u0 + lambda0 * b0;
    *odd = u1 + lambda1 * b1;
    *b = b1 + v1 * u1;
  }
};

}  // namespace

// Two columns at a time, an even one and the odd one behind it, which saves a third of the memory
// traffic.
void UdFactor::measure(const Projection& h, double r, double* gain) {
  Pair b[kStates / 2];
  double alpha = r, inverse = 1.0 / r;
  for (int j = 0; j < kStates; j += 2) {
    const double v0 = d_[j] * h.f[j], v1 = d_[j + 1] * h.f[j + 1];
    const double middle = alpha + h.f[j] * v0, middle_inverse = 1.0 / middle;
    const double lambda0 = -h.f[j] * inverse, lambda1 = -h.f[j + 1] * middle_inverse;
    d_[j] *= alpha * middle_inverse;
    alpha = middle + h.f[j + 1] * v1;
    inverse = 1.0 / alpha;
    d_[j + 1] *= middle * inverse;
    Pair *even = upper_ + offset(j), *odd = even + j / 2;
    const Columns columns = {{lambda0, lambda0}, {lambda1, lambda1}, {v0, v0}, {v1, v1}};
    int p = 0;
    for (; p + 1 < j / 2; p += 2) {
      columns.at(even + p, odd + p, b + p);
      columns.at(even + p + 1, odd + p + 1, b + p + 1);
    }
    if (p < j / 2) columns.at(even + p, odd + p, b + p);
    // The odd column's last element stands beside the even one's diagonal.
    const double u = odd[j / 2][0];
    odd[j / 2][0] = u + lambda1 * v0;
    b[j / 2] = Pair{v0 + v1 * u, v1};
  }
  for (int p = 0; p < kStates / 2; ++p) {
    const Pair k = inverse * b[p];
    gain[2 * p] = k[0];
    gain[2 * p + 1] = k[1];
  }
}

void UdFactor::add(double w, const double* g, int last) {
  Pair x[kStates / 2] = {};
  for (int j = 0; j <= last; ++j) x[j / 2][j % 2] = g[j];
  for (int j = last; j >= 0 && w > 0.0; --j) {
    const double s = x[j / 2][j % 2];
    if (s == 0.0) continue;
    const double d = d_[j] + w * s * s;
    const double share = w * s / d;
    w *= d_[j] / d;
    d_[j] = d;
    x[j / 2][j % 2] = 0.0;  // done with, and zero in the odd column's last pair
    Pair* column = upper_ + offset(j);
    for (int p = 0; p < pairs(j); ++p) {
      x[p] -= s * column[p];
      column[p] += share * x[p];
    }
  }
}

void UdFactor::forget(int state, double variance) {
  double column[kStates];
  for (int i = 0; i < state; ++i) {
    column[i] = u(i, state);
    set(i, state, 0.0);
  }
  for (int j = state + 1; j < kStates; ++j) set(state, j, 0.0);
  if (state > 0) add(d_[state], column, state - 1);
  d_[state] = variance;
}

/// Rows whose weighted squares are the covariance of the orbits: the difference's columns of U and
/// of its noise first, then self's, so that the lower rows are zero in the second half.
struct UdFactor::Weighted {
  static constexpr int kPairs = 18, kLowerPairs = 9;
  Pair row[kOrbitStates][kPairs] = {};
  Pair weight[kPairs];

  void set(int r, int c, double value) { row[r][c / 2][c % 2] = value; }
};

void UdFactor::move_rows(int first, const OrbitTransition& transition, int column) {
  double x[kHalf], y[kHalf];
  for (int k = 0; k < kHalf; ++k) x[k] = u(first + k, column);
  apply(transition, x, y);
  for (int k = 0; k < kHalf; ++k) set(first + k, column, y[k]);
}

void UdFactor::move_orbits(const OrbitTransition& self, const OrbitTransition& difference,
                           const OrbitNoise& self_noise, const OrbitNoise& difference_noise) {
  Weighted w;
  for (int c = 0; c < kOrbitStates; ++c) {
    const int column = kSelf + c;
    const int place = c < kHalf ? kOrbitStates + c : c - kHalf;
    double x[kOrbitStates] = {}, y[kOrbitStates];
    for (int k = 0; k <= c; ++k) x[k] = u(kSelf + k, column);
    apply(self, x, y);
    apply(difference, x + kHalf, y + kHalf);
    for (int k = 0; k < kOrbitStates; ++k) w.set(k, place, y[k]);
    w.weight[place / 2][place % 2] = d_[column];
  }
  for (int c = 0; c < kHalf; ++c) {
    const int lower = kHalf + c, upper = kOrbitStates + kHalf + c;
    for (int k = 0; k < kHalf; ++k) {
      w.set(kHalf + k, lower, difference_noise.column[c][k]);
      w.set(k, upper, self_noise.column[c][k]);
    }
    w.weight[lower / 2][lower % 2] = difference_noise.weight[c];
    w.weight[upper / 2][upper % 2] = self_noise.weight[c];
  }
  refactor(&w);
  for (int column = kAmbiguitySelf; column < kStates; ++column) {
    move_rows(kSelf, self, column);
    move_rows(kDifference, difference, column);
  }
}

// Modified weighted Gram-Schmidt, from the last row up.
void UdFactor::refactor(Weighted* w) {
  Pair weighted[Weighted::kPairs];
  for (int k = kOrbitStates - 1; k >= 0; --k) {
    const int count = k >= kHalf ? Weighted::kLowerPairs : Weighted::kPairs;
    const Pair* row = w->row[k];
    Pair sum = {0.0, 0.0};
    for (int p = 0; p < count; ++p) {
      weighted[p] = w->weight[p] * row[p];
      sum += weighted[p] * row[p];
    }
    const double d = sum[0] + sum[1] > kLeastWeight ? sum[0] + sum[1] : kLeastWeight;
    d_[kSelf + k] = d;
    for (int j = 0; j < k; ++j) {
      Pair* other = w->row[j];
      Pair product = {0.0, 0.0};
      for (int p = 0; p < count; ++p) product += weighted[p] * other[p];
      const double u_jk = (product[0] + product[1]) / d;
      for (int p = 0; p < count; ++p) other[p] -= u_jk * row[p];
      set(kSelf + j, kSelf + k, u_jk);
    }
  }
}

double UdFactor::covariance(int i, int j) const {
  double sum = 0.0;
  for (int k = i > j ? i : j; k < kStates; ++k) sum += u(i, k) * d_[k] * u(j, k);
  return sum;
}

}  // namespace formation_gnc
