#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/orbit/gravity.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "direct_potential.hpp"

namespace orrery {
namespace {

// Anywhere from the surface to 40000 km, poles to within a few degrees.
Vec3 random_position(RandomStream& random) {
  const double radius = random.uniform(6.4e6, random.bernoulli(0.8) ? 8e6 : 4e7);
  const double sin_latitude = random.uniform(-0.999, 0.999);
  const double longitude = random.uniform(-3.2, 3.2);
  const double in_plane = radius * std::sqrt(1 - sin_latitude * sin_latitude);
  return {in_plane * std::cos(longitude), in_plane * std::sin(longitude), radius * sin_latitude};
}

// The same series in long double by another formulation. J2 dominates the sum; the coefficients'
// scale factors and the 60 steps of the recursion round to some 1e-16 each; observed 1.4e-15.
TEST(HarmonicGravityValidation, AgreesWithDirectSumsInLongDouble) {
  const GravityField field = GravityField::ggm05s();
  RandomStream random(1);
  double largest = 0;
  for (const int degree : {2, 3, 4, 5, 7, 8, 9, 20, 59, 60}) {
    const HarmonicGravity gravity(field, degree);
    for (int k = 0; k < 60; ++k) {
      const Vec3 r = random_position(random);
      const Vec3 a = gravity.perturbation_ECEF(r);
      const DirectPotential direct = direct_potential(field, degree, r);
      const Vec3 expected{static_cast<double>(direct.gradient[0]),
                          static_cast<double>(direct.gradient[1]),
                          static_cast<double>(direct.gradient[2])};
      largest = std::max(largest, norm(a - expected) / norm(expected));
    }
  }
  RecordProperty("largest_relative_error_1e_15", std::to_string(largest * 1e15));
  EXPECT_LT(largest, 1e-14);
}

// The direct sums themselves, against their own potential by central differences over 1 km:
// truncation (h^2/6)(60/r)^2 = 1.5e-5 of the shortest waves, rounding 1e-19 U/h. They share no
// formula for the slope.
TEST(HarmonicGravityValidation, DirectSumsAreTheGradientOfTheirPotential) {
  const GravityField field = GravityField::ggm05s();
  RandomStream random(2);
  for (int k = 0; k < 20; ++k) {
    const Vec3 r = random_position(random);
    const DirectPotential at = direct_potential(field, 60, r);
    constexpr double h = 1000;
    const Vec3 steps[] = {{h, 0, 0}, {0, h, 0}, {0, 0, h}};
    for (int i = 0; i < 3; ++i) {
      const long double slope = (direct_potential(field, 60, r + steps[i]).value -
                                 direct_potential(field, 60, r - steps[i]).value) /
                                (2 * h);
      EXPECT_NEAR(static_cast<double>(slope - at.gradient[i]), 0, 2e-7);
    }
  }
}

// Laplace and curl: the field is harmonic and conservative, whatever its coefficients. Gravity
// gradient 2e-6 1/s^2; central differences over 100 m err by (h^2/6) of third derivatives, 60^2/r^2
// at most of the harmonics' share: 1e-12; rounding 1e-15 * 10/100 = 1e-16.
TEST(HarmonicGravityValidation, FieldIsHarmonicAndConservative) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 60);
  RandomStream random(3);
  for (int k = 0; k < 50; ++k) {
    const Vec3 r = random_position(random);
    constexpr double h = 100;
    const auto column = [&](const Vec3& d) {
      return (gravity.acceleration_ECEF(r + d) - gravity.acceleration_ECEF(r - d)) / (2 * h);
    };
    const Vec3 x = column({h, 0, 0}), y = column({0, h, 0}), z = column({0, 0, h});
    EXPECT_NEAR(x.x + y.y + z.z, 0, 2e-13);
    EXPECT_NEAR(x.y - y.x, 0, 2e-13);
    EXPECT_NEAR(x.z - z.x, 0, 2e-13);
    EXPECT_NEAR(y.z - z.y, 0, 2e-13);
  }
}

struct PublishedFieldTest : testing::Test {
  void SetUp() override {
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here";
  }
  const std::string path = std::string(ORRERY_REFERENCE_DATA) + "/gravity/GGM05S_d120.gfc";
};

TEST_F(PublishedFieldTest, CompiledInCoefficientsAreThePublishedOnes) {
  const GravityField published = GravityField::load(path, 60), ours = GravityField::ggm05s();
  EXPECT_EQ(published.mu_m3ps2(), ours.mu_m3ps2());
  EXPECT_EQ(published.radius_m(), ours.radius_m());
  for (int n = 0; n <= 60; ++n) {
    for (int m = 0; m <= n; ++m) {
      EXPECT_EQ(published.C(n, m), ours.C(n, m)) << n << " " << m;
      EXPECT_EQ(published.S(n, m), ours.S(n, m)) << n << " " << m;
    }
  }
}

// A real file cut short: its header announces degree 180, its lines end at 120.
TEST_F(PublishedFieldTest, FileWithFewerDegreesThanAnnouncedIsRefused) {
  EXPECT_THAT([&] { GravityField::load(path); },
              testing::ThrowsMessage<std::invalid_argument>(
                  testing::AllOf(testing::HasSubstr(path), testing::HasSubstr("cut short"),
                                 testing::HasSubstr("n = 120, m = 120"))));
  EXPECT_EQ(GravityField::load(path, 120).degree(), 120);
}

TEST_F(PublishedFieldTest, HigherDegreesSumRightToo) {
  const GravityField field = GravityField::load(path, 120);
  const HarmonicGravity gravity(field, 120);
  const Vec3 r{4.0e6, -3.2e6, 4.6e6};
  const DirectPotential direct = direct_potential(field, 120, r);
  const Vec3 a = gravity.perturbation_ECEF(r);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], static_cast<double>(direct.gradient[i]), 1e-15);
}

}  // namespace
}  // namespace orrery
