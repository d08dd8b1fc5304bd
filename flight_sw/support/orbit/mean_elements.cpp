#include "mean_elements.hpp"

#include <cmath>

#include "constants.hpp"

namespace flight_support {
namespace {

// Where in the orbit: theta is the true argument of latitude.
struct InPlane {
  double sin_theta, cos_theta, r_m;
};

// Kepler's equation F - ex sin F + ey cos F = u for the eccentric argument of latitude F.
double eccentric_argument_rad(double u_rad, double ex, double ey) {
  double f = u_rad;
  for (int iteration = 0; iteration < 10; ++iteration) {
    const double s = std::sin(f), c = std::cos(f);
    const double step = (f - ex * s + ey * c - u_rad) / (1.0 - ex * c - ey * s);
    f -= step;
    if (std::fabs(step) < 1e-14) break;
  }
  return f;
}

InPlane in_plane(const OrbitElements& e, double sin_F, double cos_F) {
  const double beta = 1.0 / (1.0 + std::sqrt(1.0 - e.ex * e.ex - e.ey * e.ey));
  const double x = (1.0 - beta * e.ey * e.ey) * cos_F + beta * e.ex * e.ey * sin_F - e.ex;
  const double y = (1.0 - beta * e.ex * e.ex) * sin_F + beta * e.ex * e.ey * cos_F - e.ey;
  const double r = 1.0 - e.ex * cos_F - e.ey * sin_F;
  return {y / r, x / r, e.a_m * r};
}

InPlane in_plane(const OrbitElements& e) {
  const double f = eccentric_argument_rad(e.u_rad, e.ex, e.ey);
  return in_plane(e, std::sin(f), std::cos(f));
}

constexpr int kPoints = 16;
// sin(2 pi j / 16)
constexpr double kS1 = 0.38268343236508977, kS2 = 0.70710678118654752, kS3 = 0.92387953251128676;
constexpr double kSine[kPoints] = {0, kS1,  kS2,  kS3,  1,  kS3,  kS2,  kS1,
                                   0, -kS1, -kS2, -kS3, -1, -kS3, -kS2, -kS1};

// Integration along the orbit as a sum over its points. Let g(u) be a periodic function with the
// harmonics c_k. Then the integral over u' of g(u') single(u - u') is the zero-mean integral of g
// at u, which has the harmonics c_k / (ik), and twice() gives that of the integral once more.
// Harmonics above kPoints/2 - 1 are left out: the sum could not tell them from lower ones.
struct IntegrationKernel {
  double single, twice;
};
IntegrationKernel integration_kernel(double x_rad) {
  const double c1 = std::cos(x_rad), s1 = std::sin(x_rad);
  double c = c1, s = s1;
  IntegrationKernel sum{0.0, 0.0};
  for (int k = 1; k < kPoints / 2; ++k) {
    sum.single += s / k;
    sum.twice -= c / (static_cast<double>(k) * k);
    const double next_c = c * c1 - s * s1;
    s = s * c1 + c * s1;
    c = next_c;
  }
  return {2.0 / kPoints * sum.single, 2.0 / kPoints * sum.twice};
}

// Acceleration by J2 in the orbit's own RTN [m/s^2].
Vec3 j2_acceleration_RTN(const InPlane& at, double sin_i, double cos_i) {
  const double q = kRadiusEarth_m / at.r_m;
  const double scale = -1.5 * kJ2 * kMuEarth_m3ps2 / (at.r_m * at.r_m) * q * q;
  const double s = at.sin_theta, c = at.cos_theta;
  return vec3(scale * (1.0 - 3.0 * sin_i * sin_i * s * s), scale * 2.0 * sin_i * sin_i * s * c,
              scale * 2.0 * sin_i * cos_i * s);
}

// Gauss's equations in these elements, per radian of u: Roscoe et al. (2015), with the mean
// motion's own part of u' left out.
OrbitElements gauss_rates_per_radian(const OrbitElements& e, const Vec3& f_RTN, const InPlane& at,
                                     double sin_i, double cos_i) {
  const double eta2 = 1.0 - e.ex * e.ex - e.ey * e.ey;
  const double eta = std::sqrt(eta2);
  const double p = e.a_m * eta2;
  const double h = std::sqrt(kMuEarth_m3ps2 * p);
  const double r_m = at.r_m, s = at.sin_theta, c = at.cos_theta;
  const double e_cos_nu = p / r_m - 1.0;
  const double e_sin_nu = e.ex * s - e.ey * c;
  const double cot_i = cos_i / sin_i;
  const double per_radian = 1.0 / (h * mean_motion_radps(e.a_m));
  const double normal = r_m * f_RTN[2] * per_radian;
  const double radial = f_RTN[0] * per_radian;
  const double along = f_RTN[1] * per_radian;

  OrbitElements rate;
  rate.a_m = 2.0 * e.a_m * e.a_m * (e_sin_nu * radial + p / r_m * along);
  rate.ex = p * s * radial + ((p + r_m) * c + r_m * e.ex) * along + e.ey * s * cot_i * normal;
  rate.ey = -p * c * radial + ((p + r_m) * s + r_m * e.ey) * along - e.ex * s * cot_i * normal;
  rate.i_rad = c * normal;
  rate.raan_rad = s / sin_i * normal;
  rate.u_rad = -2.0 * r_m * eta * radial - s * cot_i * normal +
               (-p * e_cos_nu * radial + (p + r_m) * e_sin_nu * along) / (1.0 + eta);
  return rate;
}

void add_scaled(OrbitElements* sum, double factor, const OrbitElements& term) {
  sum->a_m += factor * term.a_m;
  sum->u_rad += factor * term.u_rad;
  sum->ex += factor * term.ex;
  sum->ey += factor * term.ey;
  sum->i_rad += factor * term.i_rad;
  sum->raan_rad += factor * term.raan_rad;
}

// Osculating less mean elements, at the mean elements. The points are equally spaced in the
// eccentric argument of latitude, which spares Kepler's equation; du = (1 - ex cos F - ey sin F)
// dF.
OrbitElements short_period_variation(const OrbitElements& mean) {
  const double sin_i = std::sin(mean.i_rad), cos_i = std::cos(mean.i_rad);
  OrbitElements variation;
  for (int j = 0; j < kPoints; ++j) {
    const double F = kTwoPi * j / kPoints;
    const double s = kSine[j], c = kSine[(j + kPoints / 4) % kPoints];
    const InPlane at = in_plane(mean, s, c);
    const Vec3 f_RTN = j2_acceleration_RTN(at, sin_i, cos_i);
    const OrbitElements rate = gauss_rates_per_radian(mean, f_RTN, at, sin_i, cos_i);
    const double u = F - mean.ex * s + mean.ey * c;
    const double weight = at.r_m / mean.a_m;
    const IntegrationKernel kernel = integration_kernel(mean.u_rad - u);
    add_scaled(&variation, weight * kernel.single, rate);
    // A longer semi-major axis slows the mean motion: dn/n = -3/2 da/a, integrated once more.
    variation.u_rad += -1.5 * rate.a_m / mean.a_m * weight * kernel.twice;
  }
  return variation;
}

}  // namespace

double wrap_two_pi(double angle_rad) {
  const double wrapped = std::fmod(angle_rad, kTwoPi);
  return wrapped < 0.0 ? wrapped + kTwoPi : wrapped;
}

double wrap_pi(double angle_rad) {
  return wrap_two_pi(angle_rad + kPi) - kPi;
}

double mean_motion_radps(double a_m) {
  return std::sqrt(kMuEarth_m3ps2 / a_m) / a_m;
}

double true_argument_of_latitude_rad(const OrbitElements& elements) {
  const InPlane at = in_plane(elements);
  return std::atan2(at.sin_theta, at.cos_theta);
}

OrbitElements osculating_from_state(const StateEci& state) {
  const Vec3& r = state.r_ECI;
  const Vec3& v = state.v_ECI;
  const double r_m = norm(r);
  const Vec3 h = cross(r, v);
  const Vec3 normal = (1.0 / norm(h)) * h;
  const double node = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1]);

  OrbitElements e;
  e.i_rad = std::atan2(node, normal[2]);
  e.raan_rad = wrap_two_pi(std::atan2(normal[0], -normal[1]));
  e.a_m = 1.0 / (2.0 / r_m - dot(v, v) / kMuEarth_m3ps2);
  const Vec3 to_node = vec3(std::cos(e.raan_rad), std::sin(e.raan_rad), 0.0);
  const Vec3 ahead = cross(normal, to_node);
  const Vec3 eccentricity = (1.0 / kMuEarth_m3ps2) * cross(v, h) - (1.0 / r_m) * r;
  e.ex = dot(eccentricity, to_node);
  e.ey = dot(eccentricity, ahead);

  const double eta = std::sqrt(1.0 - e.ex * e.ex - e.ey * e.ey);
  const double beta = 1.0 / (1.0 + eta);
  const double x = dot(r, to_node) / e.a_m, y = dot(r, ahead) / e.a_m;
  const double c = e.ex + ((1.0 - beta * e.ex * e.ex) * x - beta * e.ex * e.ey * y) / eta;
  const double s = e.ey + ((1.0 - beta * e.ey * e.ey) * y - beta * e.ex * e.ey * x) / eta;
  e.u_rad = wrap_two_pi(std::atan2(s, c) - e.ex * s + e.ey * c);
  return e;
}

