/// Scales a cone program so that rows and columns are of size about 1, and solutions back.
///
/// Ruiz (2001): rows and columns are divided by the root of their largest entry, a few times; the
/// rows of one second-order cone together, or it would not stay one. Then c and (b, h) are brought
/// to length 1 at most.
#pragma once

#include "formation_gnc/control/socp_kkt.hpp"
#include "formation_gnc/control/socp_solver.hpp"

namespace formation_gnc {

class Equilibration {
 public:
  /// Copies `problem`, scaled, into `program`.
  Equilibration(const SparseSocp& problem, const ConeProduct& cones, ConeProgram* program);

  /// Of the scaled problem in, of the problem as given out.
  void unscale(SocpSolution* solution) const;

 private:
  Eigen::VectorXd column_, row_A_, row_G_;
  double cost_ = 1.0, right_ = 1.0;
};

}  // namespace formation_gnc
