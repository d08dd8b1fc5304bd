// Every way to sum gives the same bits: plain, AVX2, AVX-512, alone and two at a time.
#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/orbit/gravity.hpp>
#include <orrery/models/orbit/gravity_force.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace orrery {
namespace {

using Bits = std::array<std::uint64_t, 3>;

Bits bits(const Vec3& v) {
  return {std::bit_cast<std::uint64_t>(v.x), std::bit_cast<std::uint64_t>(v.y),
          std::bit_cast<std::uint64_t>(v.z)};
}

// From the reference radius to 40000 km and beyond the Moon; poles, equator and axes among them.
std::vector<Vec3> positions(int count) {
  RandomStream random(1);
  std::vector<Vec3> all = {{0, 0, 7e6},    {0, 0, -7e6},  {7e6, 0, 0},       {0, -7e6, 0},
                           {-0.0, 7e6, 0}, {5e6, 5e6, 0}, {6378136.3, 0, 0}, {0, 1e-3, 9e6}};
  while (static_cast<int>(all.size()) < count) {
    const double far = random.uniform(0, 1);
    const double radius = random.uniform(6.3782e6, far < 0.8 ? 7.5e6 : far < 0.95 ? 4.2e7 : 5e8);
    const double sin_latitude = random.uniform(-1, 1);
    const double longitude = random.uniform(-3.2, 3.2);
    const double in_plane = radius * std::sqrt(1 - sin_latitude * sin_latitude);
    all.push_back(
        {in_plane * std::cos(longitude), in_plane * std::sin(longitude), radius * sin_latitude});
  }
  return all;
}

// A made-up field with Kaula's rule for its size, 1e-5/n^2.
GravityField made_up_field(int degree) {
  RandomStream random(2);
  std::string text = "earth_gravity_constant 3.986004415e14\nradius 6378136.3\nmax_degree " +
                     std::to_string(degree) + "\nend_of_head\n";
  char line[96];
  for (int n = 2; n <= degree; ++n) {
    for (int m = 0; m <= n; ++m) {
      const double C = random.uniform(-1e-5, 1e-5) / (n * n);
      const double S = m == 0 ? 0 : random.uniform(-1e-5, 1e-5) / (n * n);
      std::snprintf(line, sizeof line, "gfc %d %d %.16e %.16e\n", n, m, C, S);
      text += line;
    }
  }
  return GravityField::parse(text, "made up");
}

void expect_equal_bits(const GravityField& field, int degree, const std::vector<Vec3>& where) {
  std::vector<Bits> expected;
  for (const VectorPath path : HarmonicGravity::available_paths()) {  // plain comes first
    const HarmonicGravity gravity(field, degree, path);
    ASSERT_EQ(gravity.path(), path);
    std::vector<Vec3> together(where.size());
    gravity.perturbations_ECEF(where, together);
    int different = 0;
    for (std::size_t i = 0; i < where.size(); ++i) {
      const Bits alone = bits(gravity.perturbation_ECEF(where[i]));
      if (path == VectorPath::kPlain) expected.push_back(alone);
      different += alone != expected[i];
      different += bits(together[i]) != expected[i];
      ASSERT_TRUE(is_finite(together[i]));
    }
    EXPECT_EQ(different, 0) << to_string(path) << ", degree " << degree;
  }
}

TEST(GravityPathsTest, EveryPathGivesTheSameBitsAtEveryDegree) {
  const GravityField field = GravityField::ggm05s();
  const std::vector<Vec3> where = positions(41);  // odd: the last one of a batch is alone
  for (int degree = 2; degree <= 60; ++degree) expect_equal_bits(field, degree, where);
}

TEST(GravityPathsTest, EveryPathGivesTheSameBitsAtManyPlaces) {
  expect_equal_bits(GravityField::ggm05s(), 60, positions(1501));
}

TEST(GravityPathsTest, EveryPathGivesTheSameBitsAtHighDegrees) {
  const GravityField field = made_up_field(360);
  const std::vector<Vec3> where = positions(21);
  for (const int degree : {61, 62, 63, 64, 65, 119, 200, 360})
    expect_equal_bits(field, degree, where);
}

TEST(GravityPathsTest, WidestPathIsTheDefault) {
  const std::vector<VectorPath> available = HarmonicGravity::available_paths();
  ASSERT_FALSE(available.empty());
  EXPECT_EQ(available.front(), VectorPath::kPlain);
  EXPECT_EQ(HarmonicGravity(GravityField::ggm05s(), 2).path(), available.back());
}

TEST(GravityPathsTest, PathThatTheProcessorLacksIsRefused) {
  const std::vector<VectorPath> available = HarmonicGravity::available_paths();
  for (const VectorPath path : {VectorPath::kPlain, VectorPath::kAvx2, VectorPath::kAvx512}) {
    const auto make = [&] { HarmonicGravity(GravityField::ggm05s(), 2, path); };
    if (std::count(available.begin(), available.end(), path) > 0) {
      EXPECT_NO_THROW(make());
    } else {
      EXPECT_THAT(make, testing::ThrowsMessage<std::invalid_argument>(
                            testing::HasSubstr(std::string(to_string(path)))));
    }
  }
}

TEST(GravityPathsTest, BatchOfWholeAccelerationsIsOneByOne) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 60);
  const std::vector<Vec3> where = positions(21);
  for (const std::size_t count : {0u, 1u, 2u, 3u, 8u, 21u}) {
    const std::span<const Vec3> some(where.data(), count);
    std::vector<Vec3> together(count);
    gravity.accelerations_ECEF(some, together);
    for (std::size_t i = 0; i < count; ++i)
      EXPECT_EQ(bits(together[i]), bits(gravity.acceleration_ECEF(where[i])));
  }
}

