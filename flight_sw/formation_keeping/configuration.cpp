#include "configuration.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace formation_keeping {

using namespace flight_support;

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

// A decimal number in the C locale, which flight programs never leave, and nothing behind it.
bool read_number(const char* text, double* value) {
  char* end = nullptr;
  *value = std::strtod(text, &end);
  return end != text && *end == '\0';
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
    NavigationOptions& navigation = configuration_->navigation;
    PlannerOptions& planner = configuration_->planner;
    ControlOptions& control = configuration_->control;
    double leap_seconds = 0.0;
    const NumberKey keys[] = {
        {"crosslink_period_s", &configuration_->crosslink_period_s, 1.0, 600.0},
        {"telemetry_period_s", &configuration_->telemetry_period_s, 1.0, 86400.0},
        {"leap_seconds", &leap_seconds, 0.0, 60.0},
        {"ut1_minus_utc_s", &navigation.earth_time.ut1_minus_utc_s, -1.0, 1.0},
        {"lag_s", &navigation.lag_s, 0.0, 600.0},
        {"pairing_tolerance_s", &navigation.pairing_tolerance_s, 0.0, 30.0},
        {"relative_noise_mps15", &navigation.relative_noise_mps15, 0.0, 1e-3},
        {"absolute_noise_mps15", &navigation.absolute_noise_mps15, 0.0, 1.0},
        {"burn_error_fraction", &navigation.burn_error_fraction, 0.0, 1.0},
        {"min_radial_normal_m", &planner.min_radial_normal_m, 0.0, 1e4},
        {"max_impulse_mps", &planner.max_impulse_mps, 0.0, 100.0},
        {"min_impulse_mps", &planner.min_impulse_mps, 0.0, 1.0},
        {"converged_da_m", &control.converged_da_m, 1e-3, 100.0},
        {"converged_de_m", &control.converged_de_m, 1e-3, 100.0},
        {"burn_lead_s", &control.burn_lead_s, 25.0, 600.0},
        {"keeping_horizon_rev", &control.keeping_horizon_rev, 1.0, 20.0},
        {"keeping_deadband_m", &control.keeping_deadband_m, 0.1, 1e3},
    };
    static_assert(sizeof keys / sizeof keys[0] <= 32, "seen_ has a bit per key");
    for (std::size_t k = 0; k < sizeof keys / sizeof keys[0]; ++k) {
      if (std::strcmp(key, keys[k].name) != 0) continue;
      if (!set_number(keys[k], 1u << k, value)) return false;
      if (keys[k].value == &leap_seconds) {
        navigation.earth_time.leap_seconds = static_cast<int>(leap_seconds);
        if (navigation.earth_time.leap_seconds != leap_seconds) return fail(key, "is no integer");
      }
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

  bool set_number(const NumberKey& key, std::uint32_t bit, const char* text) {
    if ((seen_ & bit) != 0) return fail(key.name, "is given twice");
    seen_ |= bit;
    double value = 0.0;
    // Written so that a NaN is out of range.
    if (!read_number(text, &value) || !(value >= key.low && value <= key.high)) {
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
  bool role_seen_ = false;
  std::uint32_t seen_ = 0;
};

}  // namespace

bool parse_configuration(const char* text, std::size_t bytes, Configuration* configuration,
                         char* message, std::size_t message_bytes) {
  *configuration = Configuration();
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
  return true;
}

}  // namespace formation_keeping
