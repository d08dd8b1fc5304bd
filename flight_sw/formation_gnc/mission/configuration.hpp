/// The package's configuration: text of `key=value` lines, as handed over at boot.
///
/// Blank lines and text behind `#` are ignored, and so is white space around key and value. An
/// unknown key, a key given twice or a value outside its range is an error: a typing mistake must
/// not fly as a default. Keys, defaults and ranges are in README.md.
#pragma once

#include <cstddef>

#include "formation_gnc/mission/maneuver_manager.hpp"
#include "formation_gnc/mission/mission_manager.hpp"
#include "formation_gnc/navigation/navigation.hpp"

namespace formation_gnc {

struct Configuration {
  Role role = Role::kChief;
  Mode initial_mode = Mode::kStandby;  ///< of the first boot; standby, or science
  double gnss_period_s = 10.0;         ///< of the logs that the receiver is asked for
  double crosslink_period_s = 10.0;
  double telemetry_period_s = 60.0;
  bool escape = true;  ///< false: the separation monitor only reports
  NavigationOptions navigation = {};
  ReliableLinkOptions link = {};
  MissionOptions mission = {};
  ManeuverOptions maneuvers = {};
  SeparationOptions separation = {};
};

/// @param spacecraft  Decides the role where the text does not: "deputy" and "osc" are deputies.
/// @param message     Gets one line naming line number, key and accepted range if the text is
/// wrong.
/// @return false if the text is wrong.
bool parse_configuration(const char* text, std::size_t bytes, const char* spacecraft,
                         Configuration* configuration, char* message, std::size_t message_bytes);

}  // namespace formation_gnc
