/// CCSDS Orbit Ephemeris Messages: a trajectory as a table of states, in key-value notation.
#pragma once

#include <orrery/models/ccsds/odm.hpp>

namespace orrery {

enum class InterpolationMethod { kLinear, kLagrange, kHermite };

struct OemMetadata : OdmMetadata {
  CcsdsEpoch start_time = {}, stop_time = {};
  std::optional<CcsdsEpoch> useable_start_time = {}, useable_stop_time = {};
  std::optional<InterpolationMethod> interpolation = {};
  std::optional<int> interpolation_degree = {};

  friend bool operator==(const OemMetadata&, const OemMetadata&) = default;
};

struct OemState {
  CcsdsEpoch epoch = {};
  Vec3 r_km = {}, v_kmps = {};  // in REF_FRAME about CENTER_NAME
  std::optional<Vec3> a_kmps2 = {};

  friend bool operator==(const OemState&, const OemState&) = default;
};

struct OemCovariance {
  CcsdsEpoch epoch = {};
  std::optional<std::string> ref_frame = {};  // none: that of the states
  OdmCovariance lower_triangle = {};

  friend bool operator==(const OemCovariance&, const OemCovariance&) = default;
};

/// States between which one may interpolate; a manoeuvre begins another segment.
struct OemSegment {
  OemMetadata metadata = {};
  std::vector<std::string> comments = {};
  std::vector<OemState> states = {};  // epochs increase
  std::vector<std::string> covariance_comments = {};
  std::vector<OemCovariance> covariances = {};

  friend bool operator==(const OemSegment&, const OemSegment&) = default;
};

struct Oem {
  OdmHeader header = {};
  std::vector<OemSegment> segments = {};

  friend bool operator==(const Oem&, const Oem&) = default;
};

/// Reads a message of version 1.0 to 3.0. Strict as parse_opm (opm.hpp), and:
///   TIME_SYSTEM is the same in all segments; epochs of states increase within START_TIME to
///   STOP_TIME (a line repeated exactly counts once); a state has 6 numbers, or 9 with the
///   acceleration; a covariance has 6 rows of 1 to 6 numbers. Covariances are kept, nothing else is
///   done with them.
/// A text cut short within the last number of its last line cannot be told from a whole one.
/// @throws std::invalid_argument  with source and line.
Oem parse_oem(std::string_view text, std::string_view source_name);
Oem load_oem(const std::string& path);

/// As write_opm. @throws std::invalid_argument  what parse_oem would refuse.
std::string write_oem(const Oem& oem);

}  // namespace orrery
