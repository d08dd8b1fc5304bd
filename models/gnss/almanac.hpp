/// GPS almanacs: the carried one, and files in the YUMA and SEM formats.
///
/// Formats     US Coast Guard Navigation Center, "YUMA Almanac" and "SEM Almanac" definitions.
///             Units of the files: YUMA radians, SEM semicircles of pi.
/// Errors      std::invalid_argument "GpsAlmanac: <source>, line N: ..." for anything that is not
///             complete: a missing or unknown field, a number out of range, a PRN given twice.
/// Checked by  test_suites/unit/models/gnss/almanac_test.cpp, test_suites/fuzz/almanac_fuzz.cpp
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// One satellite. The week is as published: modulo 1024 in YUMA files, modulo 256 or 1024 in SEM.
struct GpsAlmanacEntry {
  int prn = 0;     // 1 to 32
  int week = 0;    // of toa, as published
  int health = 0;  // 0: good
  double toa_s = 0;
  double eccentricity = 0;
  double inclination_rad = 0;
  double raan_rate_radps = 0;
  double sqrt_a_sqrtm = 0;
  double raan0_rad = 0;  // longitude of the ascending node at the start of the week
  double argument_of_perigee_rad = 0;
  double mean_anomaly_rad = 0;
  double af0_s = 0, af1_sps = 0;

  bool operator==(const GpsAlmanacEntry&) const = default;
};

using GpsAlmanac = std::vector<GpsAlmanacEntry>;

/// 31 satellites of 2016-03-31, compiled in (models/data); PRN 4 is absent.
GpsAlmanac carried_almanac();
/// The same layout from text: a header line, then one line per satellite.
GpsAlmanac parse_almanac_table(std::string_view text, std::string_view source_name);

GpsAlmanac parse_yuma(std::string_view text, std::string_view source_name);
GpsAlmanac parse_sem(std::string_view text, std::string_view source_name);
/// A file of either format, told apart by its first line.
/// @throws std::invalid_argument  also if it cannot be read.
GpsAlmanac load_almanac(const std::string& path);

}  // namespace orrery
