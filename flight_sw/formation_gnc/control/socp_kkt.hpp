/// The linear systems of the interior-point method, and the order of their unknowns.
///
///     [ 0  A'  G' ] [x]   [bx]
///     [ A  0   0  ] [y] = [by]
///     [ G  0  -W^2] [z]   [bz]
///
/// z is eliminated, which leaves H = G'W^-2 G. Variables that share a cone share a block of H; each
/// block has its own Cholesky factor, and the Schur complement A H^-1 A' is dense. A small
/// regularisation keeps the factors alive, iterative refinement takes its effect out again.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <vector>

#include "formation_gnc/control/cone_product.hpp"

namespace formation_gnc {

/// Equilibrated data: min c'x, A x = b, G x + s = h.
struct ConeProgram {
  Eigen::VectorXd c, b, h;
  Eigen::SparseMatrix<double> A;                   // by columns
  Eigen::SparseMatrix<double, Eigen::RowMajor> G;  // by rows: cones are rows

  void add_A(double factor, const Eigen::VectorXd& x, Eigen::VectorXd* to) const;
  void add_At(double factor, const Eigen::VectorXd& y, Eigen::VectorXd* to) const;
  void add_G(double factor, const Eigen::VectorXd& x, Eigen::VectorXd* to) const;
  void add_Gt(double factor, const Eigen::VectorXd& z, Eigen::VectorXd* to) const;
};

struct KktVector {
  Eigen::VectorXd x, y, z;
};

class KktSystem {
 public:
  KktSystem(const ConeProgram& program, const ConeProduct& cones);

  /// For the scaling as it is now; it must not change before the last solve().
  void factor(const NesterovTodd& scaling);
  /// `right` and `solution` are two vectors.
  void solve(const NesterovTodd& scaling, const KktVector& right, KktVector* solution);

 private:
  struct Block {
    int first, size;     // in variables_
    std::size_t factor;  // in factors_
  };

  void find_blocks();
  void add_cone(const NesterovTodd& scaling, int index);
  void add_to_schur(const Block& block);
  void solve_once(const NesterovTodd& scaling, KktVector* inout);
  void solve_blocks(Eigen::VectorXd* x) const;

  const ConeProgram& program_;
  const ConeProduct& cones_;
  std::vector<int> variables_;  // ordered by block
  std::vector<int> position_;   // of a variable within its block
  std::vector<int> block_of_;   // of a variable
  std::vector<Block> blocks_;
  std::vector<double> factors_;  // lower triangles by columns, each block in full
  Eigen::MatrixXd schur_;
  std::vector<int> touched_;
  std::vector<double> scaled_;  // W^-1 G of one cone; or L^-1 A' of one block
  KktVector residual_;
};

}  // namespace formation_gnc
