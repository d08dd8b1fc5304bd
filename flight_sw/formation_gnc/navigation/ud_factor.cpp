#include "formation_gnc/navigation/ud_factor.hpp"

namespace formation_gnc {
namespace {

using ud_kernel::Weighted;

// __builtin_cpu_supports asks the operating system, too.
const ud_kernel::Loops& loops() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return ud_kernel::kAvx2;
#endif
  return ud_kernel::kPlain;
}

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
  for (int j = 0; j < kStates; ++j) set(j, j, 1.0);
}

Projection UdFactor::project(const SparseRow& h) const {
  Projection out;
  out.variance = loops().project(kStates, upper_, d_, {h.count, h.state, h.value}, out.f);
  return out;
}

void UdFactor::measure(const Projection& h, double r, double* gain) {
  const double inverse = loops().measure(kStates, upper_, d_, h.f, r, gain);
  for (int k = 0; k < kStates; ++k) gain[k] *= inverse;
}

void UdFactor::add(double w, const double* g, int last) {
  double x[kStates] = {};
  for (int j = 0; j <= last; ++j) x[j] = g[j];
  loops().add(upper_, d_, w, x, last);
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

void UdFactor::move_rows(int first, const OrbitTransition& transition, int column) {
  double x[kHalf], y[kHalf];
  for (int k = 0; k < kHalf; ++k) x[k] = u(first + k, column);
  apply(transition, x, y);
  for (int k = 0; k < kHalf; ++k) set(first + k, column, y[k]);
}

// A square root of the orbits' covariance: the difference's columns of U and of its noise first,
// then self's, so that the lower rows are zero in the second half.
void UdFactor::move_orbits(const OrbitTransition& self, const OrbitTransition& difference,
                           const OrbitNoise& self_noise, const OrbitNoise& difference_noise) {
  Weighted w = {};
  for (int c = 0; c < kOrbitStates; ++c) {
    const int column = kSelf + c;
    const int place = c < kHalf ? ud_kernel::kHalf + c : c - kHalf;
    double x[kOrbitStates] = {}, y[kOrbitStates];
    for (int k = 0; k <= c; ++k) x[k] = u(kSelf + k, column);
    apply(self, x, y);
    apply(difference, x + kHalf, y + kHalf);
    for (int k = 0; k < kOrbitStates; ++k) w.row[k][place] = y[k];
    w.weight[place] = d_[column];
  }
  for (int c = 0; c < kHalf; ++c) {
    const int lower = kHalf + c, upper = ud_kernel::kHalf + kHalf + c;
    for (int k = 0; k < kHalf; ++k) {
      w.row[kHalf + k][lower] = difference_noise.column[c][k];
      w.row[k][upper] = self_noise.column[c][k];
    }
    w.weight[lower] = difference_noise.weight[c];
    w.weight[upper] = self_noise.weight[c];
  }
  loops().refactor(upper_, d_, kSelf, &w);
  for (int column = kAmbiguitySelf; column < kStates; ++column) {
    move_rows(kSelf, self, column);
    move_rows(kDifference, difference, column);
  }
}

double UdFactor::covariance(int i, int j) const {
  double sum = 0.0;
  for (int k = i > j ? i : j; k < kStates; ++k) sum += u(i, k) * d_[k] * u(j, k);
  return sum;
}

}  // namespace formation_gnc
