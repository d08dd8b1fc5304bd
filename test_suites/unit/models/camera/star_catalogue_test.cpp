#include <orrery/models/camera/star_catalogue.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <stdexcept>

#include "angles.hpp"

namespace orrery {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const std::filesystem::path kStars = std::filesystem::path(ORRERY_REFERENCE_DATA) / "stars";

double angle_rad(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b));
}

TEST(StarCatalogueTest, ReadsColumnsByNameInAnyOrderAndEmptyOnesAsUnknown) {
  const StarCatalogue catalogue = StarCatalogue::parse_csv(
      "vmag,hip,note,dec_deg_j2000,ra_deg_j2000,pm_dec_mas_yr,pm_ra_cosdec_mas_yr,b_v\n"
      "2.5,7,x,30,90,,,\n"
      "1.5,8,y,0,0,1000,-500,0.62\n",
      "two.csv");
  ASSERT_EQ(catalogue.stars().size(), 2u);
  const Star& bright = catalogue.stars()[0];
  EXPECT_EQ(bright.number, 8);
  EXPECT_EQ(bright.b_v, 0.62);
  EXPECT_NEAR(bright.proper_motion_ECI_radpyr.y, -0.5 * kArcsecond, 1e-20);
  EXPECT_NEAR(bright.proper_motion_ECI_radpyr.z, 1.0 * kArcsecond, 1e-20);
  const Star& faint = catalogue.stars()[1];
  EXPECT_FALSE(faint.b_v);
  EXPECT_EQ(norm(faint.proper_motion_ECI_radpyr), 0);
  EXPECT_NEAR(faint.direction_ECI.y, std::cos(30 * kDegree), 1e-15);
  EXPECT_NEAR(faint.direction_ECI.z, 0.5, 1e-15);
}

TEST(StarCatalogueTest, SaysWhatIsWrongAndWhere) {
  const auto csv = [](const char* text) {
    return [text] { StarCatalogue::parse_csv(text, "a.csv"); };
  };
  using E = std::invalid_argument;
  EXPECT_THAT(csv("ra_deg_j2000,vmag\n1,2\n"), ThrowsMessage<E>(HasSubstr("dec_deg_j2000")));
  EXPECT_THAT(csv("ra_deg_j2000,dec_deg_j2000,vmag\n1,91,2\n"),
              ThrowsMessage<E>(HasSubstr("a.csv, line 2")));
  EXPECT_THAT(csv("ra_deg_j2000,dec_deg_j2000,vmag\n1,2\n"), ThrowsMessage<E>(HasSubstr("line 2")));
  EXPECT_THAT(csv("ra_deg_j2000,dec_deg_j2000,vmag\n"), ThrowsMessage<E>(HasSubstr("no star")));
  EXPECT_THAT(csv("ra_deg_j2000,dec_deg_j2000,vmag\n1,2,nan\n"),
              ThrowsMessage<E>(HasSubstr("vmag")));
  EXPECT_THAT([] { StarCatalogue::parse_xplanet("-16.7 25.7 1\n", "BSC"); },
              ThrowsMessage<E>(HasSubstr("BSC, line 1")));
  EXPECT_THAT([] { StarCatalogue::load("/no/such.csv"); }, ThrowsMessage<E>(HasSubstr("no/such")));
}

// Sirius moves by (-546, -1223) mas/yr: over 25 years by 33.5".
TEST(StarCatalogueTest, ProperMotionIsAppliedAlongTheSky) {
  const StarCatalogue catalogue = StarCatalogue::parse_csv(
      "ra_deg_j2000,dec_deg_j2000,pm_ra_cosdec_mas_yr,pm_dec_mas_yr,vmag\n"
      "101.287149,-16.716113,-546.0,-1223.1,-1.44\n",
      "sirius.csv");
  const Star& sirius = catalogue.stars()[0];
  const Vec3 now = direction_ECI(sirius, 25.0);
  EXPECT_NEAR(angle_rad(sirius.direction_ECI, now) / kArcsecond, 25 * std::hypot(0.546, 1.2231),
              1e-5);
  const double dec = std::asin(now.z), ra = std::atan2(now.y, now.x);
  EXPECT_NEAR(dec / kDegree, -16.716113 - 25 * 1.2231 / 3600, 1e-7);
  EXPECT_NEAR(ra / kDegree, 101.287149 - 25 * 0.546 / 3600 / std::cos(16.72 * kDegree), 1e-6);
  EXPECT_NEAR(julian_years(gps_midnight(2025, 1, 1)), 25.0, 2e-3);
}

