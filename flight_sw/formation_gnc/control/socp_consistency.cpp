#include "formation_gnc/control/socp_consistency.hpp"

#include <cmath>

namespace formation_gnc {
namespace {

// Squares of lengths: a row whose distance from the others is below 1e-6 of its length depends on
// them. Rounding of the products leaves 1e-15.
constexpr double kDependent = 1e-12;
// Of a b of length 1 at most.
constexpr double kContradiction = 1e-7;

// A A'.
Eigen::MatrixXd gram(const Eigen::SparseMatrix<double>& A) {
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(A.rows(), A.rows());
  for (int j = 0; j < A.outerSize(); ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator a(A, j); a; ++a) {
      for (Eigen::SparseMatrix<double>::InnerIterator b(A, j); b; ++b) {
        M(a.row(), b.row()) += a.value() * b.value();
      }
    }
  }
  return M;
}

}  // namespace

// A A' = L D L' row by row, and L^-1 b along with it. Of a row r that depends on others d_r is
// zero, and y = L^-T e_r combines them to nothing: b'y = (L^-1 b)_r.
bool find_contradiction(const ConeProgram& program, Eigen::VectorXd* y) {
  const int p = static_cast<int>(program.b.size());
  Eigen::MatrixXd L = gram(program.A);
  Eigen::VectorXd d(p), beta = program.b;
  for (int r = 0; r < p; ++r) {
    const double length2 = L(r, r);
    d[r] = length2;
    for (int k = 0; k < r; ++k) {
      double sum = L(r, k);
      for (int j = 0; j < k; ++j) sum -= L(r, j) * L(k, j) * d[j];
      L(r, k) = d[k] > 0.0 ? sum / d[k] : 0.0;
      d[r] -= L(r, k) * L(r, k) * d[k];
      beta[r] -= L(r, k) * beta[k];
    }
    if (d[r] > kDependent * length2) continue;
    d[r] = 0.0;
    if (std::fabs(beta[r]) > kContradiction) {
      *y = Eigen::VectorXd::Zero(p);
      (*y)[r] = 1.0;
      for (int k = r - 1; k >= 0; --k) {
        for (int j = k + 1; j <= r; ++j) (*y)[k] -= L(j, k) * (*y)[j];
      }
      *y /= -beta[r];
      return true;
    }
    beta[r] = 0.0;
  }
  return false;
}

}  // namespace formation_gnc
