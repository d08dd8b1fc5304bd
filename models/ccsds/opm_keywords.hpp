/// Keywords that reader and writer of OPMs both go through in order. Not installed.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <array>
#include <string_view>

namespace orrery::ccsds {

inline constexpr std::array<std::string_view, 5> kOpmSpacecraftKeywords = {
    "MASS", "SOLAR_RAD_AREA", "SOLAR_RAD_COEFF", "DRAG_AREA", "DRAG_COEFF"};

struct CovarianceKeyword {
  std::string_view keyword, unit;
};

/// The lower triangle, row by row.
inline constexpr std::array<CovarianceKeyword, 21> kOpmCovarianceKeywords = {{
    {"CX_X", "km**2"},
    {"CY_X", "km**2"},
    {"CY_Y", "km**2"},
    {"CZ_X", "km**2"},
    {"CZ_Y", "km**2"},
    {"CZ_Z", "km**2"},
    {"CX_DOT_X", "km**2/s"},
    {"CX_DOT_Y", "km**2/s"},
    {"CX_DOT_Z", "km**2/s"},
    {"CX_DOT_X_DOT", "km**2/s**2"},
    {"CY_DOT_X", "km**2/s"},
    {"CY_DOT_Y", "km**2/s"},
    {"CY_DOT_Z", "km**2/s"},
    {"CY_DOT_X_DOT", "km**2/s**2"},
    {"CY_DOT_Y_DOT", "km**2/s**2"},
    {"CZ_DOT_X", "km**2/s"},
    {"CZ_DOT_Y", "km**2/s"},
    {"CZ_DOT_Z", "km**2/s"},
    {"CZ_DOT_X_DOT", "km**2/s**2"},
    {"CZ_DOT_Y_DOT", "km**2/s**2"},
    {"CZ_DOT_Z_DOT", "km**2/s**2"},
}};

}  // namespace orrery::ccsds
