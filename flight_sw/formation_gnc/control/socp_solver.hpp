/// Second-order cone programs by a primal-dual interior-point method.
///
///     minimise c'x  subject to  A x = b,  G x + s = h,  s in K
///
/// K is the product of a nonnegative orthant (the first `orthant` rows of G) and of second-order
/// cones {(t, u): |u| <= t} (the rows that follow, in the order of `cones`).
///
/// Method      Homogeneous self-dual embedding, Nesterov-Todd scaling, Mehrotra's predictor and
///             corrector: Andersen, Roos & Terlaky (2003); Vandenberghe, The CVXOPT linear and
///             quadratic cone program solvers (2010); Domahidi, Chu & Boyd, ECOS (2013). The
///             embedding needs no feasible start and ends in a solution or in a certificate that
///             there is none. Rows and columns are equilibrated inside; results are of the problem
///             as given.
/// Blocks      Variables that meet in no cone never meet in G'W^-2 G, which is then block
///             diagonal; the solver finds the blocks (a block is one component of that graph),
///             factors each alone, and is left with a dense system of the size of A's rows. A
///             manoeuvre split into N impulses has N blocks of 4, so time and memory grow as N;
///             with a dense G there is one block, and they grow as N^3 and N^2.
/// Accuracy    Relative residuals and duality gap below `tolerance`, of the equilibrated problem.
///             Columns of [A; G] should be independent. Rows of A that depend on others (to 1e-6 of
///             their length) are tolerated where b agrees, and a contradiction where it does not.
/// Memory      1.4 kB per impulse of such a plan; all of it is released on return, but the
/// solution. Errors      No exceptions of its own; std::bad_alloc where memory is short. Checked by
/// test_suites/unit/flight_sw/formation_gnc/socp_solver_test.cpp
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <vector>

namespace formation_gnc {

/// Matrices in compressed columns.
struct SparseSocp {
  Eigen::VectorXd c;                 ///< n
  Eigen::SparseMatrix<double> A, G;  ///< p x n, m x n
  Eigen::VectorXd b, h;              ///< p, m
  int orthant = 0;                   ///< rows of the nonnegative orthant
  std::vector<int> cones = {};       ///< dimension of each second-order cone, 1 or more
};

/// The same with full matrices. Zeros in it are left out on entry: what costs is the caller's G.
struct DenseSocp {
  Eigen::VectorXd c;
  Eigen::MatrixXd A, G;
  Eigen::VectorXd b, h;
  int orthant = 0;
  std::vector<int> cones = {};
};

enum class SocpStatus {
  kOptimal,
  kInaccurate,        ///< no further progress, but within `acceptable`
  kPrimalInfeasible,  ///< y, z are a certificate: A'y + G'z = 0, z in K, b'y + h'z = -1
  kDualInfeasible,    ///< x, s are a certificate: Ax = 0, Gx + s = 0, s in K, c'x = -1
  kIterationLimit,
  kNumericalFailure,
  kBadInput  ///< see `message`
};
const char* to_string(SocpStatus status);

struct SocpOptions {
  double tolerance = 1e-8;   ///< 1e-12 to 1e-2
  double acceptable = 1e-5;  ///< tolerance to 1
  int max_iterations = 100;  ///< 1 to 10000
};

struct SocpSolution {
  SocpStatus status = SocpStatus::kBadInput;
  Eigen::VectorXd x, y, z, s;
  double primal_objective = 0.0, dual_objective = 0.0;  ///< c'x, -b'y - h'z
  double primal_residual = 0.0, dual_residual = 0.0, relative_gap = 0.0;
  int iterations = 0;
  const char* message = "";  ///< what is wrong with the input

  bool solved() const {
    return status == SocpStatus::kOptimal || status == SocpStatus::kInaccurate;
  }
};

class SocpSolver {
 public:
  explicit SocpSolver(const SocpOptions& options = {}) : options_(options) {}

  SocpSolution solve(const SparseSocp& problem) const;
  SocpSolution solve(const DenseSocp& problem) const;

 private:
  SocpOptions options_;
};

}  // namespace formation_gnc
