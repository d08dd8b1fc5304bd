#include "gaussian.hpp"

namespace formation_keeping {

using namespace flight_support;

bool measure(Gaussian* state, const RelativeElements& z, const Matrix6& R, double gate) {
  const Matrix6& P = state->covariance;
  const Matrix6 S = P + R;
  const RelativeElements innovation = z - state->mean;
  RelativeElements weighted;
  if (!flight_support::solve(S, innovation, &weighted)) return false;
  // Written so that a NaN fails the gate.
  if (!(dot(innovation, weighted) <= gate)) return false;

  Matrix6 gain_transposed;  // S K^T = P, both symmetric
  if (!flight_support::solve(S, P, &gain_transposed)) return false;
  const Matrix6 K = transpose(gain_transposed);
  const Matrix6 rest = flight_support::identity<6>() - K;
  state->mean = state->mean + K * innovation;
  state->covariance = symmetric(rest * P * transpose(rest) + K * R * transpose(K));
  return true;
}

}  // namespace formation_keeping
