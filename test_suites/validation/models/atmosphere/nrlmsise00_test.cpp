#include <orrery/models/atmosphere/nrlmsise00.hpp>

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace orrery {
namespace {

// The table distributed with the published C code: 7 significant digits of gtd7 (see the README
// beside it). Columns: case, year, doy, s, km, lat, lon, lst, f107A, f107, ap, switch 9, ap0-ap6,
// then He, O, N2, O2, Ar, rho, H, N, anomalous O [1/cm^3, g/cm^3], T exosphere, T [K].
constexpr int kFirstResult = 19;

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  return fields;
}

Nrlmsise00Input input_of(const std::vector<std::string>& f) {
  Nrlmsise00Input in{.day_of_year = std::stoi(f[2]),
                     .ut_s = std::stod(f[3]),
                     .altitude_km = std::stod(f[4]),
                     .latitude_deg = std::stod(f[5]),
                     .longitude_deg = std::stod(f[6]),
                     .local_solar_time_h = std::stod(f[7]),
                     .f107a_sfu = std::stod(f[8]),
                     .f107_sfu = std::stod(f[9]),
                     .ap_daily = std::stod(f[10])};
  if (f[11] == "-1") {
    in.ap_history.emplace();
    for (std::size_t k = 0; k < 7; ++k) (*in.ap_history)[k] = std::stod(f[12 + k]);
  }
  return in;
}

// As the table prints: 6.665177E+05.
std::string printed(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6E", value);
  return text;
}

std::vector<double> in_published_units(const Nrlmsise00Output& out) {
  return {
      1e-6 * out.helium_pm3,           1e-6 * out.oxygen_pm3,   1e-6 * out.nitrogen_molecules_pm3,
      1e-6 * out.oxygen_molecules_pm3, 1e-6 * out.argon_pm3,    1e-3 * out.density_kgpm3,
      1e-6 * out.hydrogen_pm3,         1e-6 * out.nitrogen_pm3, 1e-6 * out.anomalous_oxygen_pm3,
      out.exospheric_temperature_K,    out.temperature_K};
}

TEST(Nrlmsise00Test, All17PublishedCasesAgreeInEveryPrintedDigit) {
  const std::filesystem::path path = std::filesystem::path(ORRERY_REFERENCE_DATA) / "atmosphere" /
                                     "nrlmsise00_reference_17cases.csv";
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "no " << path << " (ORRERY_REFERENCE_DATA)";
  }
  std::ifstream file(path);
  std::string line;
  ASSERT_TRUE(std::getline(file, line));
  const std::vector<std::string> names = fields_of(line);
  int cases = 0;
  for (; std::getline(file, line); ++cases) {
    const std::vector<std::string> f = fields_of(line);
    const std::vector<double> results = in_published_units(evaluate_nrlmsise00(input_of(f)));
    ASSERT_EQ(f.size(), kFirstResult + results.size());
    for (std::size_t i = 0; i < results.size(); ++i) {
      EXPECT_EQ(printed(results[i]), f[kFirstResult + i])
          << "case " << f[0] << ", " << names[kFirstResult + i];
    }
  }
  EXPECT_EQ(cases, 17);
}

}  // namespace
}  // namespace orrery
