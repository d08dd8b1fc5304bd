#include "formation_gnc/control/socp_solver.hpp"

#include <cmath>

#include "formation_gnc/control/cone_product.hpp"
#include "formation_gnc/control/socp_consistency.hpp"
#include "formation_gnc/control/socp_equilibration.hpp"
#include "formation_gnc/control/socp_kkt.hpp"

namespace formation_gnc {
namespace {

using Eigen::VectorXd;

constexpr double kFractionToBorder = 0.99;

// In plain order, so that the sum is the same whatever vector unit the compiler aims at.
double dot(const VectorXd& a, const VectorXd& b) {
  double sum = 0.0;
  for (Eigen::Index k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}
double length(const VectorXd& a) {
  return std::sqrt(dot(a, a));
}

// Of the embedding: where it ends in tau > 0, x / tau is the solution.
struct Residuals {
  KktVector F;                          // A'y + G'z + c tau, b tau - A x, h tau - G x - s
  double gap = 0.0;                     // -c'x - b'y - h'z - kappa
  double cx = 0.0, by = 0.0, hz = 0.0;  // each of its own
  double no_dual = 0.0, no_primal_A = 0.0, no_primal_G = 0.0;  // |A'y + G'z|, |A x|, |G x + s|
};

class InteriorPoint {
 public:
  InteriorPoint(const ConeProgram& program, const ConeProduct& cones, const SocpOptions& options)
      : program_(program),
        cones_(cones),
        options_(options),
        kkt_(program, cones),
        scaling_(cones),
        norm_b_(std::fmax(1.0, length(program.b))),
        norm_c_(std::fmax(1.0, length(program.c))),
        norm_h_(std::fmax(1.0, length(program.h))) {}

  // Leaves x, y, z, s and the status in `solution`, of the scaled problem.
  void run(SocpSolution* solution) {
    start();
    SocpStatus status = SocpStatus::kIterationLimit;
    int iteration = 0;
    for (; iteration <= options_.max_iterations; ++iteration) {
      find_residuals();
      if (judge(options_.tolerance, &status)) break;
      if (iteration == options_.max_iterations || !advance()) {
        status = iteration == options_.max_iterations ? SocpStatus::kIterationLimit
                                                      : SocpStatus::kNumericalFailure;
        SocpStatus rough = status;
        if (judge(options_.acceptable, &rough)) {
          status = rough == SocpStatus::kOptimal ? SocpStatus::kInaccurate : rough;
        }
        break;
      }
    }
    solution->status = status;
    solution->iterations = iteration;
    hand_over(solution);
  }

 private:
  // Vandenberghe (2010), §7.3: least squares for (x, s) and for (y, z), moved into the cone.
  void start() {
    scaling_.set_identity();
    kkt_.factor(scaling_);
    KktVector right{VectorXd::Zero(program_.c.size()), program_.b, program_.h};
    kkt_.solve(scaling_, right, &u_);
    at_.x = u_.x;
    s_ = -u_.z;
    into_cone(&s_);
    right = {-program_.c, VectorXd::Zero(program_.b.size()), VectorXd::Zero(program_.h.size())};
    kkt_.solve(scaling_, right, &u_);
    at_.y = u_.y;
    at_.z = u_.z;
    into_cone(&at_.z);
    tau_ = kappa_ = 1.0;
  }

  void into_cone(VectorXd* v) const {
    const double outside = cones_.distance_outside(*v);
    if (outside >= -1e-8 * std::fmax(1.0, length(*v))) cones_.shift(1.0 + outside, v);
  }

  void find_residuals() {
    Residuals& r = residuals_;
    KktVector& F = r.F;
    F.x.setZero(program_.c.size());
    program_.add_At(1.0, at_.y, &F.x);
    program_.add_Gt(1.0, at_.z, &F.x);
    r.no_dual = length(F.x);
    F.y.setZero(program_.b.size());
    program_.add_A(-1.0, at_.x, &F.y);
    r.no_primal_A = length(F.y);
    F.z = -s_;
    program_.add_G(-1.0, at_.x, &F.z);
    r.no_primal_G = length(F.z);
    F.x += tau_ * program_.c;
    F.y += tau_ * program_.b;
    F.z += tau_ * program_.h;
    r.cx = dot(program_.c, at_.x);
    r.by = dot(program_.b, at_.y);
    r.hz = dot(program_.h, at_.z);
    r.gap = -r.cx - r.by - r.hz - kappa_;
  }

  bool judge(double tolerance, SocpStatus* status) const {
    const Residuals& r = residuals_;
    const double primal = std::fmax(length(r.F.y) / norm_b_, length(r.F.z) / norm_h_) / tau_;
    const double dual = length(r.F.x) / norm_c_ / tau_;
    const double cost = r.cx / tau_, bound = -(r.by + r.hz) / tau_;
    const double sz = dot(s_, at_.z) / (tau_ * tau_);
    const double gap = std::fmin(sz, std::fabs(cost - bound)) /
                       std::fmax(1e-2, std::fmin(std::fabs(cost), std::fabs(bound)));
    if (primal < tolerance && dual < tolerance && gap < tolerance) {
      *status = SocpStatus::kOptimal;
      return true;
    }
    const double down = -(r.by + r.hz);
    if (down > 0.0 && r.no_dual / norm_c_ < tolerance * down) {
      *status = SocpStatus::kPrimalInfeasible;
      return true;
    }
    if (r.cx < 0.0 &&
        std::fmax(r.no_primal_A / norm_b_, r.no_primal_G / norm_h_) < tolerance * -r.cx) {
      *status = SocpStatus::kDualInfeasible;
      return true;
    }
    return false;
  }

  // A predictor and a corrector. @return false if numbers have run out.
  bool advance() {
    if (!scaling_.update(s_, at_.z)) return false;
    lambda_ = at_.z;
    scaling_.apply(&lambda_);
    const double mu = (dot(lambda_, lambda_) + tau_ * kappa_) / (cones_.degree() + 1);
    kkt_.factor(scaling_);
    right_ = {-program_.c, program_.b, program_.h};
    kkt_.solve(scaling_, right_, &u_);
    Wz_ = u_.z;
    scaling_.apply(&Wz_);
    pivot_ = dot(Wz_, Wz_) + kappa_ / tau_;

    // Predictor: d = -lambda.
    d_ = -lambda_;
    Step predictor = direction(1.0, -kappa_ * tau_);
    double step = largest_step(predictor);
    const double sigma = centering(step);

    // Corrector: lambda o d = sigma mu e - lambda o lambda - (W^-1 ds) o (W dz).
    cones_.product(ds_, dz_, &d_);
    cones_.product(lambda_, lambda_, &ds_);
    d_ = -d_ - ds_;
    cones_.shift(sigma * mu, &d_);
    cones_.divide(lambda_, &d_);
    const Step corrector =
        direction(1.0 - sigma, sigma * mu - kappa_ * tau_ - predictor.kappa * predictor.tau);
    step = std::fmin(1.0, kFractionToBorder * largest_step(corrector));
    return take(corrector, step);
  }

  static double centering(double step) {
    const double rest = 1.0 - std::fmin(step, 1.0);
    return std::fmax(1e-6, rest * rest * rest);
  }

  struct Step {
    double tau = 0.0, kappa = 0.0;
  };

  // Solves for all unknowns, with the residuals to shrink by `share` and W dz + W^-1 ds = d_.
  // Leaves dx, dy, dz in v_, and W^-1 ds and W dz in ds_ and dz_.
  Step direction(double share, double complementarity) {
    VectorXd& Wd = right_.z;
    Wd = d_;
    scaling_.apply(&Wd);
    right_.x = -share * residuals_.F.x;
    right_.y = share * residuals_.F.y;
    right_.z = share * residuals_.F.z - Wd;
    kkt_.solve(scaling_, right_, &v_);
    const double along = dot(program_.c, v_.x) + dot(program_.b, v_.y) + dot(program_.h, v_.z);
    Step step;
    step.tau = -(share * residuals_.gap - complementarity / tau_ - along) / pivot_;
    step.kappa = (complementarity - kappa_ * step.tau) / tau_;
    v_.x += step.tau * u_.x;
    v_.y += step.tau * u_.y;
    v_.z += step.tau * u_.z;
    dz_ = v_.z;
    scaling_.apply(&dz_);
    ds_ = d_ - dz_;
    return step;
  }

  double largest_step(const Step& step) const {
    double limit = 1.0 / kFractionToBorder;
    if (step.tau < 0.0) limit = std::fmin(limit, -tau_ / step.tau);
    if (step.kappa < 0.0) limit = std::fmin(limit, -kappa_ / step.kappa);
    limit = cones_.largest_step(lambda_, ds_, limit);
    return cones_.largest_step(lambda_, dz_, limit);
  }

  bool take(const Step& step, double alpha) {
    if (!(alpha > 1e-9) || !std::isfinite(step.tau) || !std::isfinite(step.kappa)) return false;
    if (!v_.x.allFinite() || !v_.y.allFinite() || !v_.z.allFinite()) return false;
    scaling_.apply(&ds_);
    at_.x += alpha * v_.x;
    at_.y += alpha * v_.y;
    at_.z += alpha * v_.z;
    s_ += alpha * ds_;
    tau_ += alpha * step.tau;
    kappa_ += alpha * step.kappa;
    return true;
  }

  void hand_over(SocpSolution* solution) {
    const bool certificate = solution->status == SocpStatus::kPrimalInfeasible ||
                             solution->status == SocpStatus::kDualInfeasible;
    const double divisor = certificate ? 1.0 : tau_;
    solution->x = at_.x / divisor;
    solution->y = at_.y / divisor;
    solution->z = at_.z / divisor;
    solution->s = s_ / divisor;
  }

  const ConeProgram& program_;
  const ConeProduct& cones_;
  const SocpOptions& options_;
  KktSystem kkt_;
  NesterovTodd scaling_;
  double norm_b_, norm_c_, norm_h_;
  KktVector at_;
  VectorXd s_;
  double tau_ = 1.0, kappa_ = 1.0;
  Residuals residuals_;
  KktVector right_, u_, v_;  // u_: response to (-c, b, h)
  VectorXd lambda_, Wz_, d_, ds_, dz_;
  double pivot_ = 1.0;  // minus the factor of dtau
};

// A certificate is a ray: scaled so that what it proves reads -1 in the problem as given.
void normalise_certificate(const SparseSocp& problem, SocpSolution* solution) {
  double length = 1.0;
  if (solution->status == SocpStatus::kPrimalInfeasible) {
    length = -dot(problem.b, solution->y) - dot(problem.h, solution->z);
  } else if (solution->status == SocpStatus::kDualInfeasible) {
    length = -dot(problem.c, solution->x);
  }
  solution->x /= length;
  solution->y /= length;
  solution->z /= length;
  solution->s /= length;
}

// Of the problem as given.
void measure(const SparseSocp& problem, SocpSolution* solution) {
  VectorXd dual = problem.G.transpose() * solution->z;
  VectorXd Ax = VectorXd::Zero(problem.b.size());
  if (problem.b.size() > 0) {
    dual += problem.A.transpose() * solution->y;
    Ax = problem.A * solution->x;
  }
  const VectorXd Gxs = problem.G * solution->x + solution->s;
  const double cx = dot(problem.c, solution->x);
  const double bound = -dot(problem.b, solution->y) - dot(problem.h, solution->z);
  const bool certificate = solution->status == SocpStatus::kPrimalInfeasible ||
                           solution->status == SocpStatus::kDualInfeasible;
  const double right = certificate ? 0.0 : 1.0;
  solution->primal_objective = cx;
  solution->dual_objective = bound;
  solution->dual_residual = length(dual + right * problem.c) / std::fmax(1.0, length(problem.c));
  solution->primal_residual =
      std::fmax(length(Ax - right * problem.b) / std::fmax(1.0, length(problem.b)),
                length(Gxs - right * problem.h) / std::fmax(1.0, length(problem.h)));
  solution->relative_gap =
      std::fabs(cx - bound) / std::fmax(1.0, std::fmin(std::fabs(cx), std::fabs(bound)));
}

const char* fault_of(const SparseSocp& p, const SocpOptions& options) {
  const Eigen::Index n = p.c.size();
  if (n < 1) return "c is empty";
  if (p.A.cols() != n && p.b.size() > 0) return "A has not as many columns as c has rows";
  if (p.A.rows() != p.b.size()) return "A has not as many rows as b";
  if (p.G.cols() != n) return "G has not as many columns as c has rows";
  if (p.G.rows() != p.h.size()) return "G has not as many rows as h";
  if (p.orthant < 0) return "orthant is negative";
  Eigen::Index rows = p.orthant;
  for (const int size : p.cones) {
    if (size < 1) return "a cone has less than one row";
    rows += size;
  }
  if (rows != p.h.size()) return "the cones have not as many rows as h";
  if (rows < 1) return "there is no inequality";
  const auto finite = [](const Eigen::SparseMatrix<double>& m) {
    for (int j = 0; j < m.outerSize(); ++j) {
      for (Eigen::SparseMatrix<double>::InnerIterator v(m, j); v; ++v) {
        if (!std::isfinite(v.value())) return false;
      }
    }
    return true;
  };
  if (!p.c.allFinite() || !p.b.allFinite() || !p.h.allFinite() || !finite(p.A) || !finite(p.G)) {
    return "a number is not finite";
  }
  if (!(options.tolerance >= 1e-12 && options.tolerance <= 1e-2)) {
    return "tolerance is not in 1e-12 to 1e-2";
  }
  if (!(options.acceptable >= options.tolerance && options.acceptable <= 1.0)) {
    return "acceptable is not in tolerance to 1";
  }
  if (options.max_iterations < 1 || options.max_iterations > 10000) {
    return "max_iterations is not in 1 to 10000";
  }
  return nullptr;
}

}  // namespace

const char* to_string(SocpStatus status) {
  switch (status) {
    case SocpStatus::kOptimal:
      return "optimal";
    case SocpStatus::kInaccurate:
      return "inaccurate";
    case SocpStatus::kPrimalInfeasible:
      return "primal infeasible";
    case SocpStatus::kDualInfeasible:
      return "dual infeasible";
    case SocpStatus::kIterationLimit:
      return "iteration limit";
    case SocpStatus::kNumericalFailure:
      return "numerical failure";
    case SocpStatus::kBadInput:
      return "bad input";
  }
  return "";
}

SocpSolution SocpSolver::solve(const SparseSocp& problem) const {
  SocpSolution solution;
  if (const char* fault = fault_of(problem, options_)) {
    solution.message = fault;
    return solution;
  }
  const ConeProduct cones(problem.orthant, problem.cones);
  ConeProgram program;
  const Equilibration equilibration(problem, cones, &program);
  if (find_contradiction(program, &solution.y)) {
    solution.status = SocpStatus::kPrimalInfeasible;
    solution.x = Eigen::VectorXd::Zero(problem.c.size());
    solution.s = solution.z = Eigen::VectorXd::Zero(problem.h.size());
  } else {
    InteriorPoint(program, cones, options_).run(&solution);
  }
  equilibration.unscale(&solution);
  normalise_certificate(problem, &solution);
  measure(problem, &solution);
  return solution;
}

SocpSolution SocpSolver::solve(const DenseSocp& problem) const {
  SparseSocp sparse;
  sparse.c = problem.c;
  sparse.A = problem.A.sparseView();
  sparse.G = problem.G.sparseView();
  sparse.b = problem.b;
  sparse.h = problem.h;
  sparse.orthant = problem.orthant;
  sparse.cones = problem.cones;
  return solve(sparse);
}

}  // namespace formation_gnc