StateEci state_from_osculating(const OrbitElements& e) {
  const InPlane at = in_plane(e);
  const Vec3 to_node = vec3(std::cos(e.raan_rad), std::sin(e.raan_rad), 0.0);
  const Vec3 ahead = vec3(-std::cos(e.i_rad) * std::sin(e.raan_rad),
                          std::cos(e.i_rad) * std::cos(e.raan_rad), std::sin(e.i_rad));
  const double s = at.sin_theta, c = at.cos_theta;
  const double speed = std::sqrt(kMuEarth_m3ps2 / (e.a_m * (1.0 - e.ex * e.ex - e.ey * e.ey)));
  return {at.r_m * c * to_node + at.r_m * s * ahead,
          -speed * (e.ey + s) * to_node + speed * (e.ex + c) * ahead};
}

OrbitElements osculating_from_mean(const OrbitElements& mean) {
  OrbitElements osculating = mean;
  add_scaled(&osculating, 1.0, short_period_variation(mean));
  osculating.u_rad = wrap_two_pi(osculating.u_rad);
  osculating.raan_rad = wrap_two_pi(osculating.raan_rad);
  return osculating;
}

// Fixed point: the variation changes by 1e-3 of an error in where it is evaluated, so each round
// takes three digits off its kilometres.
OrbitElements mean_from_osculating(const OrbitElements& osculating) {
  OrbitElements mean = osculating;
  for (int round = 0; round < 3; ++round) {
    const OrbitElements variation = short_period_variation(mean);
    mean = osculating;
    add_scaled(&mean, -1.0, variation);
  }
  mean.u_rad = wrap_two_pi(mean.u_rad);
  mean.raan_rad = wrap_two_pi(mean.raan_rad);
  return mean;
}

