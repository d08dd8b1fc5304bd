#include <orrery/models/gnss/broadcast_orbit.hpp>
#include <orrery/models/gnss/gps_constants.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace orrery {
namespace {

// PRN 2 of 2010-07-01 00:00, with harmonics, as the IGS's merged navigation file has it.
BroadcastEphemeris real_ephemeris() {
  BroadcastEphemeris e;
  e.prn = 2;
  e.week = 1590;
  e.toe_s = e.toc_s = 345600;
  e.sqrt_a_sqrtm = 0.515359739113e4;
  e.eccentricity = 0.960697804112e-2;
  e.i0_rad = 0.939349150611;
  e.raan0_rad = -0.127458719764e1;
  e.argument_of_perigee_rad = 0.309739903949e1;
  e.mean_anomaly_rad = 0.165772167412e1;
  e.delta_n_radps = 0.525557597442e-8;
  e.raan_rate_radps = -0.838784952606e-8;
  e.i_rate_radps = -0.232152526369e-10;
  e.cuc_rad = 0.232271850109e-5;
  e.cus_rad = 0.617466866970e-5;
  e.crc_m = 0.249937500000e3;
  e.crs_m = 0.414375e2;
  e.cic_rad = -0.558793544769e-7;
  e.cis_rad = 0.167638063431e-6;
  e.af0_s = 0.269108917564e-3;
  e.af1_sps = 0.318323145621e-11;
  return e;
}

// The same definition put differently: Kepler's equation by bisection, angles as successive
// rotations of (r, 0, 0), the Earth's turn counted from the start of the week.
Vec3 rotated_x(double r, double u, double i, double node) {
  Vec3 p{r * std::cos(u), r * std::sin(u), 0};
  p = {p.x, std::cos(i) * p.y, std::sin(i) * p.y};
  return {std::cos(node) * p.x - std::sin(node) * p.y, std::sin(node) * p.x + std::cos(node) * p.y,
          p.z};
}

Vec3 by_rotations(const BroadcastEphemeris& e, double second_of_week) {
  const double a = e.sqrt_a_sqrtm * e.sqrt_a_sqrtm, tk = second_of_week - e.toe_s;
  const double M =
      std::fmod(e.mean_anomaly_rad + (std::sqrt(3.986005e14 / (a * a * a)) + e.delta_n_radps) * tk,
                2 * std::numbers::pi);
  double low = M - 1, high = M + 1;
  for (int k = 0; k < 60; ++k) {
    const double E = (low + high) / 2;
    (E - e.eccentricity * std::sin(E) < M ? low : high) = E;
  }
  const double half_E = (low + high) / 4;
  const double v =
      2 * std::atan(std::sqrt((1 + e.eccentricity) / (1 - e.eccentricity)) * std::tan(half_E));
  const double phi = v + e.argument_of_perigee_rad;
  const double p = a * (1 - e.eccentricity * e.eccentricity);
  const double r = p / (1 + e.eccentricity * std::cos(v)) + e.crc_m * std::cos(2 * phi) +
                   e.crs_m * std::sin(2 * phi);
  const double u = phi + e.cuc_rad * std::cos(2 * phi) + e.cus_rad * std::sin(2 * phi);
  const double i = e.i0_rad + e.i_rate_radps * tk + e.cic_rad * std::cos(2 * phi) +
                   e.cis_rad * std::sin(2 * phi);
  const double node = e.raan0_rad + e.raan_rate_radps * tk - 7.2921151467e-5 * second_of_week;
  return rotated_x(r, u, i, node);
}

// Rounding of angles of some 30 rad at 26 600 km: 4e-15 * 2.7e7 = 1e-7 m. Seen: 6e-8 m.
TEST(BroadcastOrbitTest, PositionIsThatOfSuccessiveRotations) {
  const BroadcastEphemeris e = real_ephemeris();
  for (int k = -24; k <= 24; ++k) {
    const double s = e.toe_s + 300 * k;
    EXPECT_LT(norm(broadcast_state(e, gps::from_week(1590, s)).r_ECEF - by_rotations(e, s)), 5e-7);
  }
}

// Central differences over 2 x 1 s: truncation h^2/6 times the third derivative, at most 2.7e7 m
// (2.2e-4/s)^3 = 3e-4 m/s^3, so 5e-5 m/s for the velocity (seen 1.4e-5) and 1e-8 for the
// acceleration (seen 3e-9).
TEST(BroadcastOrbitTest, DerivativesAreThoseOfThePosition) {
  const BroadcastEphemeris e = real_ephemeris();
  for (int k = 0; k < 40; ++k) {
    const SimTime t = time_of_ephemeris(e) + k * 300s - 1h;
    const SatelliteState before = broadcast_state(e, t - 1s), now = broadcast_state(e, t),
                         after = broadcast_state(e, t + 1s);
    EXPECT_LT(norm((after.r_ECEF - before.r_ECEF) / 2 - now.v_ECEF), 5e-5);
    EXPECT_LT(norm((after.v_ECEF - before.v_ECEF) / 2 - now.a_ECEF), 1e-8);
    // The clock's: 46 ns (1.5e-4/s)^3 / 6 = 3e-20, beside rounding of 3e-4 s, 5e-20 s.
    EXPECT_NEAR((after.clock_s - before.clock_s) / 2, now.clock_rate_sps, 2e-19);
    EXPECT_NEAR((after.clock_rate_sps - before.clock_rate_sps) / 2, now.clock_acceleration_sps2,
                1e-21);
  }
}

// IS-GPS-200, 20.3.3.3.3.1: the relativistic part equals -2 r.v/c^2 of the inertial motion on an
// ellipse; the harmonics change r by 1e-5 of itself and so its rate: seen 3e-12 s of 2e-8 s.
TEST(BroadcastOrbitTest, RelativityIsThatOfPositionTimesVelocity) {
  const BroadcastEphemeris e = real_ephemeris();
  for (int k = 0; k < 40; ++k) {
    const SimTime t = time_of_ephemeris(e) + k * 300s - 1h;
    const SatelliteState s = broadcast_state(e, t);
    const double polynomial = e.af0_s + e.af1_sps * to_seconds(t - time_of_ephemeris(e));
    const double c = 299792458;
    EXPECT_NEAR(s.clock_s - polynomial, -2 * dot(s.r_ECEF, s.v_ECEF) / (c * c), 3e-10);
  }
}

// The last second of the week and the first of the next: no fold, the satellite moves on. In 1 us
// it makes 3.9 mm at most.
TEST(BroadcastOrbitTest, EndOfTheWeekIsNoStep) {
  BroadcastEphemeris e = real_ephemeris();
  e.toe_s = e.toc_s = 597600;
  const SimTime end = gps::from_week(1591, 0);
  const SatelliteState before = broadcast_state(e, end - 500ns),
                       after = broadcast_state(e, end + 500ns);
  EXPECT_NEAR(norm(after.r_ECEF - before.r_ECEF), 1e-6 * norm(before.v_ECEF), 1e-7);
  // Half a week away, where the message's user would have to fold.
  EXPECT_LT(norm(broadcast_state(e, end + 302400s).r_ECEF - by_rotations(e, 604800 + 302400)),
            5e-6);
}

TEST(BroadcastOrbitTest, KeplersEquationHoldsForEveryAnomaly) {
  for (const double e : {0.0, 0.01, 0.1, 0.49}) {
    for (double M = -10; M < 10; M += 0.37) {
      const double E = eccentric_anomaly_rad(M, e);
      EXPECT_NEAR(std::remainder(E - e * std::sin(E) - M, 2 * std::numbers::pi), 0, 4e-15);
    }
  }
}

}  // namespace
}  // namespace orrery
