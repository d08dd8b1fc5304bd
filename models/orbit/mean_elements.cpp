#include <orrery/models/orbit/mean_elements.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

// A value with its derivatives with respect to (ex, ey, u).
struct Dual {
  double value = 0;
  Vec3 slope;

  friend Dual operator+(const Dual& a, const Dual& b) {
    return {a.value + b.value, a.slope + b.slope};
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    return {a.value - b.value, a.slope - b.slope};
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, a.value * b.slope + b.value * a.slope};
  }
  friend Dual operator*(double s, const Dual& a) { return {s * a.value, s * a.slope}; }
  friend Dual operator/(const Dual& a, const Dual& b) {
    return {a.value / b.value, (a.slope - (a.value / b.value) * b.slope) / b.value};
  }
};

Dual square_root(const Dual& a) {
  const double root = std::sqrt(a.value);
  return {root, a.slope / (2 * root)};
}

// True argument of latitude as a function of the elements.
struct TrueArgument {
  Dual eta, ex, ey, sin, cos;
  Dual minus_u;  // theta - u, (-pi, pi]
};

TrueArgument true_argument(const QuasiNonsingularElements& e) {
  const OrbitPoint at = solve_kepler(e);
  TrueArgument t;
  t.ex = {e.ex, {1, 0, 0}};
  t.ey = {e.ey, {0, 1, 0}};
  t.eta = square_root(Dual{1, {}} - t.ex * t.ex - t.ey * t.ey);
  // F - ex sin F + ey cos F = u, differentiated.
  const double r_over_a = 1 - e.ex * at.cos_F - e.ey * at.sin_F;
  const Vec3 dF = Vec3{at.sin_F, -at.cos_F, 1} / r_over_a;
  const Dual sin_F{at.sin_F, at.cos_F * dF}, cos_F{at.cos_F, -at.sin_F * dF};

  const Dual one{1, {}};
  const Dual r = one - t.ex * cos_F - t.ey * sin_F;  // over a, like x and y
  const Dual k = (t.ex * sin_F - t.ey * cos_F) / (one + t.eta);
  const Dual x = cos_F - t.ex + t.ey * k, y = sin_F - t.ey - t.ex * k;
  t.cos = x / r;
  t.sin = y / r;
  const double theta = std::atan2(t.sin.value, t.cos.value);
  t.minus_u = {wrap_to_pi(theta - e.u_rad),
               t.cos.value * t.sin.slope - t.sin.value * t.cos.slope - Vec3{0, 0, 1}};
  return t;
}

// The generating function and its derivatives: S = (1/n) times the integral over M of the periodic
// part of the J2 disturbing function R (positive: R = -H1).
struct Generator {
  double S, S_a, S_i;
  Vec3 S_ex_ey_u;
};

Generator generator(const QuasiNonsingularElements& e, const OblateBody& body) {
  const TrueArgument t = true_argument(e);
  const double si = std::sin(e.i_rad), ci = std::cos(e.i_rad);
  // Equation of the centre plus e sin f; sin 2 theta + e sin(f + 2 omega) + (e/3) sin(3 f + 2
  // omega).
  const Dual A = t.minus_u + t.ex * t.sin - t.ey * t.cos;
  const Dual sin2 = 2.0 * (t.sin * t.cos), cos2 = t.cos * t.cos - t.sin * t.sin;
  const Dual sin3 = sin2 * t.cos + cos2 * t.sin, cos3 = cos2 * t.cos - sin2 * t.sin;
  const Dual B = sin2 + (t.ex * t.sin + t.ey * t.cos) + (1.0 / 3) * (t.ex * sin3 - t.ey * cos3);
  const Dual shape = (1 - 1.5 * si * si) * A + 0.75 * si * si * B;

  const double n = std::sqrt(body.mu_m3ps2 / (e.a_m * e.a_m * e.a_m));
  const double size = 0.5 * n * body.J2 * body.radius_m * body.radius_m;  // mu J2 R^2/(2 a^3 n)
  const Dual eta3 = t.eta * t.eta * t.eta;
  const Dual S = size * (shape / eta3);
  const double S_i = size / eta3.value * si * ci * (-3 * A.value + 1.5 * B.value);
  return {S.value, -1.5 * S.value / e.a_m, S_i, S.slope};
}

