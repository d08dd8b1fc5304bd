/// Covariance of the filter as P = U D U^T, U unit upper triangular, D positive: symmetric and
/// positive definite whatever rounding does.
///
/// Method      Measurements one scalar at a time (Bierman 1976), rank-one additions (Agee & Turner
///             1972), time update by modified weighted Gram-Schmidt (Thornton 1976) of the orbits
///             alone: clocks in front have been forgotten by then, and ambiguities behind are
///             constants, whose block does not change (Bierman 1977, ch. 7).
/// Cost        A scalar update 2 n^2 / 2 multiplications, n = 44; the time update that of 18
///             states. Four lanes side by side where the processor has AVX2, with the same bits.
/// Checked by  test_suites/unit/flight_sw/formation_gnc/ud_factor_test.cpp
#pragma once

#include "formation_gnc/navigation/state_order.hpp"
#include "formation_gnc/navigation/ud_kernel.hpp"
#include "support/matrix.hpp"

namespace formation_gnc {

/// A row of a measurement matrix that is mostly zeros; states in ascending order, at least one.
struct SparseRow {
  static constexpr int kMost = 12;
  int count = 0;
  int state[kMost] = {};
  double value[kMost] = {};

  void add(int s, double h) {
    state[count] = s;
    value[count] = h;
    ++count;
  }
};

/// Of one orbit over a time step: x' = Phi x for x = (r, v ECI, a RTN).
struct OrbitTransition {
  flight_support::Mat3 rr, rv, vr, vv;  ///< ECI
  flight_support::Mat3 ra, va;          ///< RTN to ECI, scaled
  flight_support::Vec3 aa;              ///< factor of each, by axis of RTN
};

/// Process noise of one orbit as nine weighted columns: three axes of RTN, three columns each.
struct OrbitNoise {
  double column[9][9];  ///< [column][state]
  double weight[9];
};

/// f = U^T h, which gating needs first and the update again.
struct Projection {
  double f[kStates];
  double variance = 0.0;  ///< h^T P h
};

class UdFactor {
 public:
  /// All states independent, of variance 1.
  UdFactor();

  Projection project(const SparseRow& h) const;
  /// Takes in z = h^T x + e, var(e) = r > 0. @return the gain K, so that x += K (z - h^T x).
  /// @param gain  kStates numbers.
  void measure(const Projection& h, double r, double* gain);
  /// P += w g g^T, w >= 0, for g that is zero behind state `last`.
  void add(double w, const double* g, int last);
  /// Forgets a state: independent of all others, with this variance > 0.
  void forget(int state, double variance);
  /// The orbits (self, difference) a step later. Clocks must have been forgotten.
  void move_orbits(const OrbitTransition& self, const OrbitTransition& difference,
                   const OrbitNoise& self_noise, const OrbitNoise& difference_noise);

  double covariance(int i, int j) const;
  double variance(int state) const { return covariance(state, state); }
  /// U(i, j), i <= j, and D(j).
  double u(int i, int j) const { return upper_[ud_kernel::offset(j) + i]; }
  double d(int j) const { return d_[j]; }

 private:
  static_assert(kStates % ud_kernel::kLanes == 0, "blocks of columns are whole");
  void set(int i, int j, double value) { upper_[ud_kernel::offset(j) + i] = value; }

  void move_rows(int first, const OrbitTransition& transition, int column);

  double upper_[ud_kernel::offset(kStates)] = {};
  double d_[kStates];
};

}  // namespace formation_gnc