SecularRates secular_rates(const OrbitElements& mean) {
  const double eta2 = 1.0 - mean.ex * mean.ex - mean.ey * mean.ey;
  const double n = mean_motion_radps(mean.a_m);
  const double q = kRadiusEarth_m / mean.a_m;
  const double kappa = 0.75 * kJ2 * q * q * n / (eta2 * eta2);
  const double c = std::cos(mean.i_rad);
  const double perigee = kappa * (5.0 * c * c - 1.0);
  const double m = n + kappa * std::sqrt(eta2) * (3.0 * c * c - 1.0);
  return {m + perigee, perigee, -2.0 * kappa * c};
}

OrbitElements propagate_mean(const OrbitElements& mean, double dt_s) {
  const SecularRates rates = secular_rates(mean);
  const double c = std::cos(rates.perigee_radps * dt_s), s = std::sin(rates.perigee_radps * dt_s);
  OrbitElements later = mean;
  later.u_rad = wrap_two_pi(mean.u_rad + rates.u_radps * dt_s);
  later.raan_rad = wrap_two_pi(mean.raan_rad + rates.raan_radps * dt_s);
  later.ex = mean.ex * c - mean.ey * s;
  later.ey = mean.ex * s + mean.ey * c;
  return later;
}

}  // namespace flight_support
