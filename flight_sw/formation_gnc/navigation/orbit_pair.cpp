#include "formation_gnc/navigation/orbit_pair.hpp"

#include <cmath>

#include "formation_gnc/navigation/flight_gravity.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::kMuEarth_m3ps2;
using flight_support::kSecond_ns;
using flight_support::seconds;

constexpr std::int64_t kEarthGrid_ns = 120 * kSecond_ns;

void push(Vec3* a, double s, const Vec3& b) {
  for (int k = 0; k < 3; ++k) (*a)[k] += s * b[k];
}

// One step h of Nystroem's method: r'' = a(t, r).
void nystroem_step(OrbitPair* pair, const Mat3 R_IE[3], double h, int degree) {
  Vec3 a1[2], a2[2], a3[2], r[2];
  gravity_ECI(R_IE[0], degree, pair->r, a1);
  for (int k = 0; k < 2; ++k) {
    r[k] = pair->r[k];
    push(&r[k], h / 2, pair->v[k]);
    push(&r[k], h * h / 8, a1[k]);
  }
  gravity_ECI(R_IE[1], degree, r, a2);
  for (int k = 0; k < 2; ++k) {
    r[k] = pair->r[k];
    push(&r[k], h, pair->v[k]);
    push(&r[k], h * h / 2, a2[k]);
  }
  gravity_ECI(R_IE[2], degree, r, a3);
  for (int k = 0; k < 2; ++k) {
    push(&pair->r[k], h, pair->v[k]);
    push(&pair->r[k], h * h / 6, a1[k] + 2.0 * a2[k]);
    push(&pair->v[k], h / 6, a1[k] + 4.0 * a2[k] + a3[k]);
  }
}

// P = (a b) with unit upper triangular factor of a symmetric 3x3 by (r, v, a).
struct Factor3 {
  double rv, ra, va, d[3];
};

Factor3 factor(double rr, double rv, double ra, double vv, double va, double aa) {
  Factor3 f;
  f.d[2] = aa;
  f.ra = ra / aa;
  f.va = va / aa;
  f.d[1] = vv - f.va * va;
  f.rv = (rv - f.ra * va) / f.d[1];
  f.d[0] = rr - f.ra * ra - f.rv * f.rv * f.d[1];
  return f;
}

// Covariance of (r, v, a) that white noise of density q builds up in a = -a/tau + w over dt, by
// series in x = dt/tau where the closed form would cancel: three terms of each, good to 1e-3 at
// x = 0.3. White acceleration of its own density is added.
Factor3 integrated_noise(double dt_s, double sigma_mps2, double tau_s, double white) {
  const double q = 2.0 * sigma_mps2 * sigma_mps2 / tau_s;
  const double t = dt_s, x = dt_s / tau_s;
  const double aa = -sigma_mps2 * sigma_mps2 * std::expm1(-2.0 * x);
  const double va = q * t * t * (1.0 / 2 - x * (1.0 / 2 - x * (7.0 / 24)));
  const double ra = q * t * t * t * (1.0 / 6 - x * (1.0 / 6 - x * (11.0 / 120)));
  const double vv = white * t + q * t * t * t * (1.0 / 3 - x * (1.0 / 4 - x * (7.0 / 60)));
  const double rv = t * t * (white / 2 + q * t * t * (1.0 / 8 - x * (1.0 / 12 - x * (5.0 / 144))));
  const double rr =
      t * t * t * (white / 3 + q * t * t * (1.0 / 20 - x * (1.0 / 36 - x * (5.0 / 504))));
  return factor(rr, rv, ra, vv, va, aa);
}

}  // namespace

Mat3 EarthAttitude::ecef_to_eci(std::int64_t t_ns, const flight_support::EarthTime& earth_time) {
  const std::int64_t base_ns = t_ns - t_ns % kEarthGrid_ns;
  if (base_ns != base_ns_) {
    base_ = flight_support::ecef_to_eci(base_ns, earth_time);
    base_ns_ = base_ns;
  }
  return turned_with_earth(base_, seconds(t_ns - base_ns));
}

Mat3 turned_with_earth(const Mat3& R_IE, double dt_s) {
  const double angle = flight_support::kEarthRotation_radps * dt_s;
  const double c = std::cos(angle), s = std::sin(angle);
  Mat3 R;
  for (int r = 0; r < 3; ++r) {
    R(r, 0) = R_IE(r, 0) * c + R_IE(r, 1) * s;
    R(r, 1) = R_IE(r, 1) * c - R_IE(r, 0) * s;
    R(r, 2) = R_IE(r, 2);
  }
  return R;
}

Mat3 rtn_to_eci(const Vec3& r, const Vec3& v) {
  const Vec3 R = (1.0 / norm(r)) * r;
  const Vec3 h = cross(r, v);
  const Vec3 N = (1.0 / norm(h)) * h;
  const Vec3 T = cross(N, R);
  Mat3 R_IH;
  for (int k = 0; k < 3; ++k) {
    R_IH(k, 0) = R[k];
    R_IH(k, 1) = T[k];
    R_IH(k, 2) = N[k];
  }
  return R_IH;
}

