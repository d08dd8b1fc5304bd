#include <orrery/models/gnss/broadcast_orbit.hpp>
#include <orrery/models/gnss/gps_constants.hpp>

#include <cmath>
#include <numbers>

namespace orrery {
namespace {

using gps::kMu_m3ps2;
using gps::kOmegaEarth_radps;

/// A quantity with its first two derivatives in time.
struct Jet {
  double x = 0, d = 0, dd = 0;
};

/// Cosine and sine of an angle: where an angle is a sum, they are had from those of its parts.
struct Turn {
  double c = 1, s = 0;
};

Turn turn(double angle_rad) {
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

Turn sum(const Turn& a, const Turn& b) {
  return {a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s};
}

constexpr double kSmallAngle_rad = 2e-3;

/// Of a and a small angle: the series leave d^6/720 and d^7/5040, below 1e-18 to kSmallAngle_rad.
Turn advanced(const Turn& a, double d_rad) {
  if (std::abs(d_rad) > kSmallAngle_rad) return sum(a, turn(d_rad));
  const double d2 = d_rad * d_rad;
  return sum(a, {1 - d2 * (0.5 - d2 * (1.0 / 24)), d_rad - d_rad * d2 * (1.0 / 6 - d2 / 120)});
}

struct EccentricAnomaly {
  double rad;
  Turn turn;
};

/// Newton's iteration, whose steps after the first are small.
EccentricAnomaly solve_kepler(double mean_anomaly_rad, double e) {
  const double M = std::remainder(mean_anomaly_rad, 2 * std::numbers::pi);
  EccentricAnomaly E{M + e * std::sin(M), {}};
  E.turn = turn(E.rad);
  for (int i = 0; i < 12; ++i) {
    const double step = (M - E.rad + e * E.turn.s) / (1 - e * E.turn.c);
    E.rad += step;
    E.turn = advanced(E.turn, step);
    if (std::abs(step) < 1e-9) break;  // converges quadratically: what is left is below 1e-16
  }
  return E;
}

/// What an angle phi(t) makes of c cos 2phi + s sin 2phi.
Jet second_harmonic(const Jet& phi, const Turn& two_phi, double c, double s) {
  const double x = c * two_phi.c + s * two_phi.s;
  const double slope = 2 * (s * two_phi.c - c * two_phi.s);  // d/dphi
  return {x, slope * phi.d, slope * phi.dd - 4 * x * phi.d * phi.d};
}

/// The ellipse: eccentric anomaly, radius, true anomaly (of which the angle is left to `turn_v`).
struct Ellipse {
  Jet E, r, v;
  Turn turn_v;
  double sin_E, cos_E;
};

Ellipse ellipse(double M_rad, double n_radps, double a_m, double e) {
  Ellipse o;
  const EccentricAnomaly E = solve_kepler(M_rad, e);
  o.E.x = E.rad;
  o.sin_E = E.turn.s, o.cos_E = E.turn.c;
  const double q = 1 - e * o.cos_E, eta = std::sqrt(1 - e * e);
  o.E.d = n_radps / q;
  o.E.dd = -e * o.sin_E * o.E.d * o.E.d / q;
  o.r = {a_m * q, a_m * e * o.sin_E * o.E.d,
         a_m * e * (o.cos_E * o.E.d * o.E.d + o.sin_E * o.E.dd)};
  o.turn_v = {(o.cos_E - e) / q, eta * o.sin_E / q};
  o.v.d = eta * o.E.d / q;
  o.v.dd = eta * (o.E.dd - e * o.sin_E * o.E.d * o.E.d / q) / q;
  return o;
}

/// In the plane of the node: x towards it, z along the pole of the Earth.
struct NodeFrame {
  Vec3 r, v, a;
};

NodeFrame in_node_frame(const Jet& r, const Turn& turn_u, const Jet& u, const Jet& i) {
  const double cu = turn_u.c, su = turn_u.s, ci = std::cos(i.x), si = std::sin(i.x);
  const Jet x{r.x * cu, r.d * cu - r.x * su * u.d,
              r.dd * cu - 2 * r.d * su * u.d - r.x * (cu * u.d * u.d + su * u.dd)};
  const Jet y{r.x * su, r.d * su + r.x * cu * u.d,
              r.dd * su + 2 * r.d * cu * u.d + r.x * (cu * u.dd - su * u.d * u.d)};
  const double bend = ci * i.d * i.d + si * i.dd, lift = ci * i.dd - si * i.d * i.d;
  return {{x.x, y.x * ci, y.x * si},
          {x.d, y.d * ci - y.x * si * i.d, y.d * si + y.x * ci * i.d},
          {x.dd, y.dd * ci - 2 * y.d * si * i.d - y.x * bend,
           y.dd * si + 2 * y.d * ci * i.d + y.x * lift}};
}

/// Turned by the node's longitude, which itself moves at `rate`.
void to_ECEF(const NodeFrame& p, double longitude_rad, double rate_radps, SatelliteState& out) {
  const double c = std::cos(longitude_rad), s = std::sin(longitude_rad);
  const auto turned = [c, s](const Vec3& f) -> Vec3 {
    return {c * f.x - s * f.y, s * f.x + c * f.y, f.z};
  };
  const Vec3 w{0, 0, rate_radps};
  const Vec3 drag = cross(w, p.r);
  out.r_ECEF = turned(p.r);
  out.v_ECEF = turned(p.v + drag);
  out.a_ECEF = turned(p.a + 2 * cross(w, p.v) + cross(w, drag));
}

void set_clock(const BroadcastEphemeris& eph, double dt_s, const Ellipse& o, SatelliteState& out) {
  const double f = gps::kRelativity_spsqrtm * eph.eccentricity * eph.sqrt_a_sqrtm;
  out.clock_s = eph.af0_s + dt_s * (eph.af1_sps + dt_s * eph.af2_sps2) + f * o.sin_E;
  out.clock_rate_sps = eph.af1_sps + 2 * eph.af2_sps2 * dt_s + f * o.cos_E * o.E.d;
  out.clock_acceleration_sps2 = 2 * eph.af2_sps2 + f * (o.cos_E * o.E.dd - o.sin_E * o.E.d * o.E.d);
}

}  // namespace

double eccentric_anomaly_rad(double mean_anomaly_rad, double eccentricity) {
  return solve_kepler(mean_anomaly_rad, eccentricity).rad;
}

SimTime time_of_ephemeris(const BroadcastEphemeris& eph) {
  return gps::from_week(eph.week, eph.toe_s);
}

SatelliteState broadcast_state(const BroadcastEphemeris& eph, SimTime t) {
  const double tk = to_seconds(t - time_of_ephemeris(eph));
  const double a_m = eph.sqrt_a_sqrtm * eph.sqrt_a_sqrtm;
  const double n = std::sqrt(kMu_m3ps2 / (a_m * a_m * a_m)) + eph.delta_n_radps;
  const Ellipse o = ellipse(eph.mean_anomaly_rad + n * tk, n, a_m, eph.eccentricity);

  const Turn turn_phi = sum(o.turn_v, turn(eph.argument_of_perigee_rad));
  const Turn two_phi = sum(turn_phi, turn_phi);
  const Jet phi{0, o.v.d, o.v.dd};  // the argument of latitude is only needed as a turn
  const Jet du = second_harmonic(phi, two_phi, eph.cuc_rad, eph.cus_rad);
  const Jet dr = second_harmonic(phi, two_phi, eph.crc_m, eph.crs_m);
  const Jet di = second_harmonic(phi, two_phi, eph.cic_rad, eph.cis_rad);
  const Jet u{0, phi.d + du.d, phi.dd + du.dd};
  const Jet r{o.r.x + dr.x, o.r.d + dr.d, o.r.dd + dr.dd};
  const Jet i{eph.i0_rad + eph.i_rate_radps * tk + di.x, eph.i_rate_radps + di.d, di.dd};

  SatelliteState out;
  const double rate = eph.raan_rate_radps - kOmegaEarth_radps;
  to_ECEF(in_node_frame(r, advanced(turn_phi, du.x), u, i),
          eph.raan0_rad + rate * tk - kOmegaEarth_radps * eph.toe_s, rate, out);
  set_clock(eph, to_seconds(t - gps::from_week(eph.week, eph.toc_s)), o, out);
  return out;
}

}  // namespace orrery
