#include <orrery/models/attitude/pointing_law.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace orrery {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const SimTime kStart = gps_midnight(2025, 3, 20);
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kOrbitRate_radps = 1.0948e-3;  // sqrt(mu/a^3)

// The reference mission's orbit, and Kepler's motion on it.
InertialState orbit_at(SimTime t) {
  QuasiNonsingularElements x{6928137, 0.001, 0, 97.59 * kDegree, 5.5, 0.2};
  x.u_rad += std::sqrt(kMuEarth_m3ps2 / x.a_m) / x.a_m * to_seconds(t - kStart);
  return to_inertial(x);
}

// A rotation vector from a small rotation matrix R = 1 - [angle x].
Vec3 small_angle(const Mat3& R) {
  return 0.5 * Vec3{R.row_y.z - R.row_z.y, R.row_z.x - R.row_x.z, R.row_x.y - R.row_y.x};
}

double angle_between(const Mat3& a, const Mat3& b) {
  const Quaternion q = to_quaternion(a * transpose(b));
  return 2 * std::atan2(norm({q.x, q.y, q.z}), q.w);
}

// By central difference over 2 h.
Vec3 rate_by_difference(const PointingLaw& law, SimTime t, Duration h) {
  const Mat3 before = law.at(t - h, orbit_at(t - h)).R_BI;
  const Mat3 after = law.at(t + h, orbit_at(t + h)).R_BI;
  return small_angle(after * transpose(before)) / (2 * to_seconds(h));
}

const Quaternion kTarget{0.5, -0.5, 0.5, 0.5};

TEST(SunPointingTest, XIsAtTheSunAndZAsNearTheZenithAsItCan) {
  const PointingLaw law(AttitudeMode::sun());
  for (int minute = 0; minute < 96; minute += 7) {
    const SimTime t = kStart + minute * 1min;
    const InertialState s = orbit_at(t);
    const Mat3 R_BI = law.at(t, s).R_BI;
    // Interpolated, 1e-11 rad.
    EXPECT_LT(norm(R_BI.row_x - apparent_sun_direction_ECI(t)), 2e-11);
    EXPECT_LT(norm(cross(R_BI.row_x, R_BI.row_y) - R_BI.row_z), 1e-15) << "right-handed";
    const Vec3 up = unit(s.r_ECI);
    EXPECT_NEAR(dot(R_BI.row_y, up), 0, 1e-15);
    EXPECT_GT(dot(R_BI.row_z, up), 0);
  }
}

TEST(SunPointingTest, SubsolarPointFallsBackToTheOrbitNormal) {
  const InertialState s{{7e6, 0, 0}, {0, 4500, 6000}};
  const Mat3 R_BI = sun_pointing(s, {{1, 0, 0}, {}}).R_BI;
  EXPECT_LT(norm(R_BI.row_z - Vec3{0, -0.8, 0.6}), 1e-15);
  EXPECT_THROW((void)sun_pointing({{0, 0, 0}, s.v_ECI}, {{1, 0, 0}, {}}), std::domain_error);
}

// The cubic through 6 h knots: 1e-11 rad, and in its derivative h^3 (2e-7 1/s)^4 / 12 = 1.3e-15 1/s
// from the annual motion and as much from the Moon's 3e-5 rad at 2.7e-6 rad/s. The central
// difference of ERFA's over 20 min errs by (600 s)^2/6 (2e-7)^3 = 5e-16 1/s.
TEST(SunTrackTest, FollowsErfaBetweenItsKnots) {
  const SunTrack track;
  for (int hour = 0; hour < 24 * 40; hour += 17) {
    const SimTime t = kStart + hour * 1h + 23min;
    EXPECT_LT(norm(track.at(t).s_ECI - apparent_sun_direction_ECI(t)), 2e-11) << hour;
    const Vec3 rate =
        (apparent_sun_direction_ECI(t + 10min) - apparent_sun_direction_ECI(t - 10min)) / 1200.0;
    EXPECT_LT(norm(track.at(t).rate_ECI - rate), 4e-15) << hour;
    EXPECT_EQ(SunTrack().at(t).s_ECI, track.at(t).s_ECI) << "another history, the same bits";
  }
}

// Central difference over 200 ms of a motion at n: (n h)^2/6 = 2e-9 of the rate; the Sun mode turns
// up to 1/sin(45 deg) faster where the zenith passes nearest to the Sun, with steeper derivatives.
TEST(PointingLawTest, RateIsTheDerivativeOfTheAttitudeInEveryMode) {
  for (const AttitudeMode& mode :
       {AttitudeMode::zenith(), AttitudeMode::sun(), AttitudeMode::target(kTarget)}) {
    const PointingLaw law(mode);
    for (int minute = 1; minute < 96; minute += 5) {
      const SimTime t = kStart + minute * 1min;
      const Vec3 error = law.at(t, orbit_at(t)).omega_BI_B - rate_by_difference(law, t, 100ms);
      EXPECT_LT(norm(error), 1e-7 * kOrbitRate_radps) << mode.to_string() << ", " << minute;
    }
  }
}

