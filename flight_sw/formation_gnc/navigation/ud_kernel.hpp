/// The loops of UdFactor, compiled once for each width of vector register; not for users.
///
/// Storage     Four columns of U a block, all as long as its last: 4 (a + 1) rows in block a. Below
///             the diagonal stand zeros and on it ones, so that no loop needs to know where it is.
/// Bits        Element by element the same operations in the same order for any width, sums in four
///             lanes: all paths give the same.
#pragma once

namespace formation_gnc {
namespace ud_kernel {

// Static: no symbol may be shared between sources compiled for different processors.
static constexpr int kLanes = 4;  // rows side by side, and columns of a block
static constexpr int kRows = 18;  // of a weighted factor: those of both orbits
static constexpr int kUpper = 9;  // of them, which use all of its columns
static constexpr int kWide = 40;  // columns of a weighted factor,
static constexpr int kHalf = 20;  // and those that the lower rows use
// Rounding cannot bring a weight below zero, but can to zero; a floor far below any variance here.
static constexpr double kLeastWeight = 1e-40;

static constexpr int rows(int column) {
  return kLanes * (column / kLanes + 1);
}
/// Of a column's first row.
static constexpr int offset(int column) {
  return rows(column) * (2 * (column / kLanes) + column % kLanes);
}

/// A row of a measurement matrix: `count` >= 1 values, states ascending.
struct Row {
  int count;
  const int* state;
  const double* value;
};

/// A square root by rows whose weighted squares are a covariance. Rows from kUpper on are zero from
/// kHalf on.
struct Weighted {
  double row[kRows][kWide], weight[kWide];
};

/// Of a factor of `states` rows, a multiple of kLanes.
struct Loops {
  /// f = U^T h. @return h^T P h.
  double (*project)(int states, const double* U, const double* D, const Row& h, double* f);
  /// Bierman's update with the gain in b, still to be scaled. @return the reciprocal of the
  /// innovation's variance, which scales it.
  double (*measure)(int states, double* U, double* D, const double* f, double r, double* b);
  /// Agee and Turner's P += w x x^T, x zero behind `last`, which it uses up.
  void (*add)(double* U, double* D, double w, double* x, int last);
  /// Modified weighted Gram-Schmidt, from the last row up: U(first + j, first + k) and D(first + k)
  /// of the rows j < k.
  void (*refactor)(double* U, double* D, int first, Weighted* w);
};

extern const Loops kPlain;
#if defined(__x86_64__)
extern const Loops kAvx2;
#endif

}  // namespace ud_kernel
}  // namespace formation_gnc
