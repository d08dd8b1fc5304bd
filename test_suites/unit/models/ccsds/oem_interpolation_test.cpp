#include <orrery/models/ccsds/oem_interpolation.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const SimTime kStart = gps_midnight(2025, 3, 20);
constexpr double kRadius_m = 7e6, kRate_radps = 1.078e-3;

struct Motion {
  Vec3 r, v;
};

Motion circle(double t_s) {
  const double c = std::cos(kRate_radps * t_s), s = std::sin(kRate_radps * t_s);
  return {{kRadius_m * c, 0.6 * kRadius_m * s, 0.8 * kRadius_m * s},
          {-kRadius_m * kRate_radps * s, 0.6 * kRadius_m * kRate_radps * c,
           0.8 * kRadius_m * kRate_radps * c}};
}

// A cubic in each axis.
Motion cubic(double t_s) {
  const double t2 = t_s * t_s, t3 = t2 * t_s;
  return {{1e6 + 7e3 * t_s, 2e6 - 3 * t2, 0.01 * t3 - t_s}, {7e3, -6 * t_s, 0.03 * t2 - 1}};
}

OemSegment segment(const std::function<Motion(double)>& motion, SimTime first, Duration step,
                   int count, TimeSystem system = TimeSystem::kGPS) {
  OemSegment s;
  s.metadata.object_name = "DSC";
  s.metadata.object_id = "2025-001A";
  s.metadata.time_system = system;
  for (int i = 0; i < count; ++i) {
    const Motion m = motion(to_seconds(first + i * step - kStart));
    s.states.push_back({to_epoch(first + i * step, system), 1e-3 * m.r, 1e-3 * m.v, {}});
  }
  s.metadata.start_time = s.states.front().epoch;
  s.metadata.stop_time = s.states.back().epoch;
  return s;
}

Oem oem_of(std::vector<OemSegment> segments) {
  Oem oem;
  oem.segments = std::move(segments);
  return oem;
}

std::string error_of(const Oem& oem, SimTime t, std::optional<OemInterpolation> how = {}) {
  try {
    state_at(oem, t, how);
  } catch (const std::logic_error& error) {
    return error.what();
  }
  return "no error";
}

TEST(OemInterpolationTest, LinesComeBackToTheBit) {
  const Oem oem = oem_of({segment(circle, kStart, 60s, 10)});
  for (int i = 0; i < 10; ++i) {
    const OrbitState state = state_at(oem, kStart + i * 60s);
    const Vec3 r_km = 1e-3 * circle(60.0 * i).r, v_kmps = 1e-3 * circle(60.0 * i).v;
    EXPECT_EQ(state.t, kStart + i * 60s);
    EXPECT_EQ(state.r_ECI, 1e3 * r_km);
    EXPECT_EQ(state.v_ECI, 1e3 * v_kmps);
    EXPECT_EQ(state.mass_kg, 0);
  }
}

// Bounds: the remainder of polynomial interpolation, f''''''''(xi)/8! times the product of the
// distances to the nodes, in the middle of equal steps, f'''''''' = r n^8 = 1.28e-17 m/s^8.
//   Hermite, 4 lines:  1.28e-17 (30 30 90 90)^2 / 40320 = 1.7e-8 m
//   Lagrange, 8 lines: 1.28e-17 (30 90 150 210)^2 / 40320 = 2.3e-6 m; the velocity n times that
// and rounding of 7000 km, a few 1e-9 m. Hermite's velocity is a derivative: remainder over 30 s.
TEST(OemInterpolationTest, CircleIsFollowedWithinTheRemainder) {
  const Oem oem = oem_of({segment(circle, kStart, 60s, 40)});
  const SimTime t = kStart + 20 * 60s + 30s;
  const Motion truth = circle(20 * 60 + 30);
  const OrbitState hermite = state_at(oem, t, OemInterpolation{InterpolationMethod::kHermite, 7});
  EXPECT_LT(norm(hermite.r_ECI - truth.r), 2.5e-8);
  EXPECT_LT(norm(hermite.v_ECI - truth.v), 1e-9);
  const OrbitState lagrange = state_at(oem, t, OemInterpolation{InterpolationMethod::kLagrange, 7});
  EXPECT_LT(norm(lagrange.r_ECI - truth.r), 2.3e-6);
  EXPECT_LT(norm(lagrange.v_ECI - truth.v), 2.6e-9);
}

