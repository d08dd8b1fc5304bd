#include <orrery/models/gnss/constellation.hpp>
#include <orrery/models/gnss/lnav.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace orrery {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const SimTime kEpoch = gps_midnight(2025, 3, 20);

GpsConstellation make(GpsConstellationOptions options = {}, std::uint64_t seed = 1,
                      SimTime epoch = kEpoch) {
  RandomStreams streams(seed);
  return GpsConstellation(options, epoch, streams);
}

/// Components of a small ECEF vector in the satellite's RTN.
Vec3 in_RTN(const Vec3& d, const SatelliteState& s) {
  const Vec3 v = s.v_ECEF + cross(Vec3{0, 0, 7.2921151467e-5}, s.r_ECEF);
  const Vec3 R = unit(s.r_ECEF), N = unit(cross(s.r_ECEF, v)), T = cross(N, R);
  return {dot(d, R), dot(d, T), dot(d, N)};
}

// Quintic Hermite over h = 120 s: h^6/46080 times the sixth derivative, at most 2.7e7 m
// (2.2e-4/s)^6 = 3e-15 m/s^6 (retrograde part of the motion in ECEF, a fifth of it), so 1e-7 m;
// beside it rounding at 2.7e7 m, 4 nm a coordinate. With the perturbation, whose derivatives
// leave out the node's precession, seen: 8e-7 m, a hundredth of the guard.
TEST(GpsConstellationTest, InterpolatedOrbitsAreThoseOfTheUserAlgorithm) {
  GpsConstellation gps = make({.sigma_orbit_m = 0});
  double worst_m = 0, worst_clock_m = 0, worst_v = 0;
  for (Duration t = 0s; t < 12h; t += 97s) {
    const GpsSnapshot& now = gps.at(kEpoch + t);
    EXPECT_EQ(now.transmitting, gps.satellites());
    for (int prn = 1; prn <= 32; ++prn) {
      if (!now.has(prn)) continue;
      const SatelliteState exact = *gps.exact(prn, kEpoch + t);
      worst_m = std::max(worst_m, norm(now[prn].r_ECEF - exact.r_ECEF));
      worst_v = std::max(worst_v, norm(now[prn].v_ECEF - exact.v_ECEF));
      worst_clock_m =
          std::max(worst_clock_m, 299792458 * std::abs(now[prn].clock_s - exact.clock_s));
      EXPECT_LT(norm(now[prn].a_ECEF - exact.a_ECEF), 1e-8);
    }
  }
  EXPECT_LT(worst_m, 2e-7);
  EXPECT_LT(worst_v, 2e-8);
  EXPECT_LT(worst_clock_m, 1e-9);
}

TEST(GpsConstellationTest, InterpolationOfThePerturbedOrbitsStaysFarBelowItsGuard) {
  GpsConstellation gps = make();
  double worst_m = 0;
  for (Duration t = 0s; t < 12h; t += 97s) {
    const GpsSnapshot& now = gps.at(kEpoch + t);
    for (int prn = 1; prn <= 32; ++prn) {
      if (!now.has(prn)) continue;
      worst_m = std::max(worst_m, norm(now[prn].r_ECEF - gps.exact(prn, kEpoch + t)->r_ECEF));
    }
  }
  EXPECT_LT(worst_m, 2e-6);
}

TEST(GpsConstellationTest, WithoutInterpolationItIsTheUserAlgorithmToTheBit) {
  GpsConstellation gps = make({.interpolate = false});
  const GpsSnapshot& now = gps.at(kEpoch + 1234567ns);
  for (int prn = 1; prn <= 32; ++prn) {
    if (!now.has(prn)) continue;
    EXPECT_EQ(now[prn].r_ECEF, gps.exact(prn, kEpoch + 1234567ns)->r_ECEF);
  }
}

