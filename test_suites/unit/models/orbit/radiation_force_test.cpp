#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/radiation_force.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orrery {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kPi = 3.141592653589793;
constexpr double kAu = 1.495978707e11;

Surroundings sun_at(const Vec3& r_sun_ECI) {
  return {{}, {0, 0, 7.292115e-5}, r_sun_ECI, {3.8e8, 0, 0}};
}

OrbitState at(const Vec3& r_ECI, double mass_kg = 11) {
  return {SimTime(days(16510)), r_ECI, {}, mass_kg};
}

// A place at this distance from the Earth's centre from which the Sun's and the Earth's centres are
// `c` apart; for a Sun in +x so far away that its parallax is found in two corrections.
Vec3 place_of_separation(double radius_m, double c) {
  double angle = c;  // between -r and the x axis
  for (int k = 0; k < 20; ++k) {
    const Vec3 r = radius_m * Vec3{-std::cos(angle), std::sin(angle), 0};
    angle += c - shadow_geometry(r, {kAu, 0, 0}).separation_rad;
  }
  return radius_m * Vec3{-std::cos(angle), std::sin(angle), 0};
}

TEST(ShadowTest, GeometryIsThatOfTheDiscs) {
  const double r = 6928137;
  const ShadowGeometry behind = shadow_geometry({-r, 0, 0}, {kAu, 0, 0});
  EXPECT_NEAR(behind.separation_rad, 0, 1e-15);
  EXPECT_NEAR(behind.earth_rad, std::asin(6378136.3 / r), 1e-15);
  EXPECT_NEAR(behind.sun_rad, std::asin(6.957e8 / (kAu + r)), 1e-15);
  EXPECT_NEAR(shadow_geometry({r, 0, 0}, {kAu, 0, 0}).separation_rad, kPi, 1e-15);
  // Beside the Earth: 90 deg less the parallax r/d.
  EXPECT_NEAR(shadow_geometry({0, r, 0}, {kAu, 0, 0}).separation_rad, kPi / 2 - std::atan(r / kAu),
              1e-15);
}

TEST(ShadowTest, CoveredAreaIsTheClosedForms) {
  // Two equal circles, each through the other's centre: the lens is (2 pi/3 - sqrt(3)/2) a^2.
  EXPECT_NEAR(sunlit_fraction({0.3, 0.3, 0.3}), 1 - (2.0 / 3 - std::sqrt(3) / (2 * kPi)), 1e-15);
  // A small disc whose centre is on a large circle: half, and the sliver between arc and tangent,
  // a third of chord 2a times sagitta a^2/(2b): a/(3 pi b) of the disc; next term (a/b)^3.
  const double a = 0.001, b = 1;
  EXPECT_NEAR(sunlit_fraction({a, b, b}), 0.5 + a / (3 * kPi * b), 1e-9);
  // A ring.
  EXPECT_NEAR(sunlit_fraction({0.3, 0.1, 0.05}), 1 - 1.0 / 9, 1e-15);
}

TEST(ShadowTest, IsContinuousAtItsEdges) {
  const double a = 0.00465, b = 1.17;
  for (const double d : {1e-15, 1e-12, 1e-9, 1e-7}) {
    // A segment of height h has the area 4/3 h sqrt(2 a h) for a << b, of pi a^2; 1e-15 for the
    // roundings of c.
    const double segment = 4.0 / 3 * d * std::sqrt(2 * a * d) / (kPi * a * a) * 1.01 + 1e-12;
    EXPECT_NEAR(sunlit_fraction({a, b, a + b - d}), 1, segment) << d;
    EXPECT_NEAR(sunlit_fraction({a, b, b - a + d}), 0, segment) << d;
    EXPECT_LT(sunlit_fraction({a, b, a + b - 1e-6}), 1) << "and does fall inside";
    EXPECT_GT(sunlit_fraction({a, b, b - a + 1e-6}), 0);
  }
  EXPECT_EQ(sunlit_fraction({a, b, a + b + 1e-12}), 1);
  EXPECT_EQ(sunlit_fraction({a, b, b - a - 1e-12}), 0);
}

