#include "formation_gnc/control/socp_equilibration.hpp"

#include <cmath>

namespace formation_gnc {
namespace {

using ByColumns = Eigen::SparseMatrix<double>;
using ByRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

constexpr int kRounds = 4;

double factor_for(double largest) {
  return largest > 0.0 ? 1.0 / std::sqrt(largest) : 1.0;
}

// Rows of a cone share the largest entry of all of them.
void join_cones(const ConeProduct& cones, Eigen::VectorXd* row) {
  for (int index = 0; index < cones.count(); ++index) {
    const ConeProduct::Cone at = cones.cone(index);
    double largest = 0.0;
    for (int k = 0; k < at.size; ++k) largest = std::fmax(largest, (*row)[at.first + k]);
    for (int k = 0; k < at.size; ++k) (*row)[at.first + k] = largest;
  }
}

void scale(const Eigen::VectorXd& row_A, const Eigen::VectorXd& row_G,
           const Eigen::VectorXd& column, ConeProgram* program) {
  for (int j = 0; j < program->A.outerSize(); ++j) {
    for (ByColumns::InnerIterator a(program->A, j); a; ++a) {
      a.valueRef() *= row_A[a.row()] * column[j];
    }
  }
  for (int i = 0; i < program->G.outerSize(); ++i) {
    for (ByRows::InnerIterator g(program->G, i); g; ++g) {
      g.valueRef() *= row_G[i] * column[g.col()];
    }
  }
}

// One round: what to multiply rows and columns by.
void round_factors(const ConeProgram& program, const ConeProduct& cones, Eigen::VectorXd* row_A,
                   Eigen::VectorXd* row_G, Eigen::VectorXd* column) {
  row_A->setZero(program.b.size());
  row_G->setZero(program.h.size());
  column->setZero(program.c.size());
  const auto note = [](double value, double* row, double* col) {
    *row = std::fmax(*row, std::fabs(value));
    *col = std::fmax(*col, std::fabs(value));
  };
  for (int j = 0; j < program.A.outerSize(); ++j) {
    for (ByColumns::InnerIterator a(program.A, j); a; ++a) {
      note(a.value(), &(*row_A)[a.row()], &(*column)[j]);
    }
  }
  for (int i = 0; i < program.G.outerSize(); ++i) {
    for (ByRows::InnerIterator g(program.G, i); g; ++g) {
      note(g.value(), &(*row_G)[i], &(*column)[g.col()]);
    }
  }
  join_cones(cones, row_G);
  for (double& v : *row_A) v = factor_for(v);
  for (double& v : *row_G) v = factor_for(v);
  for (double& v : *column) v = factor_for(v);
}

double factor_to_unit_length(double length) {
  return length > 0.0 ? 1.0 / length : 1.0;
}

}  // namespace

Equilibration::Equilibration(const SparseSocp& problem, const ConeProduct& cones,
                             ConeProgram* program) {
  program->A = problem.A;
  if (problem.b.size() == 0) program->A.resize(0, problem.c.size());
  program->G = problem.G;
  program->A.makeCompressed();
  program->G.makeCompressed();
  program->b = problem.b;
  program->h = problem.h;
  program->c = problem.c;
  row_A_.setOnes(problem.b.size());
  row_G_.setOnes(problem.h.size());
  column_.setOnes(problem.c.size());
  Eigen::VectorXd row_A, row_G, column;
  for (int round = 0; round < kRounds; ++round) {
    round_factors(*program, cones, &row_A, &row_G, &column);
    scale(row_A, row_G, column, program);
    row_A_.array() *= row_A.array();
    row_G_.array() *= row_G.array();
    column_.array() *= column.array();
  }
  program->c.array() *= column_.array();
  program->b.array() *= row_A_.array();
  program->h.array() *= row_G_.array();
  cost_ = factor_to_unit_length(program->c.norm());
  right_ = factor_to_unit_length(std::hypot(program->b.norm(), program->h.norm()));
  program->c *= cost_;
  program->b *= right_;
  program->h *= right_;
}

void Equilibration::unscale(SocpSolution* solution) const {
  solution->x.array() *= column_.array() / right_;
  solution->s.array() /= row_G_.array() * right_;
  solution->y.array() *= row_A_.array() / cost_;
  solution->z.array() *= row_G_.array() / cost_;
}

}  // namespace formation_gnc