void gravity_ECI(const Mat3& R_IE, int degree, const Vec3 r[2], Vec3 a[2]) {
  const Mat3 R_EI = transpose(R_IE);
  const Vec3 r_ECEF[2] = {R_EI * r[0], R_EI * r[1]};
  Vec3 a_ECEF[2];
  gravity_ECEF(degree, r_ECEF, a_ECEF);
  for (int k = 0; k < 2; ++k) a[k] = R_IE * a_ECEF[k];
}

void coast(OrbitPair* pair, std::int64_t t_ns, double dt_s, const OrbitPairOptions& options,
           EarthAttitude* earth) {
  const int steps = static_cast<int>(std::ceil(std::fabs(dt_s) / options.longest_step_s));
  const double h = steps > 0 ? dt_s / steps : 0.0;
  for (int k = 0; k < steps; ++k) {
    Mat3 R_IE[3];
    for (int stage = 0; stage < 3; ++stage) {
      const double after_s = h * (k + 0.5 * stage);
      R_IE[stage] =
          earth->ecef_to_eci(t_ns + flight_support::nanoseconds(after_s), options.earth_time);
    }
    nystroem_step(pair, R_IE, h, options.gravity_degree);
  }
}

Mat3 gravity_gradient(const Vec3& r) {
  constexpr double R = flight_support::kRadiusEarth_m;
  constexpr double k = 1.5 * flight_support::kJ2 * kMuEarth_m3ps2 * R * R;
  const double r2 = dot(r, r), r3 = r2 * std::sqrt(r2), r5 = r2 * r3;
  const double z = r[2], s = z * z / r2;
  Mat3 G;
  for (int i = 0; i < 3; ++i) {
    const double iz = i == 2 ? 1.0 : 0.0;
    const double a_i = (1.0 - 5.0 * s) * r[i] + 2.0 * z * iz;  // of J2, less -k / r^5
    for (int j = 0; j < 3; ++j) {
      const double ij = i == j ? 1.0 : 0.0, jz = j == 2 ? 1.0 : 0.0;
      const double central = kMuEarth_m3ps2 / r3 * (3.0 * r[i] * r[j] / r2 - ij);
      const double slope = (1.0 - 5.0 * s) * ij - 10.0 * r[i] * (z * jz - s * r[j]) / r2 +
                           2.0 * iz * jz - 5.0 * a_i * r[j] / r2;
      G(i, j) = central - k / r5 * slope;
    }
  }
  return G;
}

OrbitTransition orbit_transition(const Vec3& r_middle, const Vec3& v_middle, double dt_s,
                                 const Vec3& tau_s) {
  const Mat3 G = gravity_gradient(r_middle), GG = G * G, one = flight_support::identity<3>();
  const double dt2 = dt_s * dt_s;
  OrbitTransition t;
  t.rr = one + (dt2 / 2) * G + (dt2 * dt2 / 24) * GG;
  t.rv = dt_s * (one + (dt2 / 6) * G + (dt2 * dt2 / 120) * GG);
  t.vr = dt_s * (G + (dt2 / 6) * GG);
  t.vv = t.rr;
  return with_time_constants(t, rtn_to_eci(r_middle, v_middle), dt_s, tau_s);
}

OrbitTransition with_time_constants(const OrbitTransition& transition, const Mat3& R_IH,
                                    double dt_s, const Vec3& tau_s) {
  OrbitTransition t = transition;
  for (int axis = 0; axis < 3; ++axis) {
    const double tau = tau_s[axis], x = dt_s / tau, m1 = -std::expm1(-x);
    t.aa[axis] = 1.0 - m1;
    for (int k = 0; k < 3; ++k) {
      t.va(k, axis) = tau * m1 * R_IH(k, axis);
      t.ra(k, axis) = tau * tau * (x - m1) * R_IH(k, axis);
    }
  }
  return t;
}

OrbitNoise orbit_noise(const Mat3& R_IH, double dt_s, const EmpiricalAcceleration& empirical) {
  const double sign = dt_s < 0.0 ? -1.0 : 1.0;
  OrbitNoise noise = {};
  for (int axis = 0; axis < 3; ++axis) {
    const Factor3 f = integrated_noise(std::fabs(dt_s), empirical.sigma_mps2[axis],
                                       empirical.tau_s[axis], empirical.white_m2ps3[axis]);
    double(&r)[9] = noise.column[axis], (&v)[9] = noise.column[3 + axis],
    (&a)[9] = noise.column[6 + axis];
    for (int k = 0; k < 3; ++k) {
      r[k] = R_IH(k, axis);
      v[k] = sign * f.rv * R_IH(k, axis);
      v[3 + k] = R_IH(k, axis);
      a[k] = f.ra * R_IH(k, axis);
      a[3 + k] = sign * f.va * R_IH(k, axis);
    }
    a[6 + axis] = 1.0;
    for (int k = 0; k < 3; ++k) noise.weight[3 * k + axis] = f.d[k];
  }
  return noise;
}

}  // namespace formation_gnc
