/// A Gaussian over six elements, and its direct measurement.
#pragma once

#include "support/orbit/relative_elements.hpp"

namespace formation_keeping {

using flight_support::Matrix6;
using flight_support::OrbitElements;
using flight_support::RelativeElements;

struct Gaussian {
  RelativeElements mean;
  Matrix6 covariance;
};

/// Kalman update by a measurement of all six elements themselves, z = mean + N(0, R), in Joseph's
/// form.
/// @param gate  Normalised innovation squared above which nothing is changed: chi-square with six
///              degrees of freedom, 33 is exceeded once in 10^5.
/// @return false if the innovation failed the gate, or R + P is singular.
bool measure(Gaussian* state, const RelativeElements& z, const Matrix6& R, double gate);

}  // namespace formation_keeping
