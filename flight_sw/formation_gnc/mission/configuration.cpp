#include "formation_gnc/mission/configuration.hpp"

#include <cstring>

#include "support/configuration_reader.hpp"

namespace formation_gnc {
namespace {

class Reader final : public flight_support::ConfigurationReader {
 public:
  Reader(Configuration* c, char* message, std::size_t message_bytes)
      : ConfigurationReader(message, message_bytes), configuration_(c) {}

 private:
  bool set(const char* key, const char* value) override {
    if (std::strcmp(key, "role") == 0) return set_role(value);
    if (std::strcmp(key, "initial_mode") == 0) return set_mode(value);
    Configuration& c = *configuration_;
    double escape = 1.0;
    const NumberKey keys[] = {
        {"gnss_period_s", &c.gnss_period_s, 1.0, 60.0},
        {"crosslink_period_s", &c.crosslink_period_s, 1.0, 600.0},
        {"telemetry_period_s", &c.telemetry_period_s, 1.0, 86400.0},
        {"announcement_lead_s", &c.mission.transition.lead_s, 60.0, 86400.0},
        {"announcement_guard_s", &c.mission.transition.guard_s, 20.0, 86400.0},
        {"retransmission_s", &c.link.timeout_s, 1.0, 600.0},
        {"observation_s", &c.mission.observation_s, 1.0, 600.0},
        {"first_observation_s", &c.mission.first_observation_s, 0.0, 1e6},
        {"navigation_timeout_s", &c.mission.navigation_timeout_s, 60.0, 1e6},
        {"partner_timeout_s", &c.mission.partner_timeout_s, 60.0, 1e6},
        {"delta_v_budget_mps", &c.mission.delta_v_budget_mps, 0.0, 1000.0},
        {"separation_m", &c.maneuvers.separation_m, 1.0, 1e4},
        {"max_impulse_mps", &c.maneuvers.limits.max_mps, 1e-6, 100.0},
        {"min_impulse_mps", &c.maneuvers.limits.min_mps, 0.0, 1.0},
        {"impulse_spacing_s", &c.maneuvers.limits.spacing_s, 1.0, 3600.0},
        {"transfer_replan_s", &c.maneuvers.transfer_replan_s, 600.0, 1e6},
        {"science_replan_s", &c.maneuvers.science_replan_s, 600.0, 1e6},
        {"escape", &escape, 0.0, 1.0},
    };
    static_assert(sizeof keys / sizeof keys[0] <= 32, "seen_ has a bit per key");
    for (std::size_t k = 0; k < sizeof keys / sizeof keys[0]; ++k) {
      if (std::strcmp(key, keys[k].name) != 0) continue;
      if (!set_number(keys, k, value)) return false;
      c.escape = c.escape && escape != 0.0;
      return true;
    }
    return fail(key, "is no key of this package");
  }

  bool set_role(const char* value) {
    if (role_seen_) return fail("role", "is given twice");
    role_seen_ = true;
    const bool chief = std::strcmp(value, "chief") == 0;
    if (!chief && std::strcmp(value, "deputy") != 0) return fail("role", "is not chief or deputy");
    configuration_->role = chief ? Role::kChief : Role::kDeputy;
    return true;
  }

  bool set_mode(const char* value) {
    if (mode_seen_) return fail("initial_mode", "is given twice");
    mode_seen_ = true;
    const bool science = std::strcmp(value, "science") == 0;
    if (!science && std::strcmp(value, "standby") != 0) {
      return fail("initial_mode", "is not standby or science");
    }
    configuration_->initial_mode = science ? Mode::kScience : Mode::kStandby;
    return true;
  }

  Configuration* configuration_;
  bool role_seen_ = false, mode_seen_ = false;
};

}  // namespace

bool parse_configuration(const char* text, std::size_t bytes, const char* spacecraft,
                         Configuration* configuration, char* message, std::size_t message_bytes) {
  *configuration = Configuration();
  if (std::strcmp(spacecraft, "deputy") == 0 || std::strcmp(spacecraft, "osc") == 0) {
    configuration->role = Role::kDeputy;
  }
  Reader reader(configuration, message, message_bytes);
  if (!reader.read(text, bytes)) return false;
  const TransitionOptions& transition = configuration->mission.transition;
  if (transition.lead_s > transition.guard_s) return true;
  return reader.fail("announcement_lead_s", "is not above announcement_guard_s");
}

}  // namespace formation_gnc