TEST(GravityPathsTest, BatchMayOverwriteItsPositions) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 20);
  const std::vector<Vec3> where = positions(12);
  std::vector<Vec3> in_place = where;
  gravity.perturbations_ECEF(in_place, in_place);
  for (std::size_t i = 0; i < where.size(); ++i)
    EXPECT_EQ(bits(in_place[i]), bits(gravity.perturbation_ECEF(where[i])));
}

TEST(GravityPathsTest, BatchRefusesBadInputBeforeItWrites) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 4);
  std::vector<Vec3> where = {{7e6, 0, 0}, {0, 7e6, 0}, {6e6, 0, 0}};
  std::vector<Vec3> a(3, Vec3{1, 2, 3});
  EXPECT_THROW(gravity.perturbations_ECEF(where, a), std::domain_error);
  EXPECT_EQ(a[0], (Vec3{1, 2, 3}));
  where[2].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(gravity.accelerations_ECEF(where, a), std::domain_error);
  a.pop_back();
  EXPECT_THROW(gravity.perturbations_ECEF(where, a), std::invalid_argument);
}

// Bits of this and of every other build: computed once by g++ in release, so that a compiler, an
// optimisation or a processor that computes otherwise is seen. The values themselves are checked
// in gravity_test.cpp; a change of the method changes them.
TEST(GravityPathsTest, BitsAreThoseOfEveryBuild) {
  const HarmonicGravity gravity(GravityField::ggm05s(), 60);
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a over words
  for (const Vec3& r : {Vec3{4.0e6, -3.2e6, 4.6e6}, Vec3{-6.9e6, 1e5, 3e5}, Vec3{1e5, -2e5, 7e6},
                        Vec3{2.5e7, 3e7, -1e6}}) {
    for (const std::uint64_t word : bits(gravity.acceleration_ECEF(r)))
      hash = (hash ^ word) * 1099511628211u;
  }
  EXPECT_EQ(hash, 9228275808493012694u);
}

}  // namespace
}  // namespace orrery
