/// Least squares of an initial state, and of scales of forces, to positions along an orbit.
#pragma once

#include <orrery/models/frames/vector.hpp>

#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

namespace orrery {

struct Fit {
  std::vector<double> parameters;
  double rms_m = 0;  // 3D, of what is left
  int iterations = 0;
};

/// Positions [m], one after the other, as `model` computes them from the parameters.
using FitModel = std::function<std::vector<Vec3>(const std::vector<double>&)>;

inline double rms(const std::vector<Vec3>& differences) {
  double sum = 0;
  for (const Vec3& d : differences) sum += dot(d, d);
  return std::sqrt(sum / static_cast<double>(differences.size()));
}

/// Solves the positive definite A x = b by Cholesky's method, row-major.
inline std::vector<double> solved(std::vector<double> A, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = A[i * n + j];
      for (std::size_t k = 0; k < j; ++k) sum -= A[i * n + k] * A[j * n + k];
      A[i * n + j] = i == j ? std::sqrt(sum) : sum / A[j * n + j];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= A[i * n + k] * b[k];
    b[i] /= A[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= A[k * n + i] * b[k];
    b[i] /= A[i * n + i];
  }
  return b;
}

/// Gauss-Newton with partials by differences, taken once: from a start within metres the model is
/// linear to 1e-6. `steps` are those of the differences, and the scale of the unknowns. Ends when a
/// correction moves the positions by less than 0.1 mm, after 6 iterations at the latest.
inline Fit fitted(const FitModel& model, const FitModel& model_for_partials,
                  const std::vector<Vec3>& observed, std::vector<double> parameters,
                  const std::vector<double>& steps) {
  const std::size_t n = parameters.size(), m = observed.size();
  const std::vector<Vec3> base = model_for_partials(parameters);
  std::vector<std::vector<Vec3>> partials;
  for (std::size_t k = 0; k < n; ++k) {
    std::vector<double> changed = parameters;
    changed[k] += steps[k];
    partials.push_back(model_for_partials(changed));
    for (std::size_t i = 0; i < m; ++i) partials[k][i] -= base[i];
  }
  std::vector<double> normal(n * n);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t l = 0; l < n; ++l)
      for (std::size_t i = 0; i < m; ++i) normal[k * n + l] += dot(partials[k][i], partials[l][i]);

  Fit fit{.parameters = parameters};
  for (double moved_m = 1; moved_m > 1e-4 && fit.iterations < 6; ++fit.iterations) {
    std::vector<Vec3> residual = model(fit.parameters);
    for (std::size_t i = 0; i < m; ++i) residual[i] = observed[i] - residual[i];
    fit.rms_m = rms(residual);
    std::vector<double> right(n);
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t i = 0; i < m; ++i) right[k] += dot(partials[k][i], residual[i]);
    const std::vector<double> correction = solved(normal, right);
    std::vector<Vec3> shift(m);
    for (std::size_t k = 0; k < n; ++k) {
      fit.parameters[k] += correction[k] * steps[k];
      for (std::size_t i = 0; i < m; ++i) shift[i] += correction[k] * partials[k][i];
    }
    moved_m = rms(shift);
  }
  return fit;
}

}  // namespace orrery