TEST(GpsConstellationTest, ResultDependsOnTimeAloneNotOnWhatWasAskedBefore) {
  GpsConstellation walked = make(), jumped = make();
  for (Duration t = 0s; t < 1h; t += 30s) walked.at(kEpoch + t);
  const SimTime t = kEpoch + 1h + 45s;
  jumped.at(kEpoch + 20h);
  const GpsSnapshot a = walked.at(t);
  const GpsSnapshot& b = jumped.at(t);
  for (std::size_t i = 0; i < a.satellites.size(); ++i) {
    EXPECT_EQ(a.satellites[i].r_ECEF, b.satellites[i].r_ECEF);
    EXPECT_EQ(a.satellites[i].clock_s, b.satellites[i].clock_s);
  }
}

// Where the almanac of 2016 puts its satellites at a second of its own week, there they are at the
// same second of the epoch's week: within the rounding of two angles, 2 cm each, e and sqrt(a).
// Seen: 3 cm.
TEST(GpsConstellationTest, AlmanacOfAnotherYearKeepsItsGeometryOverTheEarth) {
  GpsConstellation gps = make({.sigma_orbit_m = 0});
  for (const GpsAlmanacEntry& entry : carried_almanac()) {
    BroadcastEphemeris as_published;
    as_published.week = 1890;
    as_published.toe_s = as_published.toc_s = entry.toa_s;
    as_published.sqrt_a_sqrtm = entry.sqrt_a_sqrtm;
    as_published.eccentricity = entry.eccentricity;
    as_published.i0_rad = entry.inclination_rad;
    as_published.raan0_rad = entry.raan0_rad;
    as_published.raan_rate_radps = entry.raan_rate_radps;
    as_published.argument_of_perigee_rad = entry.argument_of_perigee_rad;
    as_published.mean_anomaly_rad = entry.mean_anomaly_rad;
    const SimTime same_second = gps::from_week(1890, gps::second_of_week(kEpoch));
    EXPECT_LT(norm(gps.exact(entry.prn, kEpoch)->r_ECEF -
                   broadcast_state(as_published, same_second).r_ECEF),
              0.08)
        << entry.prn;
  }
}

TEST(GpsConstellationTest, TruthDiffersFromTheBroadcastByAConstantVectorInRtn) {
  GpsConstellation gps = make({}, 7);
  for (int prn : {1, 17, 32}) {
    const Vec3 drawn = gps.perturbation_RTN(prn);
    EXPECT_GT(norm(drawn), 0.05);
    for (const Duration t : {0min, 5min, 119min, 121min, 660min}) {
      const SatelliteState said = broadcast_state(*gps.broadcast(prn, kEpoch + t), kEpoch + t);
      const SatelliteState truth = *gps.exact(prn, kEpoch + t);
      // What remains is the rounding of the message, below 1 cm in the first days (header).
      EXPECT_LT(norm(in_RTN(truth.r_ECEF - said.r_ECEF, said) - drawn), 0.01) << prn;
    }
  }
}

// Moving a satellite must move its velocity and acceleration as well: central differences as in
// broadcast_orbit_test.cpp.
TEST(GpsConstellationTest, DerivativesIncludeThePerturbation) {
  const GpsConstellation gps = make({.sigma_orbit_m = 1000});
  const SatelliteState a = *gps.exact(5, kEpoch), b = *gps.exact(5, kEpoch + 1s),
                       c = *gps.exact(5, kEpoch + 2s);
  EXPECT_LT(norm((c.r_ECEF - a.r_ECEF) / 2 - b.v_ECEF), 5e-5);
  EXPECT_LT(norm((c.v_ECEF - a.v_ECEF) / 2 - b.a_ECEF), 1e-7);
}

// 31 x 3 values a seed, 20 seeds: mean within 4.5 sigma/sqrt(n), variance within 4.5 sqrt(2/n).
TEST(GpsConstellationTest, PerturbationsAreNormalWithTheStatedSigma) {
  double sum = 0, squares = 0, n = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const GpsConstellation gps = make({}, seed);
    for (int prn = 1; prn <= 32; ++prn) {
      if ((gps.satellites() >> (prn - 1) & 1u) == 0) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const double x = gps.perturbation_RTN(prn)[axis];
        sum += x, squares += x * x, ++n;
      }
    }
  }
  ASSERT_EQ(n, 20 * 31 * 3);
  EXPECT_NEAR(sum / n, 0, 4.5 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 4.5 * std::sqrt(2 / n));
}