// The discs are round on the sphere of directions; Montenbruck & Gill lay them flat. The Earth's
// limb then has the curvature 1/b instead of cot(b): on the Sun's width the two arcs, which touch,
// part by up to a^2/2 (1/b - cot b), and a third of that times 2a lies between them:
// a (1/b - cot b)/(3 pi) of the disc, 2.1e-4 at 550 km. The sum over 400 rings of 400 points each
// adds 1e-5.
TEST(ShadowTest, IsWhatRoundDiscsOnTheSphereCover) {
  const double radius_m = 6928137;
  const ShadowGeometry g0 = shadow_geometry({-radius_m, 0, 0}, {kAu, 0, 0});
  const double a = g0.sun_rad, b = g0.earth_rad;
  const double tolerance = a * (1 / b - 1 / std::tan(b)) / (3 * kPi) + 1e-5;
  for (double part = -0.9; part < 1; part += 0.2) {
    const double c = b + part * a;
    const Vec3 r = place_of_separation(radius_m, c);
    int seen = 0, all = 0;
    for (int ring = 0; ring < 400; ++ring) {  // rings of equal area
      const double off = a * std::sqrt((ring + 0.5) / 400);
      for (int k = 0; k < 400; ++k, ++all) {
        const double angle = 2 * kPi * (k + 0.5) / 400;
        const double cos_to_earth =
            std::cos(c) * std::cos(off) + std::sin(c) * std::sin(off) * std::cos(angle);
        seen += cos_to_earth < std::cos(b);
      }
    }
    const double nu = sunlit_fraction(shadow_geometry(r, {kAu, 0, 0}));
    EXPECT_NEAR(nu, static_cast<double>(seen) / all, tolerance) << part;
  }
}

TEST(ShadowTest, MarginsChangeSignWhereRegionsMeet) {
  for (double c = 1.1; c < 1.25; c += 0.0007) {
    const ShadowGeometry g{0.00465, 1.17, c};
    for (const Illumination region :
         {Illumination::kUmbra, Illumination::kPenumbra, Illumination::kSunlight}) {
      EXPECT_EQ(margin_rad(g, region) > 0, illumination(g) == region) << c;
    }
  }
}

// P0 Cr A/m by hand: 4.56e-6 * 1.8 * 0.06 / 11 = 4.47709e-8 m/s^2 at 1 au.
TEST(RadiationForceTest, PushesAwayFromTheSunWithTheTextbooksForce) {
  const RadiationForce force;
  const Vec3 a = force.acceleration_ECI(at({7e6, 0, 0}), sun_at({kAu + 7e6, 0, 0}));
  EXPECT_NEAR(a.x, -4.477090909090909e-8, 1e-22);
  EXPECT_NEAR(std::hypot(a.y, a.z), 0, 1e-30);
  const Vec3 far = force.acceleration_ECI(at({7e6, 0, 0}), sun_at({2 * kAu + 7e6, 0, 0}));
  EXPECT_NEAR(far.x / a.x, 0.25, 1e-14) << "with the square of the distance";
  const Vec3 light = force.acceleration_ECI(at({7e6, 0, 0}, 5.5), sun_at({kAu + 7e6, 0, 0}));
  EXPECT_NEAR(light.x / a.x, 2, 1e-14) << "with the inverse of the present mass";
  const Vec3 sun{1e11, 7e10, 8e10}, r{3e6, 6e6, -1e6};
  const Vec3 aslant = force.acceleration_ECI(at(r), sun_at(sun));
  EXPECT_NEAR(norm(unit(aslant) - unit(r - sun)), 0, 1e-15);
}

