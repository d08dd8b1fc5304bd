#include <orrery/models/ground/ground_station.hpp>
#include <orrery/models/orbit/earth.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

const SimTime kStart = gps_midnight(2025, 3, 20);

// An Earth that turns about its pole, its meridian of Greenwich along x at the start.
class Turning final : public SpaceEnvironment {
 public:
  explicit Turning(double rate_radps) : rate_radps_(rate_radps) {}
  Surroundings surroundings(SimTime t) const override {
    return {rotation_about_z(rate_radps_ * to_seconds(t - kStart)), {0, 0, rate_radps_}, {}, {}};
  }

 private:
  double rate_radps_;
};

const GroundStation kEquator({.name = "equator"});  // at x = 6378137 m

std::string refusal(const GroundStationOptions& options) {
  try {
    GroundStation station(options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

// On the equator and at the pole the normal of the ellipsoid goes through the Earth's centre: the
// elevation is that of a plane triangle. Elsewhere up is the geodetic latitude's direction.
TEST(GroundStationTest, StandsOnTheEllipsoidAndLooksAlongItsNormal) {
  EXPECT_NEAR(norm(kEquator.r_ECEF() - Vec3{6378137, 0, 0}), 0, 1e-8);
  const GroundStation pole({.name = "pole", .latitude_deg = 90});
  EXPECT_NEAR(pole.r_ECEF().z, 6356752.314245, 1e-6);  // WGS 84's b
  const GroundStation north({.name = "north", .latitude_deg = 45, .longitude_deg = 90});
  EXPECT_NEAR(norm(north.up_ECEF() - Vec3{0, std::sqrt(0.5), std::sqrt(0.5)}), 0, 1e-15);
}

// At the central angle c from the station: tan(elevation) = (cos c - R/r) / sin c.
TEST(GroundStationTest, ElevationIsThatOfThePlaneTriangle) {
  const Turning still(0);
  for (const double c : {0.01, 0.1, 0.3, 1.0}) {
    const double r = 7000e3;
    const OrbitState s{kStart, {r * std::cos(c), 0, r * std::sin(c)}, {}, 1};
    const double expected = std::atan2(std::cos(c) - 6378137 / r, std::sin(c));
    const Surroundings around = still.surroundings(kStart);
    EXPECT_NEAR(kEquator.elevation_rad(s, around), expected, 1e-14);
    EXPECT_NEAR(kEquator.view(s, around).sin_elevation, std::sin(expected), 1e-14);
  }
}

// The rate against a central difference of 0.1 s: its error is h^2/6 f''', f''' ~ (v/d)^3 = 1e-6;
// 1.7e-9. Observed 3e-10.
TEST(GroundStationTest, RateIsTheDerivativeOnATurningEarth) {
  const Turning earth(7.292115e-5);
  const Vec3 r{6900e3, 500e3, 300e3}, v{-800, 5000, 5600};
  const auto sine_after = [&](double dt_s) {
    const SimTime t = kStart + from_seconds(dt_s);
    return kEquator.view({t, r + dt_s * v, v, 1}, earth.surroundings(t)).sin_elevation;
  };
  const double rate =
      kEquator.view({kStart, r, v, 1}, earth.surroundings(kStart)).sin_elevation_rate;
  EXPECT_NEAR(rate, (sine_after(0.1) - sine_after(-0.1)) / 0.2, 2e-9);
  EXPECT_GT(std::abs(rate), 1e-3);
}

// A spacecraft overhead that recedes with v: up, the signal chases it, d = (d0 + v d), so t =
// d0/(c - v); down, the range at sending counts, since the station turns about its own place by
// less than a nanometre of range.
TEST(GroundStationTest, LightTimeIsThatBetweenTheEndsOwnInstants) {
  const Turning still(0);
  const double c_mps = 299792458, d_m = 1e9, v_mps = 3e3;
  const OrbitState s{kStart, {6378137 + d_m, 0, 0}, {v_mps, 0, 0}, 1};
  EXPECT_NEAR(to_seconds(kEquator.light_time_up(s, still)), d_m / (c_mps - v_mps), 6e-10);
  EXPECT_NEAR(to_seconds(kEquator.light_time_down(s, still)), d_m / c_mps, 6e-10);
}

TEST(GroundStationTest, KnownStationsAreUsableAndOthersListed) {
  for (const std::string& name : known_ground_stations()) {
    EXPECT_EQ(GroundStation(known_ground_station(name)).name(), name);
  }
  try {
    known_ground_station("atlantis");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "no ground station 'atlantis'; there are svalbard, kiruna, kourou, troll");
  }
}

TEST(GroundStationTest, BadOptionsAreNamed) {
  using testing::HasSubstr;
  EXPECT_THAT(refusal({}), HasSubstr("name is empty"));
  EXPECT_THAT(refusal({.name = "x", .latitude_deg = 91}),
              HasSubstr("'x': latitude_deg = 91; accepted: -90 to 90"));
  EXPECT_THAT(refusal({.name = "x", .longitude_deg = std::numeric_limits<double>::quiet_NaN()}),
              HasSubstr("longitude_deg = nan"));
  EXPECT_THAT(refusal({.name = "x", .height_m = 1e5}), HasSubstr("height_m = 1e+05"));
  EXPECT_THAT(refusal({.name = "x", .elevation_mask_deg = 90}), HasSubstr("elevation_mask_deg"));
}

}  // namespace orrery
