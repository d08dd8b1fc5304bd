/// Symmetric matrices: Cholesky factors and eigenvectors, sizes fixed, no allocation.
///
/// Method      Cholesky-Banachiewicz; cyclic Jacobi rotations (Golub & Van Loan, Matrix
///             Computations (2013), §4.2 and §8.5), in a fixed order, so that results do not depend
///             on anything but the input.
/// Accuracy    Backward stable; eigenvectors to 1e-15 over the relative gap of their eigenvalue.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/star_identification_test.cpp (eigenvectors),
///             test_suites/unit/flight_sw/rpo_kit/relative_orbit_filter_test.cpp (factors)
#pragma once

#include <cmath>

#include "support/matrix.hpp"

namespace flight_support {

/// Lower triangular L with L L^T = a; the upper half of `a` is not read.
/// @return false, L untouched, if `a` is not positive definite (a NaN is not).
template <int N>
bool cholesky(const Matrix<N, N>& a, Matrix<N, N>* L) {
  Matrix<N, N> l;
  for (int r = 0; r < N; ++r) {
    for (int c = 0; c <= r; ++c) {
      double sum = a(r, c);
      for (int k = 0; k < c; ++k) sum -= l(r, k) * l(c, k);
      if (r != c) {
        l(r, c) = sum / l(c, c);
      } else {
        // Written so that a NaN fails too.
        if (!(sum > 0.0)) return false;
        l(r, r) = std::sqrt(sum);
      }
    }
  }
  *L = l;
  return true;
}

/// b^T a^-1 b for positive definite `a`; infinite if it is not.
template <int N>
double squared_mahalanobis(const Matrix<N, N>& a, const Vector<N>& b) {
  Matrix<N, N> L;
  if (!cholesky(a, &L)) return INFINITY;
  double sum = 0.0;
  Vector<N> y;
  for (int r = 0; r < N; ++r) {
    double rest = b[r];
    for (int k = 0; k < r; ++k) rest -= L(r, k) * y[k];
    y[r] = rest / L(r, r);
    sum += y[r] * y[r];
  }
  return sum;
}

/// Eigenvalues in no order, eigenvectors as columns beside them: a = V diag(values) V^T.
template <int N>
struct SymmetricEigen {
  Vector<N> values;
  Matrix<N, N> vectors;

  int smallest() const {
    int at = 0;
    for (int k = 1; k < N; ++k) {
      if (values[k] < values[at]) at = k;
    }
    return at;
  }
  int largest() const {
    int at = 0;
    for (int k = 1; k < N; ++k) {
      if (values[k] > values[at]) at = k;
    }
    return at;
  }
  Vector<N> vector(int column) const {
    Vector<N> v;
    for (int k = 0; k < N; ++k) v[k] = vectors(k, column);
    return v;
  }
};

namespace symmetric_detail {

// Turns rows and columns p, q so that a(p, q) vanishes.
template <int N>
void rotate(Matrix<N, N>* a, Matrix<N, N>* V, int p, int q) {
  const double apq = (*a)(p, q);
  if (apq == 0.0) return;
  const double theta = ((*a)(q, q) - (*a)(p, p)) / (2.0 * apq);
  const double t = std::copysign(1.0, theta) / (std::fabs(theta) + std::sqrt(theta * theta + 1.0));
  const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c;
  for (int k = 0; k < N; ++k) {
    const double akp = (*a)(k, p), akq = (*a)(k, q);
    (*a)(k, p) = c * akp - s * akq;
    (*a)(k, q) = s * akp + c * akq;
  }
  for (int k = 0; k < N; ++k) {
    const double apk = (*a)(p, k), aqk = (*a)(q, k);
    (*a)(p, k) = c * apk - s * aqk;
    (*a)(q, k) = s * apk + c * aqk;
    const double vkp = (*V)(k, p), vkq = (*V)(k, q);
    (*V)(k, p) = c * vkp - s * vkq;
    (*V)(k, q) = s * vkp + c * vkq;
  }
}

}  // namespace symmetric_detail

/// Of a symmetric, finite matrix.
template <int N>
SymmetricEigen<N> eigen_symmetric(Matrix<N, N> a) {
  Matrix<N, N> V = identity<N>();
  // Convergence is quadratic: 6 to 8 sweeps reach rounding for N <= 12.
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0.0, all = 0.0;
    for (int r = 0; r < N; ++r) {
      for (int c = 0; c < N; ++c) {
        all += a(r, c) * a(r, c);
        if (r != c) off += a(r, c) * a(r, c);
      }
    }
    if (!(off > 1e-34 * all)) break;
    for (int p = 0; p < N; ++p) {
      for (int q = p + 1; q < N; ++q) symmetric_detail::rotate(&a, &V, p, q);
    }
  }
  SymmetricEigen<N> result;
  for (int k = 0; k < N; ++k) result.values[k] = a(k, k);
  result.vectors = V;
  return result;
}

}  // namespace flight_support
