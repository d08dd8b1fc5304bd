#include "rpo_kit/mission/configuration.hpp"

#include <cstring>

#include "support/configuration_reader.hpp"

namespace rpo_kit {
namespace {

class Reader final : public flight_support::ConfigurationReader {
 public:
  Reader(Configuration* c, char* message, std::size_t message_bytes)
      : ConfigurationReader(message, message_bytes), configuration_(c) {}

 private:
  bool set(const char* key, const char* value) override {
    if (std::strcmp(key, "role") == 0) return set_role(value);
    Configuration& c = *configuration_;
    double leap_seconds = c.earth_time.leap_seconds;
    const NumberKey keys[] = {
        {"crosslink_period_s", &c.crosslink_period_s, 1.0, 600.0},
        {"telemetry_period_s", &c.telemetry_period_s, 1.0, 86400.0},
        {"decision_period_s", &c.decision_period_s, 1.0, 600.0},
        {"burn_lead_s", &c.burn_lead_s, 25.0, 600.0},
        {"leap_seconds", &leap_seconds, 0.0, 60.0},
        {"ut1_minus_utc_s", &c.earth_time.ut1_minus_utc_s, -1.0, 1.0},
        {"lag_s", &c.navigation.lag_s, 0.0, 600.0},
        {"pairing_s", &c.navigation.pairing_s, 0.0, 30.0},
        {"lost_s", &c.navigation.lost_s, 60.0, 1e6},
        {"burn_error_fraction", &c.navigation.burn_fraction, 0.0, 1.0},
        {"burn_error_rad", &c.navigation.burn_direction_rad, 0.0, 1.0},
        {"keep_out_m", &c.approach.transfer.keep_out_m, 0.0, 1e4},
        {"abort_radius_m", &c.approach.abort_radius_m, 10.0, 1e4},
        {"abort_m", &c.autonomy.abort_m, 0.0, 1e4},
        {"hold_limit_s", &c.autonomy.hold_limit_s, 60.0, 1e7},
    };
    for (std::size_t k = 0; k < sizeof keys / sizeof keys[0]; ++k) {
      if (std::strcmp(key, keys[k].name) != 0) continue;
      if (!set_number(keys[k], 1u << k, value)) return false;
      c.earth_time.leap_seconds = static_cast<int>(leap_seconds);
      if (c.earth_time.leap_seconds != leap_seconds) return fail(key, "is no integer");
      return true;
    }
    return fail(key, "is no key of this package");
  }

  bool set_role(const char* value) {
    if (role_seen_) return fail("role", "is given twice");
    role_seen_ = true;
    const bool chaser = std::strcmp(value, "chaser") == 0;
    if (!chaser && std::strcmp(value, "target") != 0)
      return fail("role", "is not target or chaser");
    configuration_->role = chaser ? Role::kChaser : Role::kTarget;
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

}  // namespace rpo_kit
