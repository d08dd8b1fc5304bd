/// The package's configuration: lines of `key = value`; keys, defaults and ranges in README.md.
#pragma once

#include <cstddef>

#include "rpo_kit/fusion/relative_navigation.hpp"
#include "rpo_kit/guidance/approach.hpp"
#include "rpo_kit/imaging/frame_processor.hpp"
#include "rpo_kit/imaging/hot_pixels.hpp"
#include "rpo_kit/mission/autonomy.hpp"
#include "rpo_kit/near_range/inspection.hpp"
#include "support/orbit/earth_rotation.hpp"

namespace rpo_kit {

enum class Role { kTarget, kChaser, kObserver };

struct Configuration {
  Role role = Role::kTarget;  ///< the one that cannot do harm
  double crosslink_period_s = 10.0;
  double telemetry_period_s = 60.0;
  double decision_period_s = 30.0;
  double burn_lead_s = 90.0;
  bool second_observer = false;  ///< the chaser takes its directions
  flight_support::EarthTime earth_time = {};
  NavigationOptions navigation = {};
  ApproachOptions approach = {};
  AutonomyOptions autonomy = {};
  InspectionOptions inspection = {};
  ImagingOptions imaging = {};          ///< its camera's field is that of `inspection`
  int view_width = 0, view_height = 0;  ///< of images of the target [px]; 0: none are looked at
  char star_catalogue[96] = "";         ///< path; empty: frames are not looked at
};

/// @param message  Gets one line naming line number, key and accepted range if the text is wrong.
bool parse_configuration(const char* text, std::size_t bytes, Configuration* configuration,
                         char* message, std::size_t message_bytes);

}  // namespace rpo_kit
