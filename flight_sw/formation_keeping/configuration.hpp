/// The package's configuration: text of `key=value` lines, as handed over at boot.
///
/// Blank lines and text behind `#` are ignored, and so is white space around key and value. Every
/// key has a default. An unknown key, a key given twice or a value outside its range is an error: a
/// typing mistake must not fly as a default. Keys, defaults and ranges are in README.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "crosslink_protocol.hpp"
#include "reconfiguration_planner.hpp"
#include "relative_navigation.hpp"

namespace formation_keeping {

struct ControlOptions {
  double converged_da_m = 0.3;  ///< 1-sigma of a*da at which the estimate is good enough to plan
  double converged_de_m = 1.0;  ///< likewise of each other element but a*dl
  double burn_lead_s = 60.0;    ///< a burn is commanded this long before its middle
  double keeping_horizon_rev = 2.0;  ///< keeping looks, and corrects, this far ahead
  /// Of a*de and a*di; a quarter of it for a*da, five times it for a*dl.
  double keeping_deadband_m = 4.0;
};

struct Configuration {
  Role role = Role::kChief;  ///< the one that cannot do harm
  double crosslink_period_s = 10.0;
  double telemetry_period_s = 60.0;
  NavigationOptions navigation;
  PlannerOptions planner;
  ControlOptions control;
};

/// @param message  Gets one line naming line number, key and accepted range if the text is wrong.
/// @return false if the text is wrong.
bool parse_configuration(const char* text, std::size_t bytes, Configuration* configuration,
                         char* message, std::size_t message_bytes);

}  // namespace formation_keeping
