#include "formation_gnc/control/socp_kkt.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace formation_gnc {
namespace {

using ByColumns = Eigen::SparseMatrix<double>;
using ByRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// Of the equilibrated problem, whose entries are about 1.
constexpr double kRegularisation = 1e-8;
constexpr double kPivotOfDiagonal = 1e-13;
constexpr int kRefinements = 10;
constexpr double kRefined = 1e-12;

// Regularises and factors in place. Right-looking: every entry sees the same operations in the same
// order on any machine, which blocked library kernels, tuned to caches, do not promise. Pivots that
// vanish against their diagonal are lifted.
void factor_block(double* L, int n, std::vector<double>* diagonal) {
  diagonal->resize(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) {
    (*diagonal)[k] = L[static_cast<std::size_t>(k) * n + k];
    L[static_cast<std::size_t>(k) * n + k] += kRegularisation;
  }
  for (int j = 0; j < n; ++j) {
    double* column = L + static_cast<std::size_t>(j) * n;
    const double least = kRegularisation + kPivotOfDiagonal * (*diagonal)[j];
    const double pivot = std::sqrt(std::fmax(column[j], least));
    column[j] = pivot;
    for (int r = j + 1; r < n; ++r) column[r] /= pivot;
    for (int c = j + 1; c < n; ++c) {
      const double factor = column[c];
      if (factor == 0.0) continue;
      double* next = L + static_cast<std::size_t>(c) * n;
      for (int r = c; r < n; ++r) next[r] -= factor * column[r];
    }
  }
}

void solve_lower(const double* L, int n, double* x) {
  for (int j = 0; j < n; ++j) {
    const double* column = L + static_cast<std::size_t>(j) * n;
    x[j] /= column[j];
    for (int r = j + 1; r < n; ++r) x[r] -= column[r] * x[j];
  }
}

void solve_upper(const double* L, int n, double* x) {
  for (int j = n - 1; j >= 0; --j) {
    const double* column = L + static_cast<std::size_t>(j) * n;
    for (int r = j + 1; r < n; ++r) x[j] -= column[r] * x[r];
    x[j] /= column[j];
  }
}

double norm(const KktVector& v) {
  return std::sqrt(v.x.squaredNorm() + v.y.squaredNorm() + v.z.squaredNorm());
}

int root_of(std::vector<int>* parent, int k) {
  std::vector<int>& p = *parent;
  while (p[k] != k) {
    p[k] = p[p[k]];
    k = p[k];
  }
  return k;
}

}  // namespace

void ConeProgram::add_A(double factor, const Eigen::VectorXd& x, Eigen::VectorXd* to) const {
  for (int j = 0; j < A.outerSize(); ++j) {
    for (ByColumns::InnerIterator a(A, j); a; ++a) (*to)[a.row()] += factor * a.value() * x[j];
  }
}

void ConeProgram::add_At(double factor, const Eigen::VectorXd& y, Eigen::VectorXd* to) const {
  for (int j = 0; j < A.outerSize(); ++j) {
    double sum = 0.0;
    for (ByColumns::InnerIterator a(A, j); a; ++a) sum += a.value() * y[a.row()];
    (*to)[j] += factor * sum;
  }
}

void ConeProgram::add_G(double factor, const Eigen::VectorXd& x, Eigen::VectorXd* to) const {
  for (int i = 0; i < G.outerSize(); ++i) {
    double sum = 0.0;
    for (ByRows::InnerIterator g(G, i); g; ++g) sum += g.value() * x[g.col()];
    (*to)[i] += factor * sum;
  }
}

void ConeProgram::add_Gt(double factor, const Eigen::VectorXd& z, Eigen::VectorXd* to) const {
  for (int i = 0; i < G.outerSize(); ++i) {
    for (ByRows::InnerIterator g(G, i); g; ++g) (*to)[g.col()] += factor * g.value() * z[i];
  }
}

KktSystem::KktSystem(const ConeProgram& program, const ConeProduct& cones)
    : program_(program), cones_(cones) {
  find_blocks();
  schur_.resize(program.b.size(), program.b.size());
}

