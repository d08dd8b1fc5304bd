#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/mean_elements.hpp>
#include <orrery/models/orbit/relative_elements.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

namespace orrery {
namespace {

const SimTime kStart(days(16510));
constexpr Duration kTenOrbits = 57400s;
const QuasiNonsingularElements kMean{6928137, 0.0003, 0.00095, 1.70326682, 5.5, 0.2};

// The pole of the oblateness is the z axis of ECI: what the theory is about.
class StandingStill final : public SpaceEnvironment {
 public:
  Surroundings surroundings(SimTime) const override { return {}; }
};

std::shared_ptr<const ForceModel> oblateness(double J2) {
  std::ostringstream text;
  text.precision(17);
  text << "earth_gravity_constant 3.986004415e14\nradius 6378136.3\nmax_degree 2\nend_of_head\ngfc "
          "2 0 "
       << -J2 / std::sqrt(5.0) << " 0\ngfc 2 1 0 0\ngfc 2 2 0 0\n";
  return std::make_shared<GravityForce>(
      std::make_shared<HarmonicGravity>(GravityField::parse(text.str(), "J2"), 2));
}

SpacecraftOrbit orbit_of(const QuasiNonsingularElements& mean, const OblateBody& body,
                         std::shared_ptr<const ForceModel> force,
                         std::shared_ptr<const SpaceEnvironment> environment) {
  const InertialState s = to_inertial(mean_to_osculating(mean, body));
  return {{kStart, s.r_ECI, s.v_ECI, 11},
          {.forces = {std::move(force)}, .environment = std::move(environment)}};
}

// How far the mean elements of a J2-only truth stray from secular motion within ten orbits.
struct Straying {
  double a_m = 0, e = 0, i_rad = 0;
};

Straying straying(const QuasiNonsingularElements& mean, double J2) {
  const OblateBody body{.J2 = J2};
  SpacecraftOrbit orbit =
      orbit_of(mean, body, oblateness(J2), std::make_shared<const StandingStill>());
  Straying most;
  for (Duration d = 0s; d <= kTenOrbits; d += 100s) {
    const auto x = osculating_to_mean(orbit.elements_at(kStart + d), body);
    const auto expected = propagate_secular(mean, to_seconds(d), body);
    most.a_m = std::max(most.a_m, std::abs(x.a_m - expected.a_m));
    most.e = std::max(most.e, std::hypot(x.ex - expected.ex, x.ey - expected.ey));
    most.i_rad = std::max(most.i_rad, std::abs(x.i_rad - expected.i_rad));
  }
  return most;
}

TEST(MeanElementsTest, InverseIsExact) {
  for (const double e_scale : {0.0, 1.0, 50.0}) {
    for (const double i_rad : {0.1, 1.107, 1.7, 3.0}) {
      for (double u = 0; u < 6.3; u += 0.4) {
        const QuasiNonsingularElements mean{7e6, 0.0003 * e_scale, 0.00095 * e_scale, i_rad, 5.5,
                                            u};
        const QuasiNonsingularElements back = osculating_to_mean(mean_to_osculating(mean));
        EXPECT_NEAR(back.a_m, mean.a_m, 4e-9);
        EXPECT_NEAR(back.ex, mean.ex, 1e-15);
        EXPECT_NEAR(back.ey, mean.ey, 1e-15);
        EXPECT_NEAR(back.i_rad, mean.i_rad, 2e-15);
        EXPECT_NEAR(back.raan_rad, mean.raan_rad, 4e-15);
        EXPECT_NEAR(back.u_rad, mean.u_rad, 4e-15);
      }
    }
  }
}

// What a theory of first order in J2 must show: the osculating elements oscillate by J2 (a: 9.4
// km), the mean ones by J2^2 only, so a quarter of J2 leaves a sixteenth. A wrong or missing
// first-order term would leave a quarter. 4 J2^2 a = 33 m at the Earth's J2.
class MeanElementsOrderTest : public testing::TestWithParam<QuasiNonsingularElements> {};

TEST_P(MeanElementsOrderTest, RemainderIsOfSecondOrder) {
  const QuasiNonsingularElements mean = GetParam();
  const Straying whole = straying(mean, kJ2Earth), quarter = straying(mean, kJ2Earth / 4);
  EXPECT_LT(whole.a_m, 8 * kJ2Earth * kJ2Earth * mean.a_m);
  EXPECT_LT(whole.e, 16 * kJ2Earth * kJ2Earth);
  EXPECT_LT(whole.i_rad, 8 * kJ2Earth * kJ2Earth);
  EXPECT_NEAR(whole.a_m / quarter.a_m, 16, 2);
  EXPECT_NEAR(whole.e / quarter.e, 16, 4);
  EXPECT_NEAR(whole.i_rad / quarter.i_rad, 16, 4);
}

INSTANTIATE_TEST_SUITE_P(Orbits, MeanElementsOrderTest,
                         testing::Values(kMean, QuasiNonsingularElements{6928137, 0, 0, 0.8, 1, 3},
                                         QuasiNonsingularElements{7.5e6, 0.02, -0.05, 0.8, 1, 3},
                                         QuasiNonsingularElements{7.5e6, -0.05, 0.02, 1.7, 4, 1}));

// Mean and osculating semi-major axis agree in their averages over a revolution in u, to second
// order in J2 (J2^2 a = 8 m, 4 times that allowed): an independent hold on the level, which the
// test above lacks.
TEST(MeanElementsTest, MeanSemiMajorAxisIsTheAverage) {
  double sum = 0;
  constexpr int kPoints = 720;
  for (int k = 0; k < kPoints; ++k) {
    QuasiNonsingularElements mean = kMean;
    mean.u_rad = 2 * 3.141592653589793 * k / kPoints;
    sum += mean_to_osculating(mean).a_m;
  }
  EXPECT_NEAR(sum / kPoints, kMean.a_m, 32);
}

// Secular rates of the node and of u over ten orbits, first order: relative errors of the J2 part
// are of order J2 (2e-3 allowed, 0.9e-3 observed).
TEST(MeanElementsTest, SecularRatesAreThoseOfTheTruth) {
  SpacecraftOrbit orbit =
      orbit_of(kMean, {}, oblateness(kJ2Earth), std::make_shared<const StandingStill>());
  const double t = to_seconds(kTenOrbits);
  const auto x = osculating_to_mean(orbit.elements_at(kStart + kTenOrbits));
  const SecularRates rates = secular_rates(kMean);
  const double node = wrap_to_pi(x.raan_rad - kMean.raan_rad) / t;
  EXPECT_NEAR(node / rates.raan, 1, 2e-3);
  const double n = std::sqrt(kMuEarth_m3ps2 / kMean.a_m) / kMean.a_m;
  const double u = wrap_to_pi(x.u_rad - kMean.u_rad - n * t) / t;
  EXPECT_NEAR(u, rates.u - n, 4 * kJ2Earth * kJ2Earth * n);
}

// What formation flying needs: relative mean elements at 300 m in the whole field, ten orbits,
// against secular motion. The harmonics that the theory leaves out (and the true pole's 0.14 deg
// from that of ECI) move the elements by some 200 m in waves of up to a tenth of a revolution: seen
// from 300 m aside that is 200 m (300 m/a) 20 = 0.2 m. A tenth of it in a*da at the epoch drifts
// along track by 3 pi a*da each orbit: 2 m in ten. Observed: da 0.05, dl 1.54, dex 0.14, dey 0.05,
// dix 0.08, diy 0.08 m.
TEST(MeanElementsTest, RelativeElementsAt300mFollowSecularMotion) {
  const auto environment = std::make_shared<const EarthEnvironment>();
  const auto field = make_earth_gravity(60);
  const double metre = 1 / kMean.a_m;
  const auto deputy_mean = deputy_elements(kMean, {0, 0, 0, 300 * metre, 0, 300 * metre});
  SpacecraftOrbit chief = orbit_of(kMean, {}, field, environment);
  SpacecraftOrbit deputy = orbit_of(deputy_mean, {}, field, environment);
  RelativeElements most;
  const auto keep = [](double& largest, double value) {
    largest = std::max(largest, std::abs(value));
  };
  for (Duration d = 0s; d <= kTenOrbits; d += 100s) {
    const RelativeElements measured =
        relative_elements(osculating_to_mean(chief.elements_at(kStart + d)),
                          osculating_to_mean(deputy.elements_at(kStart + d)));
    const RelativeElements secular = relative_elements(
        propagate_secular(kMean, to_seconds(d)), propagate_secular(deputy_mean, to_seconds(d)));
    const RelativeElements error = kMean.a_m * (measured - secular);
    keep(most.da, error.da), keep(most.dl, error.dl);
    keep(most.dex, error.dex), keep(most.dey, error.dey);
    keep(most.dix, error.dix), keep(most.diy, error.diy);
  }
  RecordProperty("largest_error_m", std::to_string(most.da) + " " + std::to_string(most.dl) + " " +
                                        std::to_string(most.dex) + " " + std::to_string(most.dey) +
                                        " " + std::to_string(most.dix) + " " +
                                        std::to_string(most.diy));
  for (const double error : {most.da, most.dex, most.dey, most.dix, most.diy})
    EXPECT_LT(error, 0.2);
  EXPECT_LT(most.dl, 2);
}

TEST(MeanElementsTest, EquatorialOrbitsAreRefused) {
  QuasiNonsingularElements mean = kMean;
  mean.i_rad = 0;
  EXPECT_THROW(mean_to_osculating(mean), std::invalid_argument);
  EXPECT_THROW(osculating_to_mean(mean), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