// The slew's own terms: acceleration over 2 x 50 ms cancels, a kink costs a h/2 = 2e-5 rad/s and is
// kept away from; (rate h)^2/6 = 3e-8 of 0.5 deg/s. Observed 8e-10 rad/s.
TEST(PointingLawTest, RateIsTheDerivativeOfTheAttitudeDuringASlew) {
  PointingLaw law(AttitudeMode::zenith());
  const SimTime begin = kStart + 10min;
  law.point(begin, orbit_at(begin), AttitudeMode::sun());
  const SimTime end = law.slew_end();
  double largest = 0;
  for (SimTime t = begin + 700ms; t < end; t += 1s) {
    const auto corner = law.next_discontinuity(t - 100ms);
    if (corner && *corner < t + 100ms) continue;
    const Vec3 error = law.at(t, orbit_at(t)).omega_BI_B - rate_by_difference(law, t, 50ms);
    largest = std::max(largest, norm(error));
  }
  EXPECT_LT(largest, 5e-9);
}

// Between fixed attitudes all is closed form: theta/w + w/a, and sqrt for small angles.
TEST(SlewTest, DurationAndHalfWayPointAreThoseOfATrapezoid) {
  const auto slew = [](double angle_deg) {
    PointingLaw law(AttitudeMode::target({1, 0, 0, 0}));
    const double half = angle_deg * kDegree / 2;
    law.point(
        kStart, orbit_at(kStart),
        AttitudeMode::target({std::cos(half), 0, 0.6 * std::sin(half), 0.8 * std::sin(half)}));
    const SimTime middle = kStart + (law.slew_end() - kStart) / 2;
    // f_B = q f q*: a body that turns by +angle about e has q = (cos, -e sin).
    EXPECT_NEAR(angle_between(law.at(middle, orbit_at(middle)).R_BI, Mat3{}), half, 1e-9);
    const Vec3 omega = law.at(middle, orbit_at(middle)).omega_BI_B;
    EXPECT_LT(norm(cross(omega, {0, 0.6, 0.8})), 1e-15) << "about the eigenaxis";
    EXPECT_LT(dot(omega, {0, 0.6, 0.8}), 0) << "axes turn against components";
    return std::pair(to_seconds(law.slew_end() - kStart), norm(omega) / kDegree);
  };
  const auto [long_s, long_rate] = slew(90);
  EXPECT_NEAR(long_s, 90 / 0.5 + 0.5 / 0.05, 1e-8);
  EXPECT_NEAR(long_rate, 0.5, 1e-12);
  const auto [short_s, short_rate] = slew(2);
  EXPECT_NEAR(short_s, 2 * std::sqrt(2 / 0.05), 1e-8);
  EXPECT_NEAR(short_rate, std::sqrt(2 * 0.05), 5e-11) << "the middle to half a nanosecond";
  EXPECT_NEAR(slew(180).first, 370, 1e-8);
}

TEST(SlewTest, RatesAndAccelerationsStayWithinTheLimitsRelativeToTheTarget) {
  PointingLaw law(AttitudeMode::target(kTarget));
  const PointingLaw goal(AttitudeMode::zenith());
  const SimTime begin = kStart + 5min;
  law.point(begin, orbit_at(begin), AttitudeMode::zenith());
  double fastest = 0;
  Vec3 last_B;
  for (SimTime t = begin + 1ns; t <= law.slew_end() + 5s; t += 250ms) {
    const BodyAttitude body = law.at(t, orbit_at(t)), target = goal.at(t, orbit_at(t));
    const Vec3 relative_B =
        body.omega_BI_B - body.R_BI * (transpose(target.R_BI) * target.omega_BI_B);
    fastest = std::max(fastest, norm(relative_B));
    EXPECT_LE(norm(relative_B - last_B) / 0.25, 0.05 * kDegree * (1 + 1e-9))
        << to_string(t - begin);
    last_B = relative_B;
  }
  EXPECT_NEAR(fastest, 0.5 * kDegree, 1e-9);
  EXPECT_LT(norm(last_B), 1e-17) << "met, and at rest relative to it";
}

TEST(SlewTest, AttitudeIsContinuousWhereSlewsBeginAndEndAndAreInterrupted) {
  PointingLaw law;
  const auto at = [&](SimTime t) { return law.at(t, orbit_at(t)).R_BI; };
  SimTime t = kStart + 1min;
  for (const AttitudeMode& mode : {AttitudeMode::sun(), AttitudeMode::target(kTarget),
                                   AttitudeMode::zenith(), AttitudeMode::sun()}) {
    const Mat3 before = at(t);
    law.point(t, orbit_at(t), mode);
    EXPECT_LT(angle_between(at(t), before), 1e-14) << mode.to_string();
    EXPECT_TRUE(law.is_slewing(t));
    if (mode == AttitudeMode::sun()) t = law.slew_end();
    // 2 ns at 0.6 deg/s: 2e-11.
    EXPECT_LT(angle_between(at(t - 1ns + 1ns), at(t + 1ns)), 1e-10) << mode.to_string();
    t += 40s;  // the target and zenith slews are cut short
  }
  const SimTime end = law.slew_end();
  EXPECT_LT(angle_between(at(end - 1ns), at(end)), 1e-10);
  const Vec3 jump =
      law.at(end - 1ns, orbit_at(end - 1ns)).omega_BI_B - law.at(end, orbit_at(end)).omega_BI_B;
  EXPECT_LT(norm(jump), 1e-10) << "no jump of the rate at the end";
}