// Components of the graph in which the variables of a cone are joined; numbered by their first
// variable.
void KktSystem::find_blocks() {
  const int n = static_cast<int>(program_.c.size());
  std::vector<int> parent(static_cast<std::size_t>(n));
  std::iota(parent.begin(), parent.end(), 0);
  for (int index = 0; index < cones_.count(); ++index) {
    const ConeProduct::Cone at = cones_.cone(index);
    int first = -1;
    for (int i = at.first; i < at.first + at.size; ++i) {
      for (ByRows::InnerIterator g(program_.G, i); g; ++g) {
        const int root = root_of(&parent, static_cast<int>(g.col()));
        if (first < 0) first = root;
        first = root_of(&parent, first);
        parent[std::max(root, first)] = std::min(root, first);
      }
    }
  }
  block_of_.assign(static_cast<std::size_t>(n), -1);
  position_.assign(static_cast<std::size_t>(n), 0);
  for (int k = 0; k < n; ++k) {  // a root is the first variable of its component
    const int root = root_of(&parent, k);
    if (root == k) {
      block_of_[k] = static_cast<int>(blocks_.size());
      blocks_.push_back({0, 0, 0});
    }
    block_of_[k] = block_of_[root];
    position_[k] = blocks_[block_of_[k]].size++;
  }
  std::size_t cells = 0;
  int first = 0;
  for (Block& block : blocks_) {
    block.first = first;
    block.factor = cells;
    first += block.size;
    cells += static_cast<std::size_t>(block.size) * block.size;
  }
  variables_.resize(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) variables_[blocks_[block_of_[k]].first + position_[k]] = k;
  factors_.resize(cells);
}

// H += (W^-1 G)'(W^-1 G), of the rows of one cone.
void KktSystem::add_cone(const NesterovTodd& scaling, int index) {
  const ConeProduct::Cone at = cones_.cone(index);
  touched_.clear();
  int block_index = -1;
  for (int i = at.first; i < at.first + at.size; ++i) {
    for (ByRows::InnerIterator g(program_.G, i); g; ++g) {
      const int variable = static_cast<int>(g.col());
      block_index = block_of_[variable];
      touched_.push_back(position_[variable]);
    }
  }
  if (block_index < 0) return;
  std::sort(touched_.begin(), touched_.end());
  touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
  const Block& block = blocks_[block_index];
  const int columns = static_cast<int>(touched_.size());

  scaled_.assign(static_cast<std::size_t>(columns) * at.size, 0.0);
  for (int i = 0; i < at.size; ++i) {
    for (ByRows::InnerIterator g(program_.G, at.first + i); g; ++g) {
      const auto place =
          std::lower_bound(touched_.begin(), touched_.end(), position_[static_cast<int>(g.col())]);
      scaled_[static_cast<std::size_t>(place - touched_.begin()) * at.size + i] += g.value();
    }
  }
  for (int c = 0; c < columns; ++c) {
    scaling.apply_inverse(index, scaled_.data() + static_cast<std::size_t>(c) * at.size);
  }
  double* H = factors_.data() + block.factor;
  for (int c = 0; c < columns; ++c) {
    const double* right = scaled_.data() + static_cast<std::size_t>(c) * at.size;
    double* column = H + static_cast<std::size_t>(touched_[c]) * block.size;
    for (int r = c; r < columns; ++r) {
      const double* left = scaled_.data() + static_cast<std::size_t>(r) * at.size;
      double sum = 0.0;
      for (int k = 0; k < at.size; ++k) sum += left[k] * right[k];
      column[touched_[r]] += sum;
    }
  }
}

