#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/orbit/gravity.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "../frames/reference_file.hpp"
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

Vec3 to_vec3(const long double (&v)[3]) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

double relative_error(const HarmonicGravity& gravity, const GravityField& field, const Vec3& r) {
  const Vec3 expected = to_vec3(direct_potential(field, gravity.degree(), r).gradient);
  return norm(gravity.perturbation_ECEF(r) - expected) / norm(expected);
}

// The same series in long double by another formulation, up to each degree. J2 dominates the sum;
// its coefficients' scale factors and the recursion round to some 1e-16 each; observed 1.9e-15.
TEST(HarmonicGravityValidation, AgreesWithDirectSumsUpToEachDegree) {
  const GravityField field = GravityField::ggm05s();
  RandomStream random(1);
  double largest = 0;
  for (int degree = 2; degree <= 60; ++degree) {
    const HarmonicGravity gravity(field, degree);
    for (int k = 0; k < 12; ++k)
      largest = std::max(largest, relative_error(gravity, field, random_position(random)));
  }
  RecordProperty("largest_relative_error_1e_15", std::to_string(largest * 1e15));
  EXPECT_LT(largest, 1e-14);
}

// GGM05S with all but one degree taken out.
GravityField one_degree(const GravityField& whole, int degree) {
  std::string text = "earth_gravity_constant 3.986004415e14\nradius 6378136.3\nmax_degree " +
                     std::to_string(degree) + "\nend_of_head\n";
  char line[96];
  for (int n = 2; n <= degree; ++n) {
    for (int m = 0; m <= n; ++m) {
      const bool kept = n == degree;
      std::snprintf(line, sizeof line, "gfc %d %d %.17g %.17g\n", n, m, kept ? whole.C(n, m) : 0,
                    kept ? whole.S(n, m) : 0);
      text += line;
    }
  }
  return GravityField::parse(text, "one degree of GGM05S");
}

// Each degree by itself, so that none hides behind J2. Degree n grows with rho^n and has been
// through n steps of the recursion: the roundings of rho and z count n times, 2e-16 n, and more
// where the terms of a degree cancel at the place. Observed 8.1e-16 n at most, so 1e-14 from degree
// 12 on.
TEST(HarmonicGravityValidation, EachDegreeAloneAgreesWithDirectSums) {
  const GravityField whole = GravityField::ggm05s();
  RandomStream random(4);
  double largest = 0;
  for (int degree = 2; degree <= 60; ++degree) {
    const GravityField field = one_degree(whole, degree);
    const HarmonicGravity gravity(field, degree);
    for (int k = 0; k < 8; ++k) {
      const Vec3 r = random_position(random);
      largest = std::max(largest, relative_error(gravity, field, r) / degree);
    }
  }
  RecordProperty("largest_relative_error_per_degree_1e_16", std::to_string(largest * 1e16));
  EXPECT_LT(largest, 2e-15);
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

// Laplace and curl: the field is harmonic and conservative, whatever its coefficients. Gradient of
// the perturbation, 1e-8 1/s^2, by differences of fourth order over h = 500 m: they err by (h^4/30)
// of fifth derivatives, for degree 60 near the ground 2e-5 m/s^2 (65/r)^5 = 2e-30: 4e-21 and some
// ten times that with the other degrees; rounding 1e-2 m/s^2 2e-15 (3/2)/h = 6e-20.
// Observed 5.7e-20, 6e-12 of the gradient.
TEST(HarmonicGravityValidation, FieldIsHarmonicAndConservative) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 60);
  RandomStream random(3);
  double largest = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3 r = k == 0 ? Vec3{0, 0, 7e6} : k == 1 ? Vec3{0, 0, -6.5e6} : random_position(random);
    constexpr double h = 500;
    const auto slope = [&](const Vec3& d) {
      const auto difference = [&](double n) {
        return gravity.perturbation_ECEF(r + n * d) - gravity.perturbation_ECEF(r - n * d);
      };
      return (8 * difference(1) - difference(2)) / (12 * h);
    };
    const Vec3 x = slope({h, 0, 0}), y = slope({0, h, 0}), z = slope({0, 0, h});
    for (const double zero : {x.x + y.y + z.z, x.y - y.x, x.z - z.x, y.z - z.y})
      largest = std::max(largest, std::abs(zero));
  }
  RecordProperty("largest_trace_or_asymmetry_1e_20", std::to_string(largest * 1e20));
  EXPECT_LT(largest, 3e-19);
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

// To the file's last degree, 180; observed 0.9e-15.
TEST_F(PublishedFieldTest, HigherDegreesSumRightToo) {
  const auto text = reference_text("gravity/GGM05S_full.gfc.gz");
  if (!text) GTEST_SKIP() << "GGM05S_full.gfc.gz is not here";
  const GravityField field = GravityField::parse(*text, "GGM05S_full.gfc");
  EXPECT_EQ(field.degree(), 180);
  RandomStream random(5);
  double largest = 0;
  for (const int degree : {61, 90, 120, 150, 180}) {
    const HarmonicGravity gravity(field, degree);
    for (int k = 0; k < 4; ++k)
      largest = std::max(largest, relative_error(gravity, field, random_position(random)));
  }
  RecordProperty("largest_relative_error_1e_15", std::to_string(largest * 1e15));
  EXPECT_LT(largest, 1e-14);
}

}  // namespace
}  // namespace orrery