// Classical aberration is v/c sin(theta) towards the motion, less than 1e-4 of it beside the exact
// one. The Earth's: 20.5" (constant of aberration 20.49552", eccentricity 1.7 %).
TEST(StarCatalogueTest, AberrationIsTowardsTheMotionByVOverC) {
  const Vec3 v{0, 7600, 0};
  const Vec3 seen = aberrated({1, 0, 0}, v);
  EXPECT_NEAR(seen.y, 7600 / 299792458.0, 1e-12);
  EXPECT_NEAR(angle_rad(aberrated({0, 1, 0}, v), {0, 1, 0}), 0, 1e-15);
  const double backwards = angle_rad(aberrated(unit({1, 1, 0}), v), {0, 1, 0});
  EXPECT_NEAR(45 * kDegree - backwards, 7600 / 299792458.0 * std::sqrt(0.5), 1e-9);
  for (int month = 1; month <= 12; ++month) {
    const double k = norm(earth_velocity_ECI(gps_midnight(2025, month, 3))) / 299792458.0;
    EXPECT_NEAR(k / kArcsecond, 20.4955, 0.0167 * 20.4955 + 0.01) << month;
  }
  // At 0 h on 20 March 2025, 9 h before the equinox of date, the Sun's longitude is -0.37 deg of
  // date and 0.35 deg less in the axes of 2000 (precession: 50.3" a year). The Earth moves 90 deg
  // behind it, and outwards by e sin(77 deg) = 0.93 deg, since perihelion is at 103 deg.
  const Vec3 march = earth_velocity_ECI(gps_midnight(2025, 3, 20));
  const double longitude = (-90 - 0.37 - 0.35 - 0.93) * kDegree;
  const Vec3 expected{std::cos(longitude), std::sin(longitude) * std::cos(23.439 * kDegree),
                      std::sin(longitude) * std::sin(23.439 * kDegree)};
  EXPECT_LT(angle_rad(march, expected), 0.05 * kDegree);
}

// xplanet's catalogue against an independent conversion of the same one: 0.0001 h of right
// ascension is 5.4", half of it 2.7"; declination to 0.0001 deg and 1".
TEST(StarCatalogueTest, XplanetsBrightStarsAreThoseOfTheYaleCatalogue) {
  if (!std::filesystem::exists("/usr/share/xplanet/stars/BSC") ||
      !std::filesystem::exists(kStars / "bsc5.csv")) {
    GTEST_SKIP() << "needs Debian's package xplanet and the reference data";
  }
  const StarCatalogue ours = StarCatalogue::bright_stars();
  const StarCatalogue theirs = StarCatalogue::load(kStars / "bsc5.csv");
  std::map<int, Star> yale;
  for (const Star& star : theirs.stars()) yale[star.number] = star;
  EXPECT_NEAR(double(ours.stars().size()), 9096, 8);
  int compared = 0;
  for (const Star& star : ours.stars()) {
    const auto at = yale.find(star.number);
    if (at == yale.end()) continue;
    ++compared;
    EXPECT_LT(angle_rad(star.direction_ECI, at->second.direction_ECI), 5 * kArcsecond)
        << star.number;
  }
  EXPECT_GT(compared, 9000);
}

TEST(StarCatalogueTest, ReadsTheDeepCatalogue) {
  if (!std::filesystem::exists(kStars / "stars_v8.csv")) GTEST_SKIP() << "needs the reference data";
  const StarCatalogue deep = StarCatalogue::load(kStars / "stars_v8.csv");
  EXPECT_EQ(deep.stars().size(), 41411u);  // all counts: the data's own README
  EXPECT_EQ(deep.to_magnitude(6.5).stars().size(), 8874u);
  EXPECT_EQ(deep.to_magnitude(4).stars().size(), 519u);
  EXPECT_EQ(deep.stars().front().number, 32349);  // Sirius
}

}  // namespace
}  // namespace orrery