TEST(GpsConstellationTest, BroadcastIsWhatTheMessageSays) {
  GpsConstellation gps = make();
  for (Duration t = 0s; t < 26h; t += 2h) {
    const BroadcastEphemeris& said = *gps.broadcast(9, kEpoch + t);
    EXPECT_EQ(said, lnav::unpack(lnav::pack(said, 0), 9, said.week));
    EXPECT_EQ(said.iode, said.iodc % 256);
    EXPECT_EQ(time_of_ephemeris(said), kEpoch + t + 2h);
  }
}

TEST(GpsConstellationTest, IssuesFollowEachOtherEveryTwoHours) {
  GpsConstellation gps = make();
  const BroadcastEphemeris first = *gps.broadcast(3, kEpoch);
  EXPECT_EQ(*gps.broadcast(3, kEpoch + 2h - 1ns), first);
  const BroadcastEphemeris second = *gps.broadcast(3, kEpoch + 2h);
  EXPECT_EQ(second.iodc, (first.iodc + 1) % 1024);
  EXPECT_NE(second.iode, first.iode);
  EXPECT_EQ(*gps.broadcast(3, kEpoch), first);  // asked again, the same
}

// Without perturbation an issue is the truth but for the rounding of M0 (half a step, 1.9 cm along
// the track) and, after the end of a week, of the node: 4 cm at most in half a year; and next to
// nothing in the first day, in which rounding drifts by 1/256 of a step an issue. Clocks are the
// same to the bit of their steps.
TEST(GpsConstellationTest, IssuesSayTheTruthWithinTheRoundingOfTheMessage) {
  GpsConstellation gps = make({.sigma_orbit_m = 0});
  const auto worst_m = [&gps](SimTime t) {
    double worst = 0;
    for (int prn = 1; prn <= 32; ++prn) {
      const BroadcastEphemeris* said = gps.broadcast(prn, t);
      if (said == nullptr) continue;
      const SatelliteState a = broadcast_state(*said, t), b = *gps.exact(prn, t);
      worst = std::max(worst, norm(a.r_ECEF - b.r_ECEF));
      EXPECT_NEAR(a.clock_s, b.clock_s, 1e-15);
    }
    return worst;
  };
  EXPECT_LT(worst_m(kEpoch + 1h), 0.001);   // seen 0.15 mm
  EXPECT_LT(worst_m(kEpoch + 23h), 0.003);  // seen 1.8 mm
  EXPECT_LT(worst_m(kEpoch + days(180)), 0.04);
}

TEST(GpsConstellationTest, WeekEndsBetweenTwoIssuesWithoutAStep) {
  const SimTime end = gps::from_week(2359, 0);
  GpsConstellation gps = make({.sigma_orbit_m = 0}, 1, end - 1h);
  const BroadcastEphemeris before = *gps.broadcast(8, end - 1s);
  EXPECT_EQ(before.week, 2359);  // toe is the first second of the next week
  EXPECT_EQ(before.toe_s, 0);
  const BroadcastEphemeris after = *gps.broadcast(8, end + 1s);
  EXPECT_EQ(after.toe_s, 7200);
  EXPECT_LT(norm(broadcast_state(before, end).r_ECEF - broadcast_state(after, end).r_ECEF), 0.06);
}

TEST(GpsConstellationTest, SatelliteInOutageTransmitsNothing) {
  GpsConstellation gps = make();
  gps.add_outage(11, kEpoch + 10s, kEpoch + 20s);
  EXPECT_TRUE(gps.at(kEpoch + 10s - 1ns).has(11));
  EXPECT_FALSE(gps.at(kEpoch + 10s).has(11));
  EXPECT_EQ(gps.broadcast(11, kEpoch + 15s), nullptr);
  EXPECT_TRUE(gps.at(kEpoch + 15s).has(12));
  EXPECT_TRUE(gps.at(kEpoch + 20s).has(11));
}

