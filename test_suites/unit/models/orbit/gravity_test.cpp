#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/gravity.hpp>
#include <orrery/models/orbit/gravity_force.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr Vec3 kSomewhere_ECEF{4.0e6, -3.2e6, 4.6e6};

GravityField only_C20(double mu_m3ps2 = kMuEarth_m3ps2) {
  return GravityField::parse("earth_gravity_constant " + std::to_string(mu_m3ps2) +
                                 "\nradius 6378136.3\nmax_degree 2\nend_of_head\n"
                                 "gfc 2 0 -4.8416945732e-4 0\ngfc 2 1 0 0\ngfc 2 2 0 0\n",
                             "C20");
}

double relative_difference(const Vec3& a, const Vec3& b) {
  return norm(a - b) / norm(b);
}

// Two independent programs (normalised V-W recursion; direct Legendre sums) agreed on these to
// 1e-15. Tolerance: a few roundings of the central term, the largest part; observed 3e-16.
TEST(HarmonicGravityTest, AgreesWithTheCheckVectors) {
  const struct {
    int degree;
    Vec3 a_ECEF;
  } checks[] = {{2, {-4.8773340701340544, 3.9019224760528317, -5.6246624520102380}},
                {20, {-4.8773698526738842, 3.9021488421411883, -5.6246764767453490}},
                {60, {-4.8773630826923475, 3.9021345609215516, -5.6246615389895478}}};
  for (const auto& check : checks) {
    const HarmonicGravity gravity(GravityField::ggm05s(), check.degree);
    EXPECT_LT(relative_difference(gravity.acceleration_ECEF(kSomewhere_ECEF), check.a_ECEF), 2e-15)
        << "degree " << check.degree;
  }
}

// Closed form of J2 (Vallado, 4th ed., eq. 8-44). Tolerance: ten roundings.
TEST(HarmonicGravityTest, OblatenessAloneIsTheTextbookFormula) {
  const HarmonicGravity gravity(only_C20(), 2);
  for (const Vec3& r :
       {kSomewhere_ECEF, Vec3{0, 0, 7e6}, Vec3{-7e6, 0, 0}, Vec3{1e6, -6.8e6, -1e6}}) {
    const double r2 = dot(r, r), sin2 = r.z * r.z / r2;
    const double J2 = std::sqrt(5.0) * 4.8416945732e-4;
    const double k =
        1.5 * J2 * kMuEarth_m3ps2 * kRadiusEarth_m * kRadiusEarth_m / (r2 * r2 * std::sqrt(r2));
    const Vec3 expected{-k * r.x * (1 - 5 * sin2), -k * r.y * (1 - 5 * sin2),
                        -k * r.z * (3 - 5 * sin2)};
    EXPECT_LT(relative_difference(gravity.perturbation_ECEF(r), expected), 3e-15);
  }
}

TEST(HarmonicGravityTest, PolesAreOrdinaryPlaces) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 60);
  for (const double z : {6.9e6, -6.9e6}) {
    const Vec3 at = gravity.acceleration_ECEF({0, 0, z});
    ASSERT_TRUE(is_finite(at));
    // A centimetre aside the field is the same to its gradient, 2.4e-6 1/s^2 times 0.01 m.
    EXPECT_LT(norm(at - gravity.acceleration_ECEF({0.01, -0.01, z})), 1e-7);
  }
}

TEST(HarmonicGravityTest, WholeIsCentralTermPlusPerturbation) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 60);
  const double r = norm(kSomewhere_ECEF);
  const Vec3 central = -kMuEarth_m3ps2 / (r * r * r) * kSomewhere_ECEF;
  EXPECT_LT(relative_difference(gravity.perturbation_ECEF(kSomewhere_ECEF) + central,
                                gravity.acceleration_ECEF(kSomewhere_ECEF)),
            1e-15);
}

TEST(HarmonicGravityTest, DegreeOutsideTheFieldIsRefused) {
  EXPECT_THROW(HarmonicGravity(GravityField::ggm05s(), 61), std::out_of_range);
  EXPECT_THROW(HarmonicGravity(GravityField::ggm05s(), 1), std::out_of_range);
}

TEST(HarmonicGravityTest, PositionBelowTheReferenceRadiusIsRefused) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 4);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_THROW(gravity.acceleration_ECEF({6378136.2, 0, 0}), std::domain_error);
  EXPECT_THROW(gravity.acceleration_ECEF({0, 0, 0}), std::domain_error);
  EXPECT_THROW(gravity.acceleration_ECEF({nan, 0, 7e6}), std::domain_error);
  EXPECT_THROW(gravity.acceleration_ECEF({infinity, 0, 7e6}), std::domain_error);
  EXPECT_NO_THROW(gravity.acceleration_ECEF({6378136.4, 0, 0}));
}

TEST(GravityForceTest, TurnsWithTheEarth) {
  const auto gravity = std::make_shared<const HarmonicGravity>(GravityField::ggm05s(), 60);
  const GravityForce force(gravity);
  const Mat3 R_EI{{0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}};
  const Surroundings around{R_EI, {}, {}, {}};
  const Vec3 r_ECI = transpose(R_EI) * kSomewhere_ECEF;
  const Vec3 expected = transpose(R_EI) * gravity->perturbation_ECEF(kSomewhere_ECEF);
  EXPECT_LT(relative_difference(force.acceleration_ECI({{}, r_ECI, {}, 1}, around), expected),
            1e-13);
}

// The propagator's point mass uses kMuEarth: a field with another mu must bring the difference.
TEST(GravityForceTest, AnotherMuIsMadeGood) {
  const double mu = 3.986e14;
  const auto gravity = std::make_shared<const HarmonicGravity>(only_C20(mu), 2);
  const Surroundings around{};
  const double r = norm(kSomewhere_ECEF);
  const Vec3 point_mass = -kMuEarth_m3ps2 / (r * r * r) * kSomewhere_ECEF;
  const Vec3 whole =
      point_mass + GravityForce(gravity).acceleration_ECI({{}, kSomewhere_ECEF, {}, 1}, around);
  EXPECT_LT(relative_difference(whole, gravity->acceleration_ECEF(kSomewhere_ECEF)), 1e-15);
}

TEST(GravityForceTest, NullFieldIsRefused) {
  EXPECT_THROW(GravityForce(nullptr), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
