/// GPS ephemerides from RINEX navigation files, versions 2 and 3.
///
/// Formats     IGS/RTCM, RINEX 2.11 (2007) Table A3, RINEX 3.05 (2020) Table A7. Of a mixed file
///             the GPS records are read and the others passed over.
/// Errors      std::invalid_argument "RinexNavigation: <source>, line N: ..." for a file of another
///             type, a record that is cut short, a number that is none or out of range.
/// Checked by  test_suites/unit/models/gnss/rinex_navigation_test.cpp, test_suites/fuzz, a whole
///             day against the IGS's precise orbits in test_suites/validation/models/gnss
#pragma once

#include <orrery/models/gnss/broadcast_ephemeris.hpp>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

struct RinexNavigation {
  struct Klobuchar {
    std::array<double, 4> alpha{}, beta{};
  };

  std::vector<BroadcastEphemeris> ephemerides;  // in the order of the file
  std::optional<Klobuchar> ionosphere;          // where the header has it
  std::optional<int> leap_seconds;

  static RinexNavigation parse(std::string_view text, std::string_view source_name);
  /// @throws std::invalid_argument  also if the file cannot be read or is compressed.
  static RinexNavigation load(const std::string& path);
};

}  // namespace orrery