TEST(GpsConstellationTest, HealthIsSaidFromTheNextIssueOn) {
  GpsConstellation gps = make();
  gps.add_health(11, 63, kEpoch + 1h, kEpoch + 3h);
  EXPECT_EQ(gps.broadcast(11, kEpoch + 90min)->health, 0);
  EXPECT_EQ(gps.broadcast(11, kEpoch + 150min)->health, 63);
  EXPECT_EQ(gps.broadcast(11, kEpoch + 5h)->health, 0);
  EXPECT_EQ(gps.broadcast(12, kEpoch + 150min)->health, 0);
}

BroadcastEphemeris from_a_file(int toe_h, double mean_anomaly_rad) {
  BroadcastEphemeris e;
  e.prn = 5;
  e.week = 2358;
  e.toe_s = e.toc_s = 4 * 86400 + 3600 * toe_h;
  e.sqrt_a_sqrtm = 5153.6;
  e.eccentricity = 0.01;
  e.i0_rad = 0.96;
  e.mean_anomaly_rad = mean_anomaly_rad;
  e.af0_s = 1e-5 + 1e-9 * toe_h;
  return e;
}

// Two issues of a file that disagree: the truth is each of them at its toe, and between them it
// goes over smoothly, so that r, v and a belong together.
TEST(GpsConstellationTest, TruthPassesSmoothlyFromOneIssueOfAFileToTheNext) {
  const double n = std::sqrt(3.986005e14) / std::pow(5153.6, 3);
  const BroadcastEphemeris a = from_a_file(0, 1.0), b = from_a_file(2, 1.0 + 7200 * n + 4e-8);
  GpsConstellation gps = make({.ephemerides = {b, a}, .sigma_orbit_m = 0});
  EXPECT_LT(norm(gps.exact(5, kEpoch)->r_ECEF - broadcast_state(a, kEpoch).r_ECEF), 1e-9);
  EXPECT_LT(norm(gps.exact(5, kEpoch + 2h)->r_ECEF - broadcast_state(b, kEpoch + 2h).r_ECEF), 1e-9);
  for (Duration t = 60s; t < 2h; t += 11min) {
    const SatelliteState before = *gps.exact(5, kEpoch + t - 1s), now = *gps.exact(5, kEpoch + t),
                         after = *gps.exact(5, kEpoch + t + 1s);
    EXPECT_LT(norm((after.r_ECEF - before.r_ECEF) / 2 - now.v_ECEF), 5e-5);
    EXPECT_LT(norm((after.v_ECEF - before.v_ECEF) / 2 - now.a_ECEF), 1e-8);
    EXPECT_LT(norm(gps.at(kEpoch + t)[5].r_ECEF - now.r_ECEF), 1e-6);
  }
  EXPECT_TRUE(gps.at(kEpoch - 119min).has(5));
  EXPECT_FALSE(gps.at(kEpoch - 125min).has(5));
  EXPECT_FALSE(gps.at(kEpoch + 4h + 5min).has(5));
  EXPECT_EQ(gps.broadcast(5, kEpoch + 1h)->toe_s, b.toe_s);
  EXPECT_EQ(gps.broadcast(5, kEpoch + 3h)->toe_s, b.toe_s);
  EXPECT_EQ(gps.broadcast(5, kEpoch + 5h), nullptr);
}

TEST(GpsConstellationTest, OptionsOutOfRangeAreNamed) {
  EXPECT_THAT([] { make({.sigma_orbit_m = -1}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("sigma_orbit_m = -1")));
  GpsConstellation gps = make();
  EXPECT_THAT([&] { gps.add_outage(33, kEpoch, kEpoch + 1s); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("prn = 33; accepted: 1 to 32")));
  EXPECT_THAT([&] { gps.add_health(1, 64, kEpoch, kEpoch + 1s); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("health = 64; accepted: 0 to 63")));
}

}  // namespace
}  // namespace orrery
