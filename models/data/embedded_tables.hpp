/// The text of the tables in models/data, compiled in. Sources and licences: README.md beside this
/// file.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string_view>

namespace orrery::embedded {

/// GGM05S to degree and order 60, ICGEM layout; read it with GravityField::parse.
std::string_view ggm05s_d60();

/// GPS almanac of 2016-03-31; read it with parse_almanac_table.
std::string_view gps_almanac_2016_week1890();

/// Gain of a hemispherical patch antenna at L1; read it with AntennaPattern::parse.
std::string_view gps_patch_antenna_gain();

/// NRLMSISE-00, the arrays of the published model; read by models/atmosphere.
std::string_view nrlmsise00_coefficients();

/// Monthly means of F10.7 and Ap, 2014 to 2025; read with SpaceWeather::monthly.
std::string_view space_weather_monthly();

}  // namespace orrery::embedded
