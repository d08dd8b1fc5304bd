#include "formation_gnc/navigation/lambda.hpp"

#include <cmath>

namespace formation_gnc {
namespace {

constexpr int kN = kMostIntegers;
constexpr int kMostSteps = 10000;
constexpr double kMostCycles = 1e9;

/// Q = L^T diag(d) L with unit lower triangular L, and the unimodular Z with z = Z^T a.
struct Decorrelated {
  int n;
  double l[kN][kN], d[kN], z[kN][kN];
};

bool factor(int n, const double* q, Decorrelated* f) {
  double work[kN][kN];
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) work[i][j] = q[i * n + j];
  }
  *f = {};
  f->n = n;
  for (int i = n - 1; i >= 0; --i) {
    f->d[i] = work[i][i];
    if (!(f->d[i] > 0.0) || !std::isfinite(f->d[i])) return false;
    for (int j = 0; j <= i; ++j) f->l[i][j] = work[i][j] / f->d[i];
    for (int j = 0; j < i; ++j) {
      for (int k = 0; k <= j; ++k) work[j][k] -= f->l[i][j] * f->d[i] * f->l[i][k];
    }
    f->z[i][i] = 1.0;
  }
  return true;
}

// Column j less mu times column i.
void gauss(Decorrelated* f, int i, int j) {
  const double mu = std::nearbyint(f->l[i][j]);
  if (mu == 0.0) return;
  for (int k = i; k < f->n; ++k) f->l[k][j] -= mu * f->l[k][i];
  for (int k = 0; k < f->n; ++k) f->z[k][j] -= mu * f->z[k][i];
}

// Changes places of j and j + 1; `d_new` is the new d of j + 1.
void permute(Decorrelated* f, int j, double d_new) {
  const double eta = f->d[j] / d_new;
  const double lambda = f->d[j + 1] * f->l[j + 1][j] / d_new;
  f->d[j] = eta * f->d[j + 1];
  f->d[j + 1] = d_new;
  for (int k = 0; k < j; ++k) {
    const double a = f->l[j][k], b = f->l[j + 1][k];
    f->l[j][k] = b - f->l[j + 1][j] * a;
    f->l[j + 1][k] = eta * a + lambda * b;
  }
  f->l[j + 1][j] = lambda;
  for (int k = j + 2; k < f->n; ++k) {
    const double held = f->l[k][j];
    f->l[k][j] = f->l[k][j + 1];
    f->l[k][j + 1] = held;
  }
  for (int k = 0; k < f->n; ++k) {
    const double held = f->z[k][j];
    f->z[k][j] = f->z[k][j + 1];
    f->z[k][j + 1] = held;
  }
}

void decorrelate(Decorrelated* f) {
  int j = f->n - 2, reduced_from = f->n - 2;
  // Each exchange makes the product of the leading d smaller: it ends; the bound is for NaN.
  for (int turns = 0; j >= 0 && turns < kMostSteps; ++turns) {
    if (j <= reduced_from) {
      for (int i = j + 1; i < f->n; ++i) gauss(f, i, j);
    }
    const double d_new = f->d[j] + f->l[j + 1][j] * f->l[j + 1][j] * f->d[j + 1];
    if (d_new + 1e-12 * d_new < f->d[j + 1]) {
      permute(f, j, d_new);
      reduced_from = j;
      j = f->n - 2;
    } else {
      --j;
    }
  }
}

double success_rate_of(const Decorrelated& f) {
  double p = 1.0;
  // 2 Phi(x) - 1 = erf(x / sqrt 2) at x = 1 / (2 sqrt d)
  for (int k = 0; k < f.n; ++k) p *= std::erf(0.35355339059327373 / std::sqrt(f.d[k]));
  return p;
}

/// The two nearest integer vectors in decorrelated space, and their distances.
struct Found {
  int count = 0, steps = 0;
  double z[2][kN] = {}, distance[2] = {};

  double worst() const { return count < 2 ? INFINITY : distance[1]; }
  void add(int n, const double* candidate, double its_distance) {
    const int at = count > 0 && its_distance < distance[0] ? 0 : (count > 0 ? 1 : 0);
    if (at == 0 && count > 0) {
      for (int k = 0; k < n; ++k) z[1][k] = z[0][k];
      distance[1] = distance[0];
    }
    for (int k = 0; k < n; ++k) z[at][k] = candidate[k];
    distance[at] = its_distance;
    if (count < 2) ++count;
  }
};

