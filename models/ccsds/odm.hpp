/// What CCSDS orbit data messages (OPM, OEM) have in common. CCSDS 502.0-B-2 (2009) and -3 (2023).
#pragma once

#include <orrery/models/ccsds/epoch.hpp>
#include <orrery/models/frames/vector.hpp>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// Text is kept as written, blanks at its ends aside. Comments are kept with the block they stand
/// in.
struct OdmHeader {
  std::string version = "2.0";  // "1.0", "2.0", "3.0"
  std::vector<std::string> comments = {};
  std::optional<std::string> classification = {};
  CcsdsEpoch creation_date = {};  // UTC
  std::string originator = {};
  std::optional<std::string> message_id = {};

  friend bool operator==(const OdmHeader&, const OdmHeader&) = default;
};

struct OdmMetadata {
  std::vector<std::string> comments = {};
  std::string object_name = {};
  std::string object_id = {};  // "1998-067A", or a catalogue number: no blanks
  std::string center_name = "EARTH";
  std::string ref_frame = "EME2000";
  std::optional<CcsdsEpoch> ref_frame_epoch = {};
  TimeSystem time_system = TimeSystem::kUTC;

  friend bool operator==(const OdmMetadata&, const OdmMetadata&) = default;
};

/// Position and velocity: the lower triangle row by row, x, y, z, x_dot, y_dot, z_dot.
/// [km^2, km^2/s, km^2/s^2]
using OdmCovariance = std::array<double, 21>;

/// CENTER_NAME is the Earth and REF_FRAME EME2000 (or J2000, its other name): states are ECI of
/// frames.hpp.
bool is_geocentric_eme2000(const OdmMetadata& metadata);

}  // namespace orrery
