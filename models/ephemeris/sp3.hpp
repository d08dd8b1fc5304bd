/// SP3-c files: precise orbits and clocks as the IGS and the orbit determination centres publish
/// them.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// One satellite at one epoch, in the file's Earth-fixed frame (Sp3::frame).
struct Sp3Record {
  SimTime t;
  Vec3 r_ECEF;                                        // [m]
  std::optional<Vec3> v_ECEF = {};                    // [m/s]
  std::optional<double> clock_s = {};                 // ahead of the file's time system
  std::optional<double> clock_rate = {};              // [s/s]
  bool clock_event = false, clock_predicted = false;  // between this epoch and the one before
  bool maneuver = false, orbit_predicted = false;
};

struct Sp3Satellite {
  std::string id;                         // "G01", "L74"
  std::optional<double> accuracy_m = {};  // 2^code mm of the header; none: unknown
  std::vector<Sp3Record> records = {};    // in order of time; without the epochs marked bad
};

struct Sp3 {
  SimTime start;             // of the header
  int announced_epochs = 0;  // by the header
  Duration interval = {};
  bool has_velocities = false;
  std::string frame;  // "ITRF", "IGS05": as written
  std::string agency;
  std::string time_system;  // "GPS", "TAI", "UTC": of the file; `t` is GPS time all the same
  std::vector<std::string> comments;
  std::vector<SimTime> epochs;
  std::vector<Sp3Satellite> satellites;

  /// @throws std::out_of_range  no such satellite; names those that there are.
  const Sp3Satellite& satellite(std::string_view id) const;
};

struct Sp3Options {
  /// An excerpt may hold fewer epochs than its header announces and begin later, on the same grid.
  bool excerpt = false;
};

/// Reads an SP3-c file (S. Hilla, The Extended Standard Product 3 Orbit Format, NGS 2010).
///
/// Units     The file's km, dm/s, us and 1e-4 us/s become m, m/s, s and s/s. Positions of zero and
///           clocks of 999999 mean "none". Standard deviations and correlations of single records
///           are not kept.
/// Strict    The header's 22 lines or more in their order, its week, day and date the same instant;
///           as many epochs as it announces, spaced by its interval; each epoch with every
///           satellite once, in the header's order, velocities where the header says so; EOF at the
///           end. Time systems GPS, TAI and UTC.
/// @throws std::invalid_argument  with source and line: everything else, other versions, what is
///                                cut short, not finite, beyond 1e6 km, or not text.
Sp3 parse_sp3(std::string_view text, std::string_view source_name, Sp3Options options = {});
/// The same from a file. @throws std::invalid_argument  also if it cannot be read, or is
/// compressed.
Sp3 load_sp3(const std::string& path, Sp3Options options = {});

}  // namespace orrery