// {element, S}: Lagrange's planetary equations in quasi-nonsingular elements with S as the
// disturbing function. S does not depend on the node.
QuasiNonsingularElements short_period(const QuasiNonsingularElements& e, const OblateBody& body) {
  const Generator g = generator(e, body);
  const double na = std::sqrt(body.mu_m3ps2 / e.a_m);
  const double na2 = na * e.a_m;
  const double eta = std::sqrt(1 - e.ex * e.ex - e.ey * e.ey);
  const double w = eta / (1 + eta);
  const double S_ex = g.S_ex_ey_u.x, S_ey = g.S_ex_ey_u.y, S_u = g.S_ex_ey_u.z;
  const double si = std::sin(e.i_rad), cot_i = std::cos(e.i_rad) / si;
  const double turn = cot_i * g.S_i / (na2 * eta);  // -{omega, S} from the node's motion
  return {2 / na * S_u,
          -(w * e.ex * S_u + eta * S_ey) / na2 + e.ey * turn,
          -(w * e.ey * S_u - eta * S_ex) / na2 - e.ex * turn,
          cot_i * (S_u + e.ex * S_ey - e.ey * S_ex) / (na2 * eta),
          g.S_i / (na2 * eta * si),
          -2 / na * g.S_a + w * (e.ex * S_ex + e.ey * S_ey) / na2 - turn};
}

QuasiNonsingularElements plus(const QuasiNonsingularElements& x, double s,
                              const QuasiNonsingularElements& d) {
  return {x.a_m + s * d.a_m,           x.ex + s * d.ex,      x.ey + s * d.ey, x.i_rad + s * d.i_rad,
          x.raan_rad + s * d.raan_rad, x.u_rad + s * d.u_rad};
}

void require_usable(const QuasiNonsingularElements& e, const char* where) {
  to_keplerian(e);  // for its checks
  if (!(std::sin(e.i_rad) > 1e-6)) {
    throw std::invalid_argument(std::string(where) + ": inclination = " + std::to_string(e.i_rad) +
                                " rad; accepted: at least 1e-6 rad from the equator");
  }
}

}  // namespace

QuasiNonsingularElements mean_to_osculating(const QuasiNonsingularElements& mean,
                                            const OblateBody& body) {
  require_usable(mean, "mean_to_osculating");
  return plus(mean, 1, short_period(mean, body));
}

QuasiNonsingularElements osculating_to_mean(const QuasiNonsingularElements& osculating,
                                            const OblateBody& body) {
  require_usable(osculating, "osculating_to_mean");
  QuasiNonsingularElements mean = osculating;
  // The correction changes by J2 times its argument, so eight rounds leave (1e-3 or so)^8.
  for (int round = 0; round < 8; ++round) mean = plus(osculating, -1, short_period(mean, body));
  return mean;
}

SecularRates secular_rates(const QuasiNonsingularElements& e, const OblateBody& body) {
  const double n = std::sqrt(body.mu_m3ps2 / (e.a_m * e.a_m * e.a_m));
  const double eta2 = 1 - e.ex * e.ex - e.ey * e.ey;
  const double R_over_p = body.radius_m / (e.a_m * eta2);
  const double kappa = 0.75 * body.J2 * n * R_over_p * R_over_p;
  const double c = std::cos(e.i_rad);
  const double perigee = kappa * (5 * c * c - 1);
  return {-2 * kappa * c, perigee, n + kappa * std::sqrt(eta2) * (3 * c * c - 1) + perigee};
}

QuasiNonsingularElements propagate_secular(const QuasiNonsingularElements& mean, double dt_s,
                                           const OblateBody& body) {
  const SecularRates rate = secular_rates(mean, body);
  const double turn = rate.argument_of_perigee * dt_s;
  const double c = std::cos(turn), s = std::sin(turn);
  return {mean.a_m,   c * mean.ex - s * mean.ey,        s * mean.ex + c * mean.ey,
          mean.i_rad, mean.raan_rad + rate.raan * dt_s, mean.u_rad + rate.u * dt_s};
}

}  // namespace orrery
