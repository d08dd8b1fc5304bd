/// Trajectories as CCSDS Orbit Ephemeris Messages, version 2.0, key-value notation.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/output_file.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace orrery {

struct OemObject {
  std::string name;  // OBJECT_NAME
  std::string id;    // OBJECT_ID, "YYYY-NNNP" for a catalogued object; empty: the name again
};

/// Writes states as they come; nothing is kept in memory.
///
/// Format  CCSDS 502.0-B-2 (2009), chapter 5. EME2000 about the Earth's centre, TIME_SYSTEM GPS,
///         km and km/s with 10 and 13 decimals (0.1 um, 0.1 nm/s): the standard allows 16 digits,
///         too few for a double; the CSV beside it has them all.
/// Bytes   depend on the arguments alone: CREATION_DATE, in UTC as the standard has it, is the
///         caller's, not the wall clock's.
class OemWriter {
 public:
  using Components = std::array<double, 3>;  // x, y, z

  /// @throws std::invalid_argument  a name that is empty or not printable ASCII.
  ///         std::runtime_error     the file cannot be written.
  OemWriter(const std::filesystem::path& path, const OemObject& object, SimTime created_UTC);

  /// Adds a state, metres and m/s.
  /// @throws std::invalid_argument  a component not finite, or above 99999 km or 99 km/s; t not
  ///                                after the last state of this segment, or before a break.
  void state(SimTime t, const Components& r_ECI, const Components& v_ECI);

  /// Ends the segment with the state before `t` and begins one with that after it: for impulses,
  /// and where thrust begins or ends, since a reader must not interpolate across either. No instant
  /// is left without a segment. A break at which the message would begin or end adds no state.
  /// @throws  as state(); t may be that of the last state, or of the last break.
  void break_segment(SimTime t, const Components& r_ECI, const Components& v_before_ECI,
                     const Components& v_after_ECI);

  /// @throws std::logic_error    no state was written: an OEM without one is not valid.
  ///         std::runtime_error  the rest cannot be written.
  void close();
  /// As of OutputFile.
  void flush() { file_.flush(); }
  void continue_in(std::filesystem::path path) { file_.continue_in(std::move(path)); }

 private:
  struct State {
    SimTime t;
    Components r_ECI, v_ECI;
  };
  void write(const State& state);
  void begin_segment(SimTime t);
  void end_segment();
  void check(SimTime t, const Components& r_ECI, const Components& v_ECI,
             bool is_break = false) const;

  OutputFile file_;
  OemObject object_;
  std::string line_;  // kept, so that a state costs no allocation
  bool in_segment_ = false;
  std::optional<SimTime> last_;           // time of the last state written
  std::optional<State> after_break_;      // begins the next segment, with the state that follows it
  std::uint64_t stop_time_position_ = 0;  // of the last segment's STOP_TIME in the file
};

}  // namespace orrery
