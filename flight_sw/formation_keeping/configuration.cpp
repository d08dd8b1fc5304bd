#include "configuration.hpp"

#include <cstring>

#include "support/configuration_reader.hpp"

namespace formation_keeping {

using namespace flight_support;

namespace {

class Reader final : public flight_support::ConfigurationReader {
 public:
  Reader(Configuration* c, char* message, std::size_t message_bytes)
      : ConfigurationReader(message, message_bytes), configuration_(c) {}

 private:
  bool set(const char* key, const char* value) override {
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
      if (!set_number(keys, k, value)) return false;
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

  Configuration* configuration_;
  bool role_seen_ = false;
};

}  // namespace

bool parse_configuration(const char* text, std::size_t bytes, Configuration* configuration,
                         char* message, std::size_t message_bytes) {
  *configuration = Configuration();
  Reader reader(configuration, message, message_bytes);
  return reader.read(text, bytes);
}

}  // namespace formation_keeping