// Polynomials up to the degree are reproduced, at the ends of the table as well; rounding of
// 1e6 m in km: 1e-9 m, grown by the weights near the ends to 1e-8 m.
TEST(OemInterpolationTest, PolynomialsAreReproducedEverywhere) {
  const Oem oem = oem_of({segment(cubic, kStart, 60s, 9)});
  for (const OemInterpolation& how : {OemInterpolation{InterpolationMethod::kHermite, 3},
                                      {InterpolationMethod::kHermite, 6},
                                      {InterpolationMethod::kLagrange, 3},
                                      {InterpolationMethod::kLagrange, 4},
                                      {InterpolationMethod::kLagrange, 8}}) {
    for (double t_s = 0.5; t_s < 480; t_s += 7.25) {
      const OrbitState state = state_at(oem, kStart + from_seconds(t_s), how);
      EXPECT_LT(norm(state.r_ECI - cubic(t_s).r), 1e-7) << t_s << " s, degree " << how.degree;
      EXPECT_LT(norm(state.v_ECI - cubic(t_s).v), 1e-8) << t_s << " s, degree " << how.degree;
    }
  }
}

// x_EC = 1e6 m + 7 km/s t is linear in position and velocity.
TEST(OemInterpolationTest, LinearIgnoresItsDegree) {
  const Oem oem = oem_of({segment(cubic, kStart, 60s, 3)});
  const OrbitState state =
      state_at(oem, kStart + 15s, OemInterpolation{InterpolationMethod::kLinear, 7});
  EXPECT_NEAR(state.r_ECI.x, 1e6 + 7e3 * 15, 1e-8);
  EXPECT_NEAR(state.r_ECI.y, 2e6 - 3 * 3600 / 4.0, 1e-8);  // chord of -3 t^2 over 60 s
}

TEST(OemInterpolationTest, MetadataDecideBeforeTheCaller) {
  OemSegment s = segment(cubic, kStart, 60s, 3);
  s.metadata.interpolation = InterpolationMethod::kLinear;
  s.metadata.interpolation_degree = 1;
  const OrbitState state = state_at(oem_of({s}), kStart + 15s, OemInterpolation{});
  EXPECT_NEAR(state.r_ECI.y, 2e6 - 3 * 3600 / 4.0, 1e-8);
}

// 61 s lie between 23:59:30 and 00:00:30 UTC: uniform motion must not notice.
TEST(OemInterpolationTest, LeapSecondBetweenLinesIsCounted) {
  const SimTime first = gps_midnight(2016, 12, 31) + 23h + 58min + 30s + 17s;
  OemSegment s = segment(cubic, kStart, 60s, 4, TimeSystem::kUTC);
  const Vec3 v{7e3, 0, 0};
  const Duration at[] = {0s, 60s, 121s, 181s};  // 23:58:30, 23:59:30, 00:00:30, 00:01:30
  for (int i = 0; i < 4; ++i)
    s.states[i] = {to_epoch(first + at[i], TimeSystem::kUTC),
                   1e-3 * (Vec3{1e6, 0, 0} + to_seconds(at[i]) * v),
                   1e-3 * v,
                   {}};
  s.metadata.start_time = s.states.front().epoch;
  s.metadata.stop_time = s.states.back().epoch;
  ASSERT_EQ(to_text(s.states[2].epoch), "2017-01-01T00:00:30");
  const Oem oem = oem_of({s});
  for (const Duration d : {75s, 90s, 91s, 92s, 110s}) {
    const OrbitState state =
        state_at(oem, first + d, OemInterpolation{InterpolationMethod::kLagrange, 3});
    EXPECT_NEAR(state.r_ECI.x, 1e6 + 7e3 * to_seconds(d), 1e-7);
  }
}

