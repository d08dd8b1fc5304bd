#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/atmosphere/nrlmsise00.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "nrlmsise00_term_by_term.hpp"

namespace orrery {
namespace {

Nrlmsise00Input random_input(RandomStream& random) {
  Nrlmsise00Input in;
  in.day_of_year = static_cast<int>(random.integer(1, 366));
  in.ut_s = random.uniform(0, 86400);
  in.altitude_km = random.bernoulli(0.5) ? random.uniform(72.6, 200) : random.uniform(200, 1000);
  in.latitude_deg = random.uniform(-90, 90);
  in.longitude_deg = random.uniform(-180, 360);
  in.local_solar_time_h = random.uniform(0, 24);
  in.f107a_sfu = random.uniform(65, 250);
  in.f107_sfu = in.f107a_sfu + random.uniform(-15, 60);
  in.ap_daily = random.uniform(0, 100);
  if (random.bernoulli(0.5)) {
    in.ap_history.emplace();
    for (double& ap : *in.ap_history) ap = random.uniform(0, 150);
  }
  return in;
}

class Nrlmsise00EquationsTest : public testing::TestWithParam<std::uint64_t> {};

// The published cases hold the day, the latitude and the ap of all intervals nearly fixed. Here
// every argument varies, and the equations are evaluated one term at a time
// (nrlmsise00_term_by_term.hpp). Tolerance: densities go through exponents of up to 60, sums of 90
// terms and powers 1/(M - m) of mixing: some 1e3 roundings of 1e-16. Observed: 1.1e-12 over 5 x 200
// points.
TEST_P(Nrlmsise00EquationsTest, EverySpeciesAgreesWithTheEquationsTermByTerm) {
  constexpr double kRounding = 1e-12;
  RandomStreams streams(GetParam());
  RandomStream& random = streams.stream("", "nrlmsise00", "arguments");
  for (int i = 0; i < 60; ++i) {
    const Nrlmsise00Input in = random_input(random);
    const Nrlmsise00Output out = evaluate_nrlmsise00(in);
    const auto expected = term_by_term::Model(in).evaluate();
    const std::array<double, 9> got{1e-6 * out.helium_pm3,
                                    1e-6 * out.oxygen_pm3,
                                    1e-6 * out.nitrogen_molecules_pm3,
                                    1e-6 * out.oxygen_molecules_pm3,
                                    1e-6 * out.argon_pm3,
                                    1e-6 * out.hydrogen_pm3,
                                    1e-6 * out.nitrogen_pm3,
                                    1e-6 * out.anomalous_oxygen_pm3,
                                    out.temperature_K};
    for (std::size_t k = 0; k < got.size(); ++k) {
      const double error = std::abs(got[k] / expected[k] - 1);
      EXPECT_LT(error, kRounding) << "quantity " << k << ": " << got[k] << " against "
                                  << expected[k] << " at " << in.altitude_km << " km, latitude "
                                  << in.latitude_deg;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Nrlmsise00EquationsTest, testing::Values(1, 2, 3, 4, 5));

}  // namespace
}  // namespace orrery
