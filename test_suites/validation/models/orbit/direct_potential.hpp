/// An independent evaluation of a gravity field for tests: spherical coordinates, long double, the
/// standard forward recursion on normalised Legendre functions. Slow, and singular at the poles.
#pragma once

#include <orrery/models/frames/vector.hpp>
#include <orrery/models/orbit/gravity_field.hpp>

#include <cmath>
#include <vector>

namespace orrery {

struct DirectPotential {
  long double value = 0;                // [m^2/s^2], without the central term
  long double gradient[3] = {0, 0, 0};  // ECEF [m/s^2], without the central term
};

/// Holmes & Featherstone, J. Geod. 76 (2002), eqs. 11-13 and 15, and the chain rule.
inline DirectPotential direct_potential(const GravityField& field, int degree, const Vec3& r_ECEF) {
  using Real = long double;
  const Real x = r_ECEF.x, y = r_ECEF.y, z = r_ECEF.z;
  const Real w2 = x * x + y * y, r2 = w2 + z * z, r = std::sqrt(r2), w = std::sqrt(w2);
  const Real t = z / r, u = w / r;  // sine and cosine of the latitude
  const Real lambda = std::atan2(y, x);

  std::vector<std::vector<Real>> P(degree + 2, std::vector<Real>(degree + 2, 0));
  P[0][0] = 1;
  for (int m = 1; m <= degree; ++m)
    P[m][m] = P[m - 1][m - 1] * u * std::sqrt(m == 1 ? 3.0L : (2.0L * m + 1) / (2.0L * m));
  for (int m = 0; m < degree; ++m) {
    for (int n = m + 1; n <= degree; ++n) {
      const Real a = std::sqrt((2.0L * n - 1) * (2.0L * n + 1) / (Real(n - m) * (n + m)));
      const Real b = n == m + 1 ? 0
                                : std::sqrt((2.0L * n + 1) * (n + m - 1) * (n - m - 1) /
                                            (Real(n - m) * (n + m) * (2 * n - 3)));
      P[n][m] = a * t * P[n - 1][m] - b * (n < 2 ? 0 : P[n - 2][m]);
    }
  }

  Real value = 0, d_r = 0, d_latitude = 0, d_lambda = 0;
  for (int n = 2; n <= degree; ++n) {
    const Real scale = std::pow(Real(field.radius_m()) / r, Real(n));
    for (int m = 0; m <= n; ++m) {
      const Real c = std::cos(m * lambda), s = std::sin(m * lambda);
      const Real D = field.C(n, m) * c + field.S(n, m) * s;
      const Real D_lambda = m * (field.S(n, m) * c - field.C(n, m) * s);
      // u dP/d(latitude): (1 - t^2) dP/dt = f P_(n-1)m - n t P_nm
      const Real f = std::sqrt(Real(n - m) * (n + m) * (2 * n + 1) / (2.0L * n - 1));
      const Real slope = (f * (n > m ? P[n - 1][m] : 0) - n * t * P[n][m]) / u;
      value += scale * P[n][m] * D;
      d_r -= (n + 1) * scale * P[n][m] * D / r;  // the 1 is from mu/r
      d_latitude += scale * slope * D;
      d_lambda += scale * P[n][m] * D_lambda;
    }
  }
  const Real k = Real(field.mu_m3ps2()) / r;
  DirectPotential out;
  out.value = k * value;
  d_r *= k, d_latitude *= k / r, d_lambda *= k / w;  // per metre along up, north, east
  const Real up[3] = {x / r, y / r, z / r};
  const Real north[3] = {-t * x / w, -t * y / w, u}, east[3] = {-y / w, x / w, 0};
  for (int i = 0; i < 3; ++i)
    out.gradient[i] = d_r * up[i] + d_latitude * north[i] + d_lambda * east[i];
  return out;
}

}  // namespace orrery
