/// CCSDS Orbit Parameter Messages: one state of one object, in key-value notation.
#pragma once

#include <orrery/models/ccsds/odm.hpp>
#include <orrery/models/orbit/force_model.hpp>

#include <utility>

namespace orrery {

struct OpmStateVector {
  std::vector<std::string> comments = {};
  CcsdsEpoch epoch = {};
  Vec3 r_km = {}, v_kmps = {};  // in REF_FRAME about CENTER_NAME

  friend bool operator==(const OpmStateVector&, const OpmStateVector&) = default;
};

/// Osculating, at the epoch of the state vector.
struct OpmKeplerianElements {
  std::vector<std::string> comments = {};
  double a_km = 0, e = 0, i_deg = 0, raan_deg = 0, argument_of_pericentre_deg = 0;
  double anomaly_deg = 0;
  bool anomaly_is_true = true;  // else mean
  double gm_km3ps2 = 0;

  friend bool operator==(const OpmKeplerianElements&, const OpmKeplerianElements&) = default;
};

struct OpmSpacecraft {
  std::vector<std::string> comments = {};
  std::optional<double> mass_kg = {};
  std::optional<double> solar_radiation_area_m2 = {}, solar_radiation_coefficient = {};
  std::optional<double> drag_area_m2 = {}, drag_coefficient = {};

  friend bool operator==(const OpmSpacecraft&, const OpmSpacecraft&) = default;
};

struct OpmCovariance {
  std::vector<std::string> comments = {};
  std::optional<std::string> ref_frame = {};  // none: that of the state
  OdmCovariance lower_triangle = {};

  friend bool operator==(const OpmCovariance&, const OpmCovariance&) = default;
};

struct OpmManeuver {
  std::vector<std::string> comments = {};
  CcsdsEpoch ignition = {};
  std::optional<double> duration_s = {};     // 0: impulsive
  std::optional<double> delta_mass_kg = {};  // negative
  std::string ref_frame = {};
  Vec3 dv_kmps = {};

  friend bool operator==(const OpmManeuver&, const OpmManeuver&) = default;
};

struct Opm {
  OdmHeader header = {};
  OdmMetadata metadata = {};
  OpmStateVector state = {};
  std::optional<OpmKeplerianElements> keplerian = {};
  std::optional<OpmSpacecraft> spacecraft = {};
  std::optional<OpmCovariance> covariance = {};
  std::vector<OpmManeuver> maneuvers = {};
  std::vector<std::pair<std::string, std::string>> user_defined =
      {};  // USER_DEFINED_<first> = <second>

  friend bool operator==(const Opm&, const Opm&) = default;
};

/// Reads a message of version 1.0 to 3.0.
///
/// Strict    Blocks and their keywords come in the order of the standard, in the metadata in any
/// order
///           (published samples do so); a unit, where one is printed, is the standard's; numbers
///           are finite; centres, frames and time systems are ones that CCSDS or SANA name;
///           OBJECT_ID has no blanks. COMMENT is accepted anywhere.
/// @throws std::invalid_argument  with source and line: anything else, XML, what is not text, an
/// end
///                                before the state is complete.
Opm parse_opm(std::string_view text, std::string_view source_name);
/// The same from a file. @throws std::invalid_argument  also if it cannot be read.
Opm load_opm(const std::string& path);

/// Equal messages give equal bytes: keywords in the order of the standard, LF, shortest numbers
/// that read back as the same double (up to 17 digits; the standard asks for no more than 16).
/// parse_opm gives the message back.
/// @throws std::invalid_argument  what parse_opm would refuse: text with line ends, not finite, ...
std::string write_opm(const Opm& opm);

/// The state in ECI, with MASS if the message has it and 0 if not.
/// @throws std::invalid_argument  centre or frame other than the Earth and EME2000 (turning others
/// into
///                                it is the caller's, see frames.hpp); errors of to_sim_time.
OrbitState state_of(const Opm& opm);

}  // namespace orrery