double sign_of(double x) {
  return x < 0.0 ? -1.0 : 1.0;
}

/// Depth first, from the last component to the first; each level goes to and fro about its
/// conditional mean, nearest integer first.
class Search {
 public:
  Search(const Decorrelated& f, const double* z_float) : f_(f) {
    for (int k = 0; k < f.n; ++k) z_float_[k] = z_float[k];
  }

  Found run() {
    Found found;
    int k = f_.n - 1;
    enter(k);
    for (; found.steps < kMostSteps; ++found.steps) {
      const double offset = mean_[k] - z_[k];
      const double distance = above_[k] + offset * offset / f_.d[k];
      if (distance < found.worst()) {
        if (k > 0) {
          above_[k - 1] = distance;
          enter(--k);
          continue;
        }
        found.add(f_.n, z_, distance);
        next(k);
      } else if (k == f_.n - 1) {
        return found;
      } else {
        next(++k);
      }
    }
    found.count = 0;
    return found;
  }

 private:
  void enter(int k) {
    mean_[k] = z_float_[k];
    for (int i = k + 1; i < f_.n; ++i) mean_[k] += (z_[i] - mean_[i]) * f_.l[i][k];
    z_[k] = std::nearbyint(mean_[k]);
    step_[k] = sign_of(mean_[k] - z_[k]);
  }
  void next(int k) {
    z_[k] += step_[k];
    step_[k] = -step_[k] - sign_of(step_[k]);
  }

  const Decorrelated& f_;
  double z_float_[kN], mean_[kN], z_[kN], step_[kN], above_[kN] = {};
};

// Z^T x = z for x: Gaussian elimination with pivots; Z is unimodular, so x are integers.
bool back_transform(const Decorrelated& f, const double* z, double* x) {
  double a[kN][kN + 1];
  for (int i = 0; i < f.n; ++i) {
    for (int j = 0; j < f.n; ++j) a[i][j] = f.z[j][i];
    a[i][f.n] = z[i];
  }
  for (int k = 0; k < f.n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < f.n; ++i) {
      if (std::fabs(a[i][k]) > std::fabs(a[pivot][k])) pivot = i;
    }
    if (a[pivot][k] == 0.0) return false;
    for (int j = k; j <= f.n; ++j) {
      const double held = a[k][j];
      a[k][j] = a[pivot][j];
      a[pivot][j] = held;
    }
    for (int i = 0; i < f.n; ++i) {
      if (i == k) continue;
      const double factor = a[i][k] / a[k][k];
      for (int j = k; j <= f.n; ++j) a[i][j] -= factor * a[k][j];
    }
  }
  for (int k = 0; k < f.n; ++k) {
    const double value = a[k][f.n] / a[k][k];
    x[k] = std::nearbyint(value);
    if (!(std::fabs(value - x[k]) < 1e-3)) return false;
  }
  return true;
}

}  // namespace

IntegerLeastSquares integer_least_squares(int n, const double* a, const double* q) {
  IntegerLeastSquares out;
  if (n < 1 || n > kN) return out;
  for (int k = 0; k < n; ++k) {
    if (!(std::fabs(a[k]) < kMostCycles)) return out;
  }
  Decorrelated f;
  if (!factor(n, q, &f)) return out;
  decorrelate(&f);
  // The integer part stays out of the transformation, where it would cost digits.
  double base[kN], z_float[kN] = {};
  for (int k = 0; k < n; ++k) base[k] = std::nearbyint(a[k]);
  for (int j = 0; j < n; ++j) {
    for (int k = 0; k < n; ++k) z_float[j] += f.z[k][j] * (a[k] - base[k]);
  }
  const Found found = Search(f, z_float).run();
  out.steps = found.steps;
  if (found.count < 2) return out;
  if (!back_transform(f, found.z[0], out.best)) return out;
  if (!back_transform(f, found.z[1], out.second)) return out;
  for (int k = 0; k < n; ++k) {
    out.best[k] += base[k];
    out.second[k] += base[k];
  }
  out.best_distance = found.distance[0];
  out.second_distance = found.distance[1];
  out.success_rate = success_rate_of(f);
  out.solved = true;
  return out;
}

}  // namespace formation_gnc