TEST(PointingLawTest, QuaternionTargetDoesWhatItsMatrixDoes) {
  const PointingLaw law(AttitudeMode::target({0.8, 0, 0, -0.6}));
  // (cos(a/2), 0, 0, -sin(a/2)) is R3(a): cos a = 0.28, sin a = 0.96.
  const Mat3 R_BI = law.at(kStart, orbit_at(kStart)).R_BI;
  EXPECT_LT(norm(R_BI.row_x - Vec3{0.28, 0.96, 0}), 1e-15);
  EXPECT_LT(norm(R_BI.row_y - Vec3{-0.96, 0.28, 0}), 1e-15);
  EXPECT_EQ(law.at(kStart, orbit_at(kStart)).omega_BI_B, Vec3{});
}

TEST(PointingLawTest, CommandingTheSameModeChangesNothing) {
  PointingLaw law;
  law.point(kStart, orbit_at(kStart), AttitudeMode::sun());
  const SimTime end = law.slew_end();
  law.point(kStart + 10s, orbit_at(kStart + 10s), AttitudeMode::sun());
  EXPECT_EQ(law.slew_end(), end);
}

TEST(PointingLawTest, WrongValuesAreNamed) {
  EXPECT_THAT(
      [] {
        (void)AttitudeMode::target({1, 1, 0, 0});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("|q_BI| = 1.414214; accepted: within")));
  EXPECT_THAT([] { PointingLaw law(AttitudeMode::zenith(), {.rate_degps = 0}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("rate_degps = 0")));
  EXPECT_THAT([] { PointingLaw law(AttitudeMode::zenith(), {.acceleration_degps2 = -1}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("acceleration_degps2 = -1")));
  PointingLaw law;
  law.point(kStart + 1s, orbit_at(kStart + 1s), AttitudeMode::sun());
  EXPECT_THROW((void)law.at(kStart, orbit_at(kStart)), std::logic_error);
}

// +X in zenith mode is along track, all along a burn of 10 min in which the body turns by 38 deg:
// from a circular orbit a^(-1/2) = a0^(-1/2) - F t / (m sqrt(mu)), but for the eccentricity that
// grows on the way, 2 F/(m g) = 2e-4. A thrust that stayed where it first pointed would miss by 7
// %.
TEST(PointingLawTest, BodyFixedThrustStaysAlongTrackInZenithMode) {
  const QuasiNonsingularElements circular{6928137, 0, 0, 97.59 * kDegree, 5.5, 0.2};
  const InertialState s = to_inertial(circular);
  SpacecraftOrbit orbit({kStart, s.r_ECI, s.v_ECI, 11},
                        {.environment = std::make_shared<const EarthEnvironment>(),
                         .attitude = std::make_shared<PointingLaw>()});
  const double force_N = 0.01;
  orbit.set_thrust(kStart, {.force_B = {force_N, 0, 0}});
  const double a_m = orbit.elements_at(kStart + 10min).a_m;
  const double root =
      1 / std::sqrt(circular.a_m) - force_N * 600 / (11 * std::sqrt(kMuEarth_m3ps2));
  const double expected_m = 1 / (root * root) - circular.a_m;
  EXPECT_NEAR((a_m - circular.a_m) / expected_m, 1, 4e-4);
}

// 20000 draws: the deviation's own deviation is 1/sqrt(2 N) = 0.5 %, the mean's 1/sqrt(N) = 0.7 %;
// four times these.
TEST(PointingLawTest, KnowledgeErrorHasTheSigmaAsked) {
  constexpr int kDraws = 20000;
  RandomStream random(7);
  const Mat3 R_BI = to_matrix(kTarget);
  Vec3 sum, squares;
  for (int i = 0; i < kDraws; ++i) {
    const Quaternion known = with_knowledge_error(kTarget, 0.01, random);
    const Vec3 e = -1.0 * small_angle(to_matrix(known) * transpose(R_BI)) / (0.01 * kDegree);
    sum += e;
    squares += {e.x * e.x, e.y * e.y, e.z * e.z};
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sum[axis] / kDraws, 0, 4 * 0.0071) << axis;
    EXPECT_NEAR(std::sqrt(squares[axis] / kDraws), 1, 4 * 0.005) << axis;
  }
  EXPECT_EQ(random.draws(), 3u * kDraws);
}

}  // namespace
}  // namespace orrery
