/// Integer least squares: the integers nearest to a float vector in the metric of its covariance.
///
/// Method      LAMBDA's decorrelation (Teunissen 1995; de Jonge & Tiberius 1996), the depth-first
///             search with shrinking radius of MLAMBDA (Chang, Yang & Zhou 2005).
/// Checked by  test_suites/unit/flight_sw/formation_gnc/lambda_test.cpp, against brute force and
/// RTKLIB
#pragma once

namespace formation_gnc {

constexpr int kMostIntegers = 11;  // double differences of twelve satellites

struct IntegerLeastSquares {
  bool solved = false;
  double best[kMostIntegers], second[kMostIntegers];
  double best_distance = 0.0, second_distance = 0.0;  ///< (a - z)^T Q^-1 (a - z)
  /// Probability that rounding in sequence after the decorrelation is right: a lower bound of that
  /// of integer least squares.
  double success_rate = 0.0;
  int steps = 0;  ///< of the search
};

/// @param n  1 to kMostIntegers.
/// @param a  n numbers, below 1e9 in magnitude.
/// @param q  n x n, symmetric and positive definite, row by row.
/// @return   solved = false if q is not positive definite, a is not finite, or the search takes
/// more
///           than 10000 steps.
IntegerLeastSquares integer_least_squares(int n, const double* a, const double* q);

}  // namespace formation_gnc
