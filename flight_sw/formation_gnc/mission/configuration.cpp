#include "formation_gnc/mission/configuration.hpp"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace formation_gnc {
namespace {

constexpr std::size_t kMaxLine = 128;

// A number of the configuration: where it goes and what it may be.
struct NumberKey {
  const char* name;
  double* value;
  double low, high;
};

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

// Cuts off comment and white space at both ends, in place.
char* trimmed(char* line) {
  char* comment = std::strchr(line, '#');
  if (comment != nullptr) *comment = '\0';
  while (is_space(*line)) ++line;
  std::size_t length = std::strlen(line);
  while (length > 0 && is_space(line[length - 1])) line[--length] = '\0';
  return line;
}

class Reader {
 public:
  Reader(Configuration* c, char* message, std::size_t message_bytes)
      : configuration_(c), message_(message), message_bytes_(message_bytes) {}

  bool read_line(char* line) {
    ++line_;
    char* key = trimmed(line);
    if (*key == '\0') return true;
    char* equals = std::strchr(key, '=');
    if (equals == nullptr) return fail(key, "has no '='");
    *equals = '\0';
    return set(trimmed(key), trimmed(equals + 1));
  }

  bool fail(const char* what, const char* why) {
    std::snprintf(message_, message_bytes_, "configuration line %d: '%s' %s", line_, what, why);
    return false;
  }

 private:
  bool set(const char* key, const char* value) {
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
      if (!set_number(keys[k], 1u << k, value)) return false;
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

  bool set_number(const NumberKey& key, std::uint32_t bit, const char* text) {
    if ((seen_ & bit) != 0) return fail(key.name, "is given twice");
    seen_ |= bit;
    // In the C locale, which flight programs never leave; written so that a NaN is out of range.
    char* end = nullptr;
    const double value = std::strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= key.low && value <= key.high)) {
      char why[96];
      std::snprintf(why, sizeof why, "is not a number in [%g, %g]: '%.32s'", key.low, key.high,
                    text);
      return fail(key.name, why);
    }
    *key.value = value;
    return true;
  }

  Configuration* configuration_;
  char* message_;
  std::size_t message_bytes_;
  int line_ = 0;
  bool role_seen_ = false, mode_seen_ = false;
  std::uint32_t seen_ = 0;
};

}  // namespace

bool parse_configuration(const char* text, std::size_t bytes, const char* spacecraft,
                         Configuration* configuration, char* message, std::size_t message_bytes) {
  *configuration = Configuration();
  if (std::strcmp(spacecraft, "deputy") == 0 || std::strcmp(spacecraft, "osc") == 0) {
    configuration->role = Role::kDeputy;
  }
  Reader reader(configuration, message, message_bytes);
  std::size_t at = 0;
  while (at < bytes) {
    char line[kMaxLine];
    std::size_t length = 0;
    for (; at < bytes && text[at] != '\n'; ++at) {
      if (length + 1 == kMaxLine) return reader.fail("(a line)", "is longer than 127 characters");
      line[length++] = text[at];
    }
    ++at;
    line[length] = '\0';
    if (!reader.read_line(line)) return false;
  }
  const TransitionOptions& transition = configuration->mission.transition;
  if (transition.lead_s > transition.guard_s) return true;
  return reader.fail("announcement_lead_s", "is not above announcement_guard_s");
}

}  // namespace formation_gnc
