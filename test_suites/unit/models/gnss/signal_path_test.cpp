#include <orrery/models/gnss/antenna.hpp>
#include <orrery/models/gnss/gps_constants.hpp>
#include <orrery/models/gnss/signal_path.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "leo_scene.hpp"

namespace orrery {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;

TEST(AntennaPatternTest, GainIsTheTablesAndLinearBetween) {
  const AntennaPattern patch = AntennaPattern::patch();
  EXPECT_EQ(patch.peak_dBi(), 4.0);
  EXPECT_EQ(patch.gain_dBi(0), 4.0);
  EXPECT_NEAR(patch.gain_dBi(62.5 * kDegree), -0.3, 1e-12);
  EXPECT_NEAR(patch.gain_dBi(55 * kDegree), (1.0 + 0.3) / 2, 1e-12);
  EXPECT_NEAR(patch.gain_dBi(90 * kDegree), -5.0, 1e-12);
  EXPECT_EQ(patch.gain_dBi(kPi), -18.0);  // nothing is published beyond 157.5 deg
}

TEST(AntennaPatternTest, DefectsAreNamedWithTheirLine) {
  const std::string head = "off_boresight_deg,gain_dbi\n";
  const auto expect_refused = [](const std::string& text, const char* said) {
    EXPECT_THAT([&] { AntennaPattern::parse(text, "a.csv"); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(said)));
  };
  expect_refused("", "AntennaPattern: a.csv, line 0: the first line");
  expect_refused(head + "0,4\n0,3\n", "line 3: angles do not rise");
  expect_refused(head + "0,4\n10,x\n", "line 3: gain is 'x'");
  expect_refused(head + "0,4\n10,3", "line 3: '10,3' is not a whole line");
  expect_refused(head + "0,4\n", "fewer than two points");
}

// Reference mission: 45 dB-Hz on boresight, 21 at 90 deg, whatever the pattern; the law as
// measured spans the pattern's own 9 dB.
TEST(Cn0ModelTest, StretchedLawReachesBothBounds) {
  const Cn0Model stretched(AntennaPattern::patch(), Cn0Law::kStretched);
  EXPECT_EQ(stretched.at_cosine(1), 45);
  EXPECT_NEAR(stretched.at_cosine(0), 21, 0.02);
  EXPECT_EQ(stretched.at_angle(kPi / 2), 21);
  EXPECT_EQ(stretched.at_cosine(-1), 21);
  EXPECT_NEAR(stretched.at_angle(62.5 * kDegree), 45 - 24 * 4.3 / 9, 1e-9);
  const Cn0Model measured(AntennaPattern::patch(), Cn0Law::kAsMeasured);
  EXPECT_NEAR(measured.at_angle(kPi / 2), 36, 1e-9);
}

TEST(Cn0ModelTest, TableIsTheLaw) {
  for (const Cn0Law law : {Cn0Law::kStretched, Cn0Law::kAsMeasured}) {
    const Cn0Model model(AntennaPattern::patch(), law);
    for (double angle = 0; angle <= kPi; angle += 0.00137) {
      EXPECT_NEAR(model.at_cosine(std::cos(angle)), model.at_angle(angle), 0.05);  // seen 0.02
    }
  }
}

TEST(Cn0ModelTest, FlatPatternCannotBeStretched) {
  const AntennaPattern flat = AntennaPattern::parse("off_boresight_deg,gain_dbi\n0,1\n90,1\n", "f");
  EXPECT_THROW(Cn0Model(flat, Cn0Law::kStretched), std::invalid_argument);
  EXPECT_EQ(Cn0Model(flat, Cn0Law::kAsMeasured).at_cosine(0.5), 45);
}

// Bell and D'Amico, Table 2: code 0.1437 to 2.2769 m, phase 0.659 to 10.45 mm. Seen: 0.1 %.
TEST(TrackingNoiseTest, BothBoundsOfTable2AreReached) {
  EXPECT_NEAR(code_sigma_m(45), 0.1437, 0.01 * 0.1437);
  EXPECT_NEAR(code_sigma_m(21), 2.2769, 0.01 * 2.2769);
  EXPECT_NEAR(phase_sigma_m(45, gps::kL1Wavelength_m), 0.659e-3, 0.01 * 0.659e-3);
  EXPECT_NEAR(phase_sigma_m(21, gps::kL1Wavelength_m), 10.45e-3, 0.01 * 10.45e-3);
}

Sight sight_of(const SatelliteState& satellite, const AntennaPlace& antenna) {
  const Vec3 d = satellite.r_ECEF - antenna.r_ECEF;
  return {.distance_m = norm(d), .u_ECEF = unit(d)};
}

// Range and clock against the inertial formulation of leo_scene.hpp. Both carry rounding at 2.7e7
// m, some 4 nm a step, and the satellite's third-order term over 80 ms, 1e-8 m. Seen: 3e-8 m.
TEST(SignalPathTest, RangeIsThatOfLightInInertialAxes) {
  RandomStreams streams(1);
  GpsConstellation gps({.interpolate = false}, kSceneEpoch, streams);
  const LeoScene leo;
  int seen = 0;
  for (Duration t = 0s; t < 2h; t += 613s) {
    const GpsSnapshot now = gps.at(kSceneEpoch + t);
    const AntennaPlace antenna = antenna_at(leo, t);
    for (int prn = 1; prn <= 32; ++prn) {
      if (!now.has(prn)) continue;
      for (const double delay_s : {0.0, 1e-7, -9e-4}) {
        const ReceivedSignal got = receive(now[prn], antenna, sight_of(now[prn], antenna), delay_s);
        const ExactRange exact = exact_range(gps, prn, leo, to_seconds(t) + delay_s);
        EXPECT_NEAR(got.range_m, exact.range_m, 2e-7);
        EXPECT_NEAR(got.satellite_clock_s, exact.satellite_clock_s, 1e-17);
        ++seen;
      }
    }
  }
  EXPECT_EQ(seen, 12 * 31 * 3);
}

// Central difference over 2 x 0.05 s: truncation h^2/6 times n^3 r = 0.01 m/s^3, 5e-6 m/s; rounding
// 4e-8 m over 0.1 s.
TEST(SignalPathTest, RangeRateIsTheDerivativeOfTheRange) {
  RandomStreams streams(1);
  GpsConstellation gps({}, kSceneEpoch, streams);
  const LeoScene leo;
  for (Duration t = 0s; t < 2h; t += 613s) {
    const GpsSnapshot now = gps.at(kSceneEpoch + t);
    const AntennaPlace antenna = antenna_at(leo, t);
    for (int prn = 1; prn <= 32; ++prn) {
      if (!now.has(prn)) continue;
      const double s = to_seconds(t);
      const double rate_mps = (exact_range(gps, prn, leo, s + 0.05).range_m -
                               exact_range(gps, prn, leo, s - 0.05).range_m) /
                              0.1;
      EXPECT_NEAR(receive(now[prn], antenna, sight_of(now[prn], antenna), 0).range_rate_mps,
                  rate_mps, 1e-5);
    }
  }
}

AntennaPlace zenith_antenna(double radius_m) {
  AntennaPlace a;
  a.r_ECEF = {radius_m, 0, 0};
  a.R_AE = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  return a;
}

/// A satellite at 26 560 km in the direction in which the line of sight leaves the antenna at
/// `elevation` above the horizontal.
Vec3 satellite_at(double radius_m, double elevation_rad, double satellite_m = 26.56e6) {
  const double s = std::sin(elevation_rad), c = std::cos(elevation_rad);
  const double along =
      -radius_m * s + std::sqrt(satellite_m * satellite_m - radius_m * radius_m * c * c);
  return {radius_m + along * s, along * c, 0};
}

// The horizon of radius R seen from r lies acos(R/r) below the horizontal.
TEST(SightTest, EarthBlocksBelowTheGrazingAltitude) {
  const double r = 6928136.3, ground = 6378136.3;
  for (const double altitude : {0.0, 50e3, 100e3}) {
    SightOptions options;
    options.antenna_mask_rad = kPi;
    options.grazing_altitude_m = altitude;
    const SightCheck check(options);
    const double horizon = -std::acos((ground + altitude) / r);
    EXPECT_TRUE(check(zenith_antenna(r), r, satellite_at(r, horizon + 1e-6)).clear) << altitude;
    EXPECT_FALSE(check(zenith_antenna(r), r, satellite_at(r, horizon - 1e-6)).clear) << altitude;
    // On the other side of the Earth the line of sight passes the centre even more closely.
    EXPECT_FALSE(check(zenith_antenna(r), r, satellite_at(r, -kPi / 2)).clear);
  }
}

TEST(SightTest, MasksCutAtTheirAngles) {
  const double r = 6928136.3;
  SightOptions options;
  options.antenna_mask_rad = 80 * kDegree;
  const SightCheck masked(options);
  EXPECT_TRUE(masked(zenith_antenna(r), r, satellite_at(r, 10.001 * kDegree)).clear);
  EXPECT_FALSE(masked(zenith_antenna(r), r, satellite_at(r, 9.999 * kDegree)).clear);
  options = {};
  options.elevation_mask_rad = 5 * kDegree;
  const SightCheck elevated(options);
  EXPECT_TRUE(elevated(zenith_antenna(r), r, satellite_at(r, 5.001 * kDegree)).clear);
  EXPECT_FALSE(elevated(zenith_antenna(r), r, satellite_at(r, 4.999 * kDegree)).clear);
  // A tilted antenna hears what lies before it: 75 deg off the zenith, the horizontal is 15 deg
  // off.
  AntennaPlace tilted = zenith_antenna(r);
  tilted.R_AE.row_z = {std::cos(75 * kDegree), std::sin(75 * kDegree), 0};
  const Sight sight = SightCheck({})(tilted, r, satellite_at(r, 0));
  EXPECT_TRUE(sight.clear);
  EXPECT_NEAR(sight.cos_off_boresight, std::cos(15 * kDegree), 1e-12);
  EXPECT_NEAR(sight.sin_elevation, 0, 1e-12);
}

// By the law of sines the angle at the satellite is asin(r cos(elevation) / a): 15.12 deg at the
// horizontal.
TEST(SightTest, ReceiverOutsideTheTransmitBeamHearsNothing) {
  const double r = 6928136.3, widest = std::asin(r / 26.56e6);
  SightOptions options;
  options.transmit_beam_rad = widest - 1e-6;
  EXPECT_FALSE(SightCheck(options)(zenith_antenna(r), r, satellite_at(r, 0)).clear);
  EXPECT_TRUE(SightCheck(options)(zenith_antenna(r), r, satellite_at(r, 5 * kDegree)).clear);
  options.transmit_beam_rad = widest + 1e-6;
  EXPECT_TRUE(SightCheck(options)(zenith_antenna(r), r, satellite_at(r, 0)).clear);
}

TEST(SightTest, OptionsOutOfRangeAreNamed) {
  EXPECT_THAT([] { SightCheck({.grazing_altitude_m = -1}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("grazing_altitude_m = -1")));
}

// 40.3e16/f^2 = 0.1624 m per TECU; Lear's mapping is 1.000 at the zenith and 7.39 at the
// horizontal (guide), by its formula 2.037/sqrt(0.076) = 7.3890 and 2.037/(sqrt(1.076) + 1).
TEST(IonosphereTest, DelayIsLears) {
  EXPECT_NEAR(ionosphere_L1_m(1, 1), 0.16237, 1e-4);
  EXPECT_NEAR(ionosphere_L1_m(5, 0) / ionosphere_L1_m(5, 1), 7.39, 0.01);
  EXPECT_EQ(ionosphere_L1_m(0, 0.3), 0);
  EXPECT_GT(ionosphere_L1_m(5, -0.2), ionosphere_L1_m(5, 0));
}

// Overhead, the satellite's x and the antenna's x in the plane normal to the line of sight: the
// phase turns with the angle between them, one cycle a turn.
TEST(WindUpTest, TurningTheAntennaByAnAngleTurnsThePhaseByIt) {
  AntennaPlace antenna = zenith_antenna(7e6);
  const Vec3 satellite{26.56e6, 0, 0}, sun{1e9, 1.5e11, 2e10};
  const double before = wind_up_cycles(satellite, sun, antenna);
  for (const double angle : {0.1, 1.0, 3.0}) {
    AntennaPlace turned_antenna = antenna;
    const Vec3 x = antenna.R_AE.row_x, y = antenna.R_AE.row_y;
    turned_antenna.R_AE.row_x = std::cos(angle) * x + std::sin(angle) * y;
    turned_antenna.R_AE.row_y = std::cos(angle) * y - std::sin(angle) * x;
    const double after = wind_up_cycles(satellite, sun, turned_antenna);
    EXPECT_NEAR(std::abs(std::remainder(after - before, 1.0)),
                std::abs(std::remainder(angle / (2 * kPi), 1.0)), 1e-12);
  }
}

}  // namespace
}  // namespace orrery
