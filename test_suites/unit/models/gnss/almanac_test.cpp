#include <orrery/models/gnss/almanac.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <numbers>
#include <string>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kPi = std::numbers::pi;

std::string yuma() {
  return "******** Week 866 almanac for PRN-01 ********\n"
         "ID:                         01\n"
         "Health:                     000\n"
         "Eccentricity:               0.5221366882E-002\n"
         "Time of Applicability(s):  589824.0000\n"
         "Orbital Inclination(rad):   0.9637857480\n"
         "Rate of Right Ascen(r/s):  -0.7897471819E-008\n"
         "SQRT(A)  (m 1/2):           5153.602051\n"
         "Right Ascen at Week(rad):  -0.1159458779E+001\n"
         "Argument of Perigee(rad):   0.451712027\n"
         "Mean Anom(rad):            -0.2105941778E+001\n"
         "Af0(s):                     0.1621246338E-004\n"
         "Af1(s/s):                   0.0000000000E+000\n"
         "week:                        866\n"
         "\n"
         "******** Week 866 almanac for PRN-32 ********\n"
         "ID:                         32\n"
         "Health:                     063\n"
         "Eccentricity:               0.5221366882E-003\n"
         "Time of Applicability(s):  589824.0000\n"
         "Orbital Inclination(rad):   0.9637857480\n"
         "Rate of Right Ascen(r/s):  -0.7897471819E-008\n"
         "SQRT(A)  (m 1/2):           5153.602051\n"
         "Right Ascen at Week(rad):   0.1159458779E+001\n"
         "Argument of Perigee(rad):   0.451712027\n"
         "Mean Anom(rad):             0.2105941778E+001\n"
         "Af0(s):                    -0.1621246338E-004\n"
         "Af1(s/s):                   0.3637978807E-11\n"
         "week:                        866\n";
}

