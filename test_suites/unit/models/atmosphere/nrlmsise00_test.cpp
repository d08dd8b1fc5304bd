#include <orrery/models/atmosphere/nrlmsise00.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace orrery {
namespace {

using testing::HasSubstr;
using testing::Throws;
using testing::ThrowsMessage;

// The published case 1, a summer afternoon at 60 N, at other altitudes and fluxes.
Nrlmsise00Input published_case(double altitude_km, double f107_sfu = 150) {
  return {.day_of_year = 172,
          .ut_s = 29000,
          .altitude_km = altitude_km,
          .latitude_deg = 60,
          .longitude_deg = -70,
          .local_solar_time_h = 16,
          .f107a_sfu = f107_sfu,
          .f107_sfu = f107_sfu,
          .ap_daily = 4};
}

void expect_relative(double value, double expected, double tolerance) {
  EXPECT_NEAR(value / expected, 1, tolerance) << value << " against " << expected;
}

// Computed with the published C code (D. Brodowski), printed with 10 digits in g/cm^3; half a unit
// in the last is at most 5e-10 relative. Observed: 2e-10, its rounding.
TEST(Nrlmsise00Test, DensityWithAndWithoutAnomalousOxygenAgreesWithThePublishedCode) {
  constexpr double kTenDigits = 5e-10;
  const struct {
    double altitude_km, gtd7_gpcm3, gtd7d_gpcm3;
  } cases[] = {{400, 4.074713533e-15, 4.075421961e-15},
               {500, 9.263470220e-16, 9.286755885e-16},
               {550, 4.690073551e-16, 4.715337471e-16},
               {600, 2.438413154e-16, 2.462395624e-16}};
  for (const auto& c : cases) {
    const Nrlmsise00Output out = evaluate_nrlmsise00(published_case(c.altitude_km));
    expect_relative(out.density_kgpm3, 1e3 * c.gtd7_gpcm3, kTenDigits);
    expect_relative(out.drag_density_kgpm3, 1e3 * c.gtd7d_gpcm3, kTenDigits);
    EXPECT_NEAR(out.exospheric_temperature_K, 1250.54, 0.005);
  }
  expect_relative(evaluate_nrlmsise00(published_case(400, 70)).density_kgpm3, 8.823438253e-13,
                  kTenDigits);
  expect_relative(evaluate_nrlmsise00(published_case(400, 180)).drag_density_kgpm3, 5.931417118e-12,
                  kTenDigits);
}

// Mean molecular masses with the publication's unit of mass.
TEST(Nrlmsise00Test, DensityIsTheSumOfTheSpecies) {
  for (const double altitude_km : {0.0, 50.0, 70.0, 100.0, 300.0, 800.0}) {
    const Nrlmsise00Output o = evaluate_nrlmsise00(published_case(altitude_km));
    const double sum_amu = 4 * o.helium_pm3 + 16 * o.oxygen_pm3 + 28 * o.nitrogen_molecules_pm3 +
                           32 * o.oxygen_molecules_pm3 + 40 * o.argon_pm3 + o.hydrogen_pm3 +
                           14 * o.nitrogen_pm3;
    expect_relative(o.density_kgpm3, 1.66e-27 * sum_amu, 1e-15);
    expect_relative(o.drag_density_kgpm3, 1.66e-27 * (sum_amu + 16 * o.anomalous_oxygen_pm3),
                    1e-15);
  }
}

bool same_bits(const Nrlmsise00Output& a, const Nrlmsise00Output& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;  // doubles only: no padding
}

// Two spacecraft far apart in place, in regions of the model and in the kind of ap they use.
TEST(Nrlmsise00Test, InterleavedCallsGiveTheBitsOfEachAlone) {
  const auto chief = [](int i) {
    Nrlmsise00Input in = published_case(30 + 60 * (i % 14));
    in.latitude_deg = -80 + i;
    return in;
  };
  const auto deputy = [](int i) {
    Nrlmsise00Input in = published_case(980 - 65 * (i % 15), 90);
    in.longitude_deg = 3 * i;
    in.ap_history = {40, 80, 60, 30, 20, 10, 5};
    return in;
  };
  constexpr int kCalls = 100;
  std::vector<Nrlmsise00Output> chief_alone, deputy_alone;
  for (int i = 0; i < kCalls; ++i) chief_alone.push_back(evaluate_nrlmsise00(chief(i)));
  for (int i = 0; i < kCalls; ++i) deputy_alone.push_back(evaluate_nrlmsise00(deputy(i)));
  for (int i = 0; i < kCalls; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_TRUE(same_bits(evaluate_nrlmsise00(chief(i)), chief_alone[k])) << i;
    EXPECT_TRUE(same_bits(evaluate_nrlmsise00(deputy(i)), deputy_alone[k])) << i;
  }
  EXPECT_FALSE(same_bits(chief_alone[0], chief_alone[1]));
}

// The publication joins its parts there. What it leaves out on one side is what remains of the
// change: at 123.435 km the spline of 1/T meets the Bates profile, whose exospheric temperature
// keeps its mean below, 1027 K for 1251 K; in T at 72.5 km only the gradient parameter s changes.
TEST(Nrlmsise00Test, LeavesNoGapWhereDescriptionsMeet) {
  const struct {
    double at_km, gap;
  } joints[] = {{32.5, 1e-7}, {62.5, 1e-7}, {72.5, 0.02}, {123.435, 0.07},
                {200, 1e-4},  {300, 1e-2},  {450, 1e-4}};
  for (const auto& joint : joints) {
    const double below = evaluate_nrlmsise00(published_case(joint.at_km - 1e-7)).density_kgpm3;
    const double above = evaluate_nrlmsise00(published_case(joint.at_km + 1e-7)).density_kgpm3;
    EXPECT_NEAR(above / below, 1, joint.gap) << joint.at_km << " km";
  }
}

// Physics that every atmosphere shares: heavy air expands when heated.
TEST(Nrlmsise00Test, SunAndStormsRaiseTheDensityOfTheThermosphere) {
  const double quiet = evaluate_nrlmsise00(published_case(550, 70)).drag_density_kgpm3;
  const double active = evaluate_nrlmsise00(published_case(550, 220)).drag_density_kgpm3;
  EXPECT_GT(active, 10 * quiet);
  Nrlmsise00Input storm = published_case(550);
  const double before = evaluate_nrlmsise00(storm).drag_density_kgpm3;
  storm.ap_daily = 200;
  EXPECT_GT(evaluate_nrlmsise00(storm).drag_density_kgpm3, 1.5 * before);
}

// A storm is felt less and less as it recedes: the same ap heats most in the running three hours.
TEST(Nrlmsise00Test, RecentActivityCountsMoreThanOld) {
  const auto with_storm_in = [](std::size_t k) {
    Nrlmsise00Input in = published_case(550);
    in.ap_history = {4, 4, 4, 4, 4, 4, 4};
    (*in.ap_history)[k] = 100;
    return evaluate_nrlmsise00(in).drag_density_kgpm3;
  };
  for (std::size_t k = 1; k < 4; ++k) EXPECT_GT(with_storm_in(k), with_storm_in(k + 1)) << k;
  EXPECT_GT(with_storm_in(5), with_storm_in(6));
  EXPECT_EQ(with_storm_in(0), with_storm_in(0));
}

// At the poles longitude has no meaning, and the tides vanish with cos(latitude).
TEST(Nrlmsise00Test, PolesKnowNoLongitudeNorLocalTime) {
  for (const double latitude_deg : {-90.0, 90.0}) {
    Nrlmsise00Input in = published_case(550);
    in.latitude_deg = latitude_deg;
    const double here = evaluate_nrlmsise00(in).drag_density_kgpm3;
    in.longitude_deg += 100;
    in.local_solar_time_h = 3;
    // The publication's pi/180 has six digits: its cosine of 90 deg is -7e-7 and not 0, and
    // ln(density) changes by a few times that. Observed: 1.2e-6.
    EXPECT_NEAR(evaluate_nrlmsise00(in).drag_density_kgpm3 / here, 1, 5e-6);
  }
}

TEST(Nrlmsise00Test, ArgumentsBeyondTheModelAreRefusedWithValueAndRange) {
  const auto evaluate = [](const std::function<void(Nrlmsise00Input&)>& change) {
    Nrlmsise00Input in = published_case(400);
    change(in);
    evaluate_nrlmsise00(in);
  };
  using In = Nrlmsise00Input;
  EXPECT_THAT([&] { evaluate([](In& in) { in.altitude_km = -0.5; }); },
              ThrowsMessage<std::domain_error>(
                  "evaluate_nrlmsise00: altitude_km = -0.5 km; accepted: 0 to 1000 km"));
  EXPECT_THAT(
      [&] { evaluate([](In& in) { in.altitude_km = 1000.5; }); },
      ThrowsMessage<std::domain_error>(HasSubstr("altitude_km = 1000.5 km; accepted: 0 to")));
  EXPECT_THAT([&] { evaluate([](In& in) { in.f107_sfu = 0; }); },
              ThrowsMessage<std::domain_error>(HasSubstr("f107_sfu = 0 sfu; accepted: 50 to 450")));
  EXPECT_THAT(
      [&] { evaluate([](In& in) { in.f107a_sfu = 1e9; }); },
      ThrowsMessage<std::domain_error>(HasSubstr("f107a_sfu = 1e+09 sfu; accepted: 50 to 300")));
  EXPECT_THAT(
      [&] { evaluate([](In& in) { in.ap_daily = 401; }); },
      ThrowsMessage<std::domain_error>(HasSubstr("ap_daily = 401 (2 nT); accepted: 0 to 400")));
  EXPECT_THAT(
      [&] { evaluate([](In& in) { in.ap_history = {4, 4, 4, -1, 4, 4, 4}; }); },
      ThrowsMessage<std::domain_error>(HasSubstr("ap_history = -1 (2 nT); accepted: 0 to 400")));
  EXPECT_THAT(
      [&] { evaluate([](In& in) { in.day_of_year = 367; }); },
      ThrowsMessage<std::invalid_argument>(HasSubstr("day_of_year = 367 d; accepted: 1 to 366")));
  EXPECT_THAT(
      [&] { evaluate([](In& in) { in.latitude_deg = 90.1; }); },
      ThrowsMessage<std::invalid_argument>(HasSubstr("latitude_deg = 90.1 deg; accepted: -90")));
}

TEST(Nrlmsise00Test, ArgumentsThatAreNotFiniteAreRefused) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (double Nrlmsise00Input::*argument :
         {&Nrlmsise00Input::ut_s, &Nrlmsise00Input::altitude_km, &Nrlmsise00Input::latitude_deg,
          &Nrlmsise00Input::longitude_deg, &Nrlmsise00Input::local_solar_time_h,
          &Nrlmsise00Input::f107a_sfu, &Nrlmsise00Input::f107_sfu, &Nrlmsise00Input::ap_daily}) {
      Nrlmsise00Input in = published_case(400);
      in.*argument = bad;
      EXPECT_THAT([&] { evaluate_nrlmsise00(in); }, Throws<std::invalid_argument>());
    }
  }
}