TEST(OemInterpolationTest, InstantsOutsideAreRefusedWithWhatIsCovered) {
  OemSegment s = segment(circle, kStart, 60s, 10);
  const Oem whole = oem_of({s});
  for (const SimTime t : {kStart - 1ns, kStart + 540s + 1ns, kStart + days(400)})
    EXPECT_THAT(error_of(whole, t),
                AllOf(HasSubstr(to_text(to_epoch(t, TimeSystem::kGPS)) + " GPS"), HasSubstr("DSC"),
                      HasSubstr("2025-03-20T00:00:00 to 2025-03-20T00:09:00")));
  s.metadata.useable_start_time = s.states[2].epoch;
  s.metadata.useable_stop_time = s.states[7].epoch;
  const Oem useable = oem_of({s});
  EXPECT_THROW(state_at(useable, kStart + 119s), std::out_of_range);
  EXPECT_NO_THROW(state_at(useable, kStart + 120s));
  EXPECT_NO_THROW(state_at(useable, kStart + 130s, OemInterpolation{}));
  EXPECT_THROW(state_at(useable, kStart + 421s), std::out_of_range);
}

// A manoeuvre at 5 min: both segments have that instant, the second with another velocity.
TEST(OemInterpolationTest, LaterSegmentHoldsWhereTwoTouch) {
  const OemSegment before = segment(circle, kStart, 60s, 6);
  OemSegment after = segment(circle, kStart + 300s, 60s, 6);
  for (OemState& state : after.states) state.v_kmps.x += 0.001;
  const Oem oem = oem_of({before, after});
  const Vec3 step = state_at(oem, kStart + 300s).v_ECI - circle(300).v;
  EXPECT_NEAR(step.x, 1, 1e-9);
  EXPECT_EQ(interpolate(oem, kStart + 300s).segment, 1u);
  EXPECT_EQ(interpolate(oem, kStart + 240s).segment, 0u);
}

TEST(OemInterpolationTest, OverlapAndGapAreRefused) {
  const OemSegment first = segment(circle, kStart, 60s, 6);
  const OemSegment overlapping = segment(circle, kStart + 240s, 60s, 6);
  EXPECT_THAT(error_of(oem_of({first, overlapping}), kStart + 240s),
              HasSubstr("segments 1 and 2 of the OEM both cover"));
  const OemSegment later = segment(circle, kStart + 600s, 60s, 6);
  EXPECT_THAT(error_of(oem_of({first, later}), kStart + 400s), HasSubstr("not covered"));
}

TEST(OemInterpolationTest, UnusableRequestsAreNamed) {
  OemSegment s = segment(circle, kStart, 60s, 4);
  const SimTime between = kStart + 30s;
  EXPECT_THAT(error_of(oem_of({s}), between), HasSubstr("lacks INTERPOLATION"));
  EXPECT_THAT(error_of(oem_of({s}), between, OemInterpolation{InterpolationMethod::kLagrange, 4}),
              HasSubstr("needs 5 lines; the segment of the OEM has 4"));
  EXPECT_THAT(error_of(oem_of({s}), between, OemInterpolation{InterpolationMethod::kLagrange, 0}),
              HasSubstr("degree = 0; accepted: 1 to 100"));
  EXPECT_THAT(error_of(oem_of({}), between), HasSubstr("no segments"));
  s.metadata.ref_frame = "ITRF2014";
  EXPECT_THAT(error_of(oem_of({s}), kStart), HasSubstr("REF_FRAME ITRF2014 about EARTH"));
  EXPECT_EQ(interpolate(oem_of({s}), kStart).r_km, s.states[0].r_km);
  s.metadata.time_system = TimeSystem::kMET;
  EXPECT_THAT(error_of(oem_of({s}), kStart), HasSubstr("time system MET"));
}

}  // namespace
}  // namespace orrery
