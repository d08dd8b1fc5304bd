#include <orrery/models/frames/frames.hpp>
#include <orrery/models/frames/rtn.hpp>

#include <gtest/gtest.h>

#include <stdexcept>

namespace orrery {
namespace {

const InertialState kChief{{7e6, 1e5, -2e5}, {300, 5000, 5600}};

TEST(RtnTest, AxesFollowRadiusAndMomentum) {
  const Mat3 R_HI = rtn_axes(kChief);
  // 1e-9 m, 1e-12 m/s: roundings of 7e6 and 7e3.
  const Vec3 r_RTN = R_HI * kChief.r_ECI, v_RTN = R_HI * kChief.v_ECI;
  EXPECT_NEAR(r_RTN.x, norm(kChief.r_ECI), 2e-9);
  EXPECT_NEAR(r_RTN.y, 0, 2e-9);
  EXPECT_NEAR(r_RTN.z, 0, 2e-9);
  EXPECT_GT(v_RTN.y, 0);
  EXPECT_NEAR(v_RTN.z, 0, 2e-12);
}

// A deputy that is fixed in the chief's RTN has no velocity there, though it moves relative to ECI.
TEST(RtnTest, DerivativeIsTakenInTheTurningFrame) {
  const Mat3 R_IH = transpose(rtn_axes(kChief));
  const Vec3 offset_RTN{10, 200, -30};
  const Vec3 omega_ECI = cross(kChief.r_ECI, kChief.v_ECI) / dot(kChief.r_ECI, kChief.r_ECI);
  const Vec3 offset_ECI = R_IH * offset_RTN;
  const InertialState deputy{kChief.r_ECI + offset_ECI,
                             kChief.v_ECI + cross(omega_ECI, offset_ECI)};
  const RelativeState relative = relative_state(kChief, deputy);
  // Positions of 7e6 m are subtracted: 1e-9 m; velocities of 7e3: 1e-12 m/s.
  EXPECT_LT(norm(relative.r_DC_RTN - offset_RTN), 4e-9);
  EXPECT_LT(norm(relative.v_DC_RTN), 4e-12);
}

TEST(RtnTest, RelativeStateSurvivesTheDetour) {
  const InertialState deputy{kChief.r_ECI + Vec3{100, -250, 40},
                             kChief.v_ECI + Vec3{0.3, -0.1, 0.2}};
  const InertialState back = deputy_state(kChief, relative_state(kChief, deputy));
  EXPECT_LT(norm(back.r_ECI - deputy.r_ECI), 4e-9);
  EXPECT_LT(norm(back.v_ECI - deputy.v_ECI), 4e-12);
}

TEST(RtnTest, StateWithoutAPlaneIsRefused) {
  EXPECT_THROW(rtn_axes({{7e6, 0, 0}, {100, 0, 0}}), std::domain_error);
  EXPECT_THROW(rtn_axes({{0, 0, 0}, {100, 0, 0}}), std::domain_error);
}

TEST(EarthFixedTest, PointOnTheGroundStandsStill) {
  const Mat3 R_EI{{0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}};
  const Vec3 omega{0, 0, 7.292115e-5}, r_ECEF{6378137, 0, 1000};
  const InertialState inertial = to_inertial({r_ECEF, {}}, R_EI, omega);
  EXPECT_NEAR(norm(inertial.v_ECI), 7.292115e-5 * 6378137, 1e-9);
  const EarthFixedState back = to_earth_fixed(inertial, R_EI, omega);
  EXPECT_LT(norm(back.v_ECEF), 1e-12);
  EXPECT_LT(norm(back.r_ECEF - r_ECEF), 1e-8);
}

}  // namespace
}  // namespace orrery
