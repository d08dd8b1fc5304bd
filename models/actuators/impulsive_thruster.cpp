#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/actuators/impulsive_thruster.hpp>

#include <stdexcept>

#include "orrery_messages.h"

namespace orrery {

namespace {

struct Command {
  std::int64_t mid_burn_ns = 0;  // onboard clock
  Vec3 dv_ECI;
};

Command decode(Bytes message) {
  Command command;
  double dv_ECI[3];
  orrery_get_thruster(reinterpret_cast<const unsigned char*>(message.data()), &command.mid_burn_ns,
                      dv_ECI);
  command.dv_ECI = {dv_ECI[0], dv_ECI[1], dv_ECI[2]};
  return command;
}

}  // namespace

ImpulsiveThruster::ImpulsiveThruster(const Options& options) : options_(options) {
  if (options.minimum_lead < 0ns) {
    throw std::invalid_argument("ImpulsiveThruster: minimum_lead = " +
                                to_string(options.minimum_lead) + "; accepted: 0 s or more");
  }
  if (options.maximum_lead < options.minimum_lead || options.maximum_lead > weeks(52)) {
    throw std::invalid_argument(
        "ImpulsiveThruster: maximum_lead = " + to_string(options.maximum_lead) +
        "; accepted: minimum_lead to 52 weeks");
  }
  if (!(options.maximum_dv_mps > 0 && options.maximum_dv_mps <= 1e4)) {
    throw std::invalid_argument(
        "ImpulsiveThruster: maximum_dv_mps = " + to_text(options.maximum_dv_mps) +
        " m/s; accepted: above 0, to 10000 m/s");
  }
}

void ImpulsiveThruster::from_flight(DeviceContext& io, Bytes bytes) {
  if (bytes.size() != ORRERY_THRUSTER_BYTES) {
    return reject(io, std::to_string(bytes.size()) +
                          " bytes; accepted: " + std::to_string(ORRERY_THRUSTER_BYTES));
  }
  const Command command = decode(bytes);
  // Written so that NaN fails.
  if (!(norm(command.dv_ECI) <= options_.maximum_dv_mps)) {
    return reject(io, "delta-v of " + to_text(norm(command.dv_ECI)) + " m/s; accepted: 0 to " +
                          to_text(options_.maximum_dv_mps));
  }
  // The epoch may be any number: it is compared before it is subtracted.
  const std::int64_t earliest_ns = io.onboard_ns() + to_ns(options_.minimum_lead);
  const std::int64_t latest_ns = io.onboard_ns() + to_ns(options_.maximum_lead);
  if (command.mid_burn_ns < earliest_ns || command.mid_burn_ns > latest_ns) {
    return reject(io, "mid-burn epoch " + std::to_string(command.mid_burn_ns) +
                          " ns; accepted now: " + std::to_string(earliest_ns) + " to " +
                          std::to_string(latest_ns));
  }
  const Duration delay = io.truth_of_onboard(command.mid_burn_ns) - io.now();
  if (delay < 0ns) return reject(io, "mid-burn epoch is in the past of the truth");
  io.after(delay, [this, &io, dv_ECI = command.dv_ECI] { burn(io, dv_ECI); });
}

void ImpulsiveThruster::burn(DeviceContext& io, const Vec3& dv_ECI) {
  const bool executed = io.fault("lost", 0.0) == 0.0;
  const double delivered_mps = executed ? norm(dv_ECI) : 0.0;
  log_burn({io.now(), dv_ECI, executed});
  delta_v_mps_ += delivered_mps;
  if (executed) io.apply_impulse(dv_ECI);
  io.record("dv_mps", delivered_mps);
}

}  // namespace orrery