// In storms beyond the data behind the model its temperature at 115 km passes through infinity, and
// with F10.7 far below F10.7A the exosphere is colder than the air below. Such answers are refused.
TEST(Nrlmsise00Test, EveryAcceptedArgumentGivesAPhysicalAnswerOrAClearError) {
  int refused = 0, evaluated = 0;
  const auto evaluate = [&](const Nrlmsise00Input& in) {
    try {
      const Nrlmsise00Output out = evaluate_nrlmsise00(in);
      ++evaluated;
      EXPECT_TRUE(std::isfinite(out.drag_density_kgpm3) && out.density_kgpm3 > 0 &&
                  out.drag_density_kgpm3 >= out.density_kgpm3 && out.temperature_K > 0)
          << in.altitude_km << " km, F10.7 " << in.f107_sfu << ", F10.7A " << in.f107a_sfu
          << ", Ap " << in.ap_daily << ", latitude " << in.latitude_deg;
    } catch (const std::domain_error& error) {
      ++refused;
      EXPECT_THAT(error.what(), HasSubstr("the model's temperature"));
      EXPECT_TRUE(in.ap_daily >= 200 || in.f107_sfu < in.f107a_sfu - 200) << error.what();
    }
  };
  for (const double f107a : {50.0, 150.0, 300.0}) {
    for (const double f107 : {50.0, 150.0, 300.0, 450.0}) {
      for (const double ap : {0.0, 48.0, 200.0, 400.0}) {
        for (const double latitude : {-90.0, -45.0, 0.0, 60.0, 90.0}) {
          for (const double altitude :
               {0.0, 40.0, 72.5, 100.0, 115.0, 123.435, 300.0, 550.0, 1000.0}) {
            Nrlmsise00Input in = published_case(altitude);
            in.f107a_sfu = f107a;
            in.f107_sfu = f107;
            in.ap_daily = ap;
            in.latitude_deg = latitude;
            evaluate(in);
          }
        }
      }
    }
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(evaluated, 10 * refused);
}

}  // namespace
}  // namespace orrery