// S += (L^-1 A')'(L^-1 A'), of one block's columns of A.
void KktSystem::add_to_schur(const Block& block) {
  const int p = static_cast<int>(schur_.rows());
  scaled_.assign(static_cast<std::size_t>(p) * block.size, 0.0);
  for (int k = 0; k < block.size; ++k) {
    for (ByColumns::InnerIterator a(program_.A, variables_[block.first + k]); a; ++a) {
      scaled_[static_cast<std::size_t>(a.row()) * block.size + k] = a.value();
    }
  }
  for (int r = 0; r < p; ++r) {
    solve_lower(factors_.data() + block.factor, block.size,
                scaled_.data() + static_cast<std::size_t>(r) * block.size);
  }
  for (int c = 0; c < p; ++c) {
    const double* right = scaled_.data() + static_cast<std::size_t>(c) * block.size;
    for (int r = c; r < p; ++r) {
      const double* left = scaled_.data() + static_cast<std::size_t>(r) * block.size;
      double sum = 0.0;
      for (int k = 0; k < block.size; ++k) sum += left[k] * right[k];
      schur_(r, c) += sum;
    }
  }
}

void KktSystem::factor(const NesterovTodd& scaling) {
  std::fill(factors_.begin(), factors_.end(), 0.0);
  for (int index = 0; index < cones_.count(); ++index) add_cone(scaling, index);
  schur_.setZero();
  for (const Block& block : blocks_) {
    factor_block(factors_.data() + block.factor, block.size, &scaled_);
    add_to_schur(block);
  }
  factor_block(schur_.data(), static_cast<int>(schur_.rows()), &scaled_);
}

void KktSystem::solve_blocks(Eigen::VectorXd* x) const {
  std::vector<double> part;
  for (const Block& block : blocks_) {
    part.resize(static_cast<std::size_t>(block.size));
    for (int k = 0; k < block.size; ++k) part[k] = (*x)[variables_[block.first + k]];
    solve_lower(factors_.data() + block.factor, block.size, part.data());
    solve_upper(factors_.data() + block.factor, block.size, part.data());
    for (int k = 0; k < block.size; ++k) (*x)[variables_[block.first + k]] = part[k];
  }
}

// With the factors as they are; the right-hand side becomes the solution.
void KktSystem::solve_once(const NesterovTodd& scaling, KktVector* v) {
  Eigen::VectorXd bz = v->z;
  scaling.apply_inverse(&v->z);
  scaling.apply_inverse(&v->z);
  program_.add_Gt(1.0, v->z, &v->x);  // bx + G'W^-2 bz
  if (v->y.size() > 0) {
    Eigen::VectorXd free = v->x;
    solve_blocks(&free);
    v->y = -v->y;
    program_.add_A(1.0, free, &v->y);
    const int p = static_cast<int>(v->y.size());
    solve_lower(schur_.data(), p, v->y.data());
    solve_upper(schur_.data(), p, v->y.data());
    program_.add_At(-1.0, v->y, &v->x);
  }
  solve_blocks(&v->x);
  v->z = -bz;
  program_.add_G(1.0, v->x, &v->z);
  scaling.apply_inverse(&v->z);
  scaling.apply_inverse(&v->z);
}

void KktSystem::solve(const NesterovTodd& scaling, const KktVector& right, KktVector* solution) {
  *solution = right;
  solve_once(scaling, solution);
  const double size = norm(right);
  double last = INFINITY;
  for (int round = 0; round < kRefinements; ++round) {
    KktVector& r = residual_;
    r = right;
    program_.add_At(-1.0, solution->y, &r.x);
    program_.add_Gt(-1.0, solution->z, &r.x);
    program_.add_A(-1.0, solution->x, &r.y);
    program_.add_G(-1.0, solution->x, &r.z);
    Eigen::VectorXd Wz = solution->z;
    scaling.apply(&Wz);
    scaling.apply(&Wz);
    r.z += Wz;
    const double left = norm(r);
    // Written so that a NaN stops it. Less than half a digit per round is not worth another.
    if (!(left > kRefined * (1.0 + size)) || !(left < 0.5 * last)) break;
    last = left;
    solve_once(scaling, &r);
    solution->x += r.x;
    solution->y += r.y;
    solution->z += r.z;
  }
}

}  // namespace formation_gnc
