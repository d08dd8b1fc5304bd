#include <orrery/models/gnss/rinex_navigation.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

const std::string kOrbit2 =
    "    0.850000000000D+02 0.414375000000D+02 0.525557597442D-08 0.165772167412D+01\n"
    "    0.232271850109D-05 0.960697804112D-02 0.617466866970D-05 0.515359739113D+04\n"
    "    0.345600000000D+06-0.558793544769D-08-0.127458719764D+01 0.167638063431D-06\n"
    "    0.939349150611D+00 0.249937500000D+03 0.309739903949D+01-0.838784952606D-08\n"
    "   -0.232152526369D-10 0.100000000000D+01 0.159000000000D+04 0.000000000000D+00\n"
    "    0.240000000000D+01 0.000000000000D+00-0.172294676304D-07 0.850000000000D+02\n"
    "    0.338418000000D+06 0.400000000000D+01 0.000000000000D+00 0.000000000000D+00\n";

std::string version_2() {
  return "     2              NAVIGATION DATA                         RINEX VERSION / TYPE\n"
         "    0.4657D-08  0.1490D-07 -0.5960D-07 -0.1192D-06          ION ALPHA\n"
         "    0.8192D+05  0.8192D+05 -0.6554D+05 -0.5243D+06          ION BETA\n"
         "    15                                                      LEAP SECONDS\n"
         "                                                            END OF HEADER\n"
         " 2 10  7  1  0  0  0.0 0.269108917564D-03 0.318323145621D-11 0.000000000000D+00\n" +
         kOrbit2;
}

// One column further to the right, with a GLONASS record between.
std::string version_3() {
  std::string orbit;
  std::string rest = kOrbit2;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n') + 1;
    orbit += " " + rest.substr(0, end);
    rest.erase(0, end);
  }
  const std::string zero = "     0.000000000000D+00 0.000000000000D+00 0.000000000000D+00\n";
  return "     3.04           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE\n"
         "GPSA   0.4657D-08  0.1490D-07 -0.5960D-07 -0.1192D-06       IONOSPHERIC CORR\n"
         "GPSB   0.8192D+05  0.8192D+05 -0.6554D+05 -0.5243D+06       IONOSPHERIC CORR\n"
         "                                                            END OF HEADER\n"
         "R01 2010 07 01 00 15 00-0.136290676892D-03-0.397903932026D-11 0.000000000000D+00\n" +
         zero + zero + zero +
         "G02 2010 07 01 00 00 00 0.269108917564D-03 0.318323145621D-11 0.000000000000D+00\n" +
         orbit;
}

void expect_read(const RinexNavigation& nav) {
  ASSERT_EQ(nav.ephemerides.size(), 1u);
  BroadcastEphemeris e;
  e.prn = 2;
  e.week = 1590;
  e.toe_s = e.toc_s = 345600;  // 2010-07-01 is a Thursday
  e.sqrt_a_sqrtm = 0.515359739113e4;
  e.eccentricity = 0.960697804112e-2;
  e.i0_rad = 0.939349150611;
  e.raan0_rad = -1.27458719764;
  e.argument_of_perigee_rad = 3.09739903949;
  e.mean_anomaly_rad = 1.65772167412;
  e.delta_n_radps = 0.525557597442e-8;
  e.raan_rate_radps = -0.838784952606e-8;
  e.i_rate_radps = -0.232152526369e-10;
  e.cuc_rad = 0.232271850109e-5;
  e.cus_rad = 0.617466866970e-5;
  e.crc_m = 249.9375;
  e.crs_m = 41.4375;
  e.cic_rad = -0.558793544769e-8;
  e.cis_rad = 0.167638063431e-6;
  e.af0_s = 0.269108917564e-3;
  e.af1_sps = 0.318323145621e-11;
  e.tgd_s = -0.172294676304e-7;
  e.iode = e.iodc = 85;
  e.ura_index = 0;  // 2.4 m
  EXPECT_EQ(nav.ephemerides[0], e);
  ASSERT_TRUE(nav.ionosphere);
  EXPECT_EQ(nav.ionosphere->alpha[2], -0.5960e-7);
  EXPECT_EQ(nav.ionosphere->beta[3], -0.5243e6);
}

TEST(RinexNavigationTest, Version2) {
  const RinexNavigation nav = RinexNavigation::parse(version_2(), "a.10n");
  expect_read(nav);
  EXPECT_EQ(nav.leap_seconds, 15);
}

TEST(RinexNavigationTest, Version3WithOtherSystems) {
  expect_read(RinexNavigation::parse(version_3(), "a.rnx"));
}

TEST(RinexNavigationTest, DefectsAreNamedWithTheirLine) {
  struct Defect {
    std::string what, by, said;
  };
  for (const Defect& d : {
           Defect{"RINEX VERSION", "RYNEX VERSION", "line 1: the first line is not a RINEX"},
           Defect{"     2     ", "     4     ", "line 1: version '     4   '; accepted: 2 and 3"},
           Defect{"NAVIGATION", "OBSERVATIO", "line 1: file type 'O'"},
           Defect{"END OF HEADER", "END OF HEAD", "cut short: no END OF HEADER"},
           Defect{" 2 10  7", "40 10  7", "line 6: PRN is '40'"},
           Defect{" 2 10  7", " 2 10 13", "line 6: month is '13'"},
           Defect{"0.515359739113D+04", "0.515359739113D+03", "line 8: sqrt(A) = 515"},
           Defect{"0.850000000000D+02", "0.850000000000X+02", "line 7: IODE is '0.85"},
           Defect{"0.850000000000D+02", "0.850100000000D+02", "line 7: IODE = 85.01"},
       }) {
    std::string text = version_2();
    const std::size_t at = text.find(d.what);
    ASSERT_NE(at, text.npos) << d.what;
    text.replace(at, d.what.size(), d.by);
    EXPECT_THAT([&] { RinexNavigation::parse(text, "a.10n"); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("RinexNavigation: a.10n, "), HasSubstr(d.said))));
  }
}

TEST(RinexNavigationTest, FileCutAnywhereInARecordIsRefused) {
  const std::string text = version_2();
  const std::size_t records = text.find(" 2 10  7");
  for (std::size_t length = records + 1; length < text.size(); ++length) {
    EXPECT_THROW(RinexNavigation::parse(text.substr(0, length), "a"), std::invalid_argument)
        << length;
  }
}

}  // namespace
}  // namespace orrery