std::string sem() {
  return "2  CURRENT.ALM\n"
         " 866 589824\n"
         "\n"
         "1\n63\n0\n"
         " 5.221366882E-03  6.780E-03 -2.513843E-09\n"
         " 5153.602051  -3.690672E-01  1.437844E-01\n"
         " -6.703421E-01  1.621246E-05  0.000000E+00\n"
         "0\n11\n"
         "\n"
         "32\n70\n0\n"
         " 5.221366882E-04  6.780E-03 -2.513843E-09\n"
         " 5153.602051   3.690672E-01  1.437844E-01\n"
         " 6.703421E-01  -1.621246E-05  3.637979E-12\n"
         "63\n11\n";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, text.npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(GpsAlmanacTest, YumaGivesWhatItsLabelsSay) {
  const GpsAlmanac almanac = parse_yuma(yuma(), "a.alm");
  ASSERT_EQ(almanac.size(), 2u);
  const GpsAlmanacEntry expected{.prn = 32,
                                 .week = 866,
                                 .health = 63,
                                 .toa_s = 589824,
                                 .eccentricity = 0.5221366882e-3,
                                 .inclination_rad = 0.9637857480,
                                 .raan_rate_radps = -0.7897471819e-8,
                                 .sqrt_a_sqrtm = 5153.602051,
                                 .raan0_rad = 1.159458779,
                                 .argument_of_perigee_rad = 0.451712027,
                                 .mean_anomaly_rad = 2.105941778,
                                 .af0_s = -0.1621246338e-4,
                                 .af1_sps = 0.3637978807e-11};
  EXPECT_EQ(almanac[1], expected);
  EXPECT_EQ(almanac[0].prn, 1);
}

// SEM's angles are semicircles and its inclination an offset from 0.3 of one: values by hand.
TEST(GpsAlmanacTest, SemGivesWhatItsPlacesSay) {
  const GpsAlmanac almanac = parse_sem(sem(), "a.al3");
  ASSERT_EQ(almanac.size(), 2u);
  const GpsAlmanacEntry& one = almanac[0];
  EXPECT_EQ(one.prn, 1);
  EXPECT_EQ(one.week, 866);
  EXPECT_EQ(one.health, 0);
  EXPECT_EQ(one.toa_s, 589824);
  EXPECT_DOUBLE_EQ(one.eccentricity, 5.221366882e-3);
  EXPECT_DOUBLE_EQ(one.inclination_rad, 0.30678 * kPi);
  EXPECT_DOUBLE_EQ(one.raan_rate_radps, -2.513843e-9 * kPi);
  EXPECT_DOUBLE_EQ(one.sqrt_a_sqrtm, 5153.602051);
  EXPECT_DOUBLE_EQ(one.raan0_rad, -0.3690672 * kPi);
  EXPECT_DOUBLE_EQ(one.argument_of_perigee_rad, 0.1437844 * kPi);
  EXPECT_DOUBLE_EQ(one.mean_anomaly_rad, -0.6703421 * kPi);
  EXPECT_DOUBLE_EQ(one.af0_s, 1.621246e-5);
  EXPECT_EQ(almanac[1].health, 63);
}

TEST(GpsAlmanacTest, CarriedAlmanacIsTheRealConstellation) {
  const GpsAlmanac almanac = carried_almanac();
  ASSERT_EQ(almanac.size(), 31u);
  for (const GpsAlmanacEntry& entry : almanac) {
    EXPECT_NE(entry.prn, 4);
    EXPECT_EQ(entry.week, 866);
    // GPS: 26 560 km within 50 km; launched to 55 degrees, 51 to 57 after years.
    EXPECT_NEAR(entry.sqrt_a_sqrtm * entry.sqrt_a_sqrtm, 26.56e6, 5e4) << entry.prn;
    EXPECT_NEAR(entry.inclination_rad, 55 * kPi / 180, 4 * kPi / 180) << entry.prn;
  }
}

TEST(GpsAlmanacTest, CarriedAlmanacIsThePublishedFile) {
  const std::filesystem::path path =
      std::filesystem::path(ORRERY_REFERENCE_DATA) / "gps" / "yuma_week0866_2016-03-31.alm";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path << " (ORRERY_REFERENCE_DATA)";
  EXPECT_EQ(load_almanac(path.string()), carried_almanac());
}

// Each defect alone: what is changed, into what, and what the refusal says.
struct Defect {
  std::string what, by, said;
};

TEST(GpsAlmanacTest, DefectsOfYumaAreNamedWithTheirLine) {
  for (const Defect& d : {
           Defect{"ID:                         01", "ID: 33", "line 2: PRN is '33'"},
           Defect{"Health:", "Wealth:", "line 3: 'Wealth:"},
           Defect{"0.5221366882E-002", "0.52x", "line 4: eccentricity is '0.52x'"},
           Defect{"0.5221366882E-002", "0.5221366882", "line 4: eccentricity = 0.522137; accepted"},
           Defect{"5153.602051", "515.3602051", "line 8: square root of the semi-major axis"},
           Defect{"Mean Anom(rad):            -0.2105941778E+001\n", "", "line 11: 'Af0(s)"},
           Defect{"week:                        866\n\n", "week 866\n\n",
                  "line 14: 'week 866' has no colon"},
           Defect{"******** Week", "Week", "line 1: 'Week"},
           Defect{"ID:                         32", "ID: 1", "line 29: PRN 1 comes twice"},
       }) {
    EXPECT_THAT([&] { parse_yuma(replaced(yuma(), d.what, d.by), "a.alm"); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("GpsAlmanac: a.alm"), HasSubstr(d.said))));
  }
  const std::string whole = yuma();
  // The line end alone may be missing, as in published files; a digit may not.
  EXPECT_EQ(parse_yuma(whole.substr(0, whole.size() - 1), "a.alm"), parse_yuma(whole, "a.alm"));
  EXPECT_THROW(parse_yuma(whole.substr(0, whole.size() - 2), "a.alm"), std::invalid_argument);
  EXPECT_THROW(parse_yuma("", "a.alm"), std::invalid_argument);
}

TEST(GpsAlmanacTest, DefectsOfSemAreNamedWithTheirLine) {
  for (const Defect& d : {
           Defect{"2  CURRENT", "3  CURRENT", "cut short: expected the PRN"},
           Defect{"2  CURRENT", "1  CURRENT", "after the last of 1 records"},
           Defect{" 866 589824", " 866", "line 2: ' 866' has 1 fields; expected week"},
           Defect{" 866 589824", " 866 604801", "line 2: time of applicability = 604801"},
           Defect{"6.780E-03", "0.5", "line 7: inclination = 2.5"},
           Defect{"5153.602051", "nan", "line 8: square root of the semi-major axis is 'nan'"},
           Defect{"32\n70", "1\n70", "PRN 1 comes twice"},
       }) {
    EXPECT_THAT([&] { parse_sem(replaced(sem(), d.what, d.by), "a.al3"); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("GpsAlmanac: a.al3"), HasSubstr(d.said))))
        << d.what;
  }
}

TEST(GpsAlmanacTest, FileThatIsNotThereIsNamed) {
  EXPECT_THAT([] { load_almanac("/nowhere.alm"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("cannot read '/nowhere.alm'")));
}

}  // namespace
}  // namespace orrery