TEST(RadiationForceTest, ShadowModelsDarkenAsTheySay) {
  const Vec3 sun{kAu, 0, 0};
  const double radius_m = 6928137;
  const double b = shadow_geometry({-radius_m, 0, 0}, sun).earth_rad;
  const RadiationForce cone, states({.shadow = ShadowModel::kThreeStates}),
      none({.shadow = ShadowModel::kNone});
  const auto light = [&](const RadiationForce& force, double c) {
    const OrbitState state = at(place_of_separation(radius_m, c));
    return norm(force.acceleration_ECI(state, sun_at(sun))) /
           norm(none.acceleration_ECI(state, sun_at(sun)));
  };
  EXPECT_EQ(light(cone, b - 0.01), 0);
  EXPECT_EQ(light(states, b - 0.01), 0);
  EXPECT_GT(light(cone, b - 0.002), 0.15);
  EXPECT_LT(light(cone, b - 0.002), 0.35);
  EXPECT_NEAR(light(states, b - 0.002), 0.5, 1e-15);
  EXPECT_NEAR(light(states, b + 0.004), 0.5, 1e-15);
  EXPECT_NEAR(light(cone, b + 0.01), 1, 1e-15);
  EXPECT_NEAR(light(states, b + 0.01), 1, 1e-15);
}

// In the memory's region the three states hold up to the edge and beyond it, until it is crossed.
TEST(RadiationForceTest, MemoryHoldsTheStateUntilTheEdgeIsCrossed) {
  const Surroundings around = sun_at({kAu, 0, 0});
  const double radius_m = 6928137;
  // At the edge: the Sun's apparent radius depends on the place, by 1e-7.
  const ShadowGeometry g = shadow_geometry(place_of_separation(radius_m, 1.17), around.r_sun_ECI);
  const double outer = g.earth_rad + g.sun_rad, inner = g.earth_rad - g.sun_rad;
  const RadiationForce force({.shadow = ShadowModel::kThreeStates});
  const auto place = [&](double c) { return at(place_of_separation(radius_m, c)); };
  const auto push = [&](const ForceMemory& m, double c) {
    return norm(force.acceleration_ECI(place(c), around, m));
  };
  const double full = norm(
      RadiationForce({.shadow = ShadowModel::kNone}).acceleration_ECI(place(outer + 0.01), around));

  const ForceMemory sunlit = force.begin(place(outer + 0.01), around);
  EXPECT_GT(force.margin(place(outer + 1e-9), around, sunlit), 0);
  EXPECT_LT(force.margin(place(outer - 1e-9), around, sunlit), 0);
  EXPECT_NEAR(push(sunlit, outer - 1e-6), full, 1e-6 * full);

  const ForceMemory penumbra = force.crossed(sunlit, place(outer), around);
  EXPECT_GT(force.margin(place(outer - 1e-9), around, penumbra), 0);
  EXPECT_LT(force.margin(place(outer + 1e-9), around, penumbra), 0);
  EXPECT_LT(force.margin(place(inner - 1e-9), around, penumbra), 0);
  EXPECT_NEAR(push(penumbra, outer + 1e-6), full / 2, 1e-6 * full);

  const ForceMemory umbra = force.crossed(penumbra, place(inner), around);
  EXPECT_GT(force.margin(place(inner - 1e-9), around, umbra), 0);
  EXPECT_LT(force.margin(place(inner + 1e-9), around, umbra), 0);
  EXPECT_EQ(push(umbra, inner + 1e-6), 0);
  EXPECT_EQ(force.crossed(umbra, place(inner), around).region, penumbra.region);
  EXPECT_EQ(force.crossed(penumbra, place(outer), around).region, sunlit.region);
}

TEST(RadiationForceTest, RefusesWhatIsNoSphere) {
  EXPECT_THAT([] { RadiationForce({.area_m2 = -1}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("area_m2 = -1")));
  EXPECT_THAT(
      [] { RadiationForce({.radiation_coefficient = std::numeric_limits<double>::quiet_NaN()}); },
      ThrowsMessage<std::invalid_argument>(HasSubstr("radiation_coefficient = nan")));
}

}  // namespace
}  // namespace orrery
