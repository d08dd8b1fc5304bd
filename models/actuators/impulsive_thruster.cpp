#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/actuators/impulsive_thruster.hpp>

#include <cmath>
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
  if (!(options.gain >= 0 && options.gain <= 10)) {
    throw std::invalid_argument("ImpulsiveThruster: gain = " + to_text(options.gain) +
                                "; accepted: 0 to 10");
  }
  if (!(std::fabs(options.misalignment_deg) <= 90)) {
    throw std::invalid_argument("ImpulsiveThruster: misalignment_deg = " +
                                to_text(options.misalignment_deg) + "; accepted: -90 to 90");
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

Vec3 ImpulsiveThruster::delivered_ECI(DeviceContext& io, const Vec3& dv_ECI) const {
  const Vec3 dv = options_.gain * dv_ECI;
  if (options_.misalignment_deg == 0 || norm(dv) == 0) return dv;
  constexpr double kDegree = 3.14159265358979323846 / 180;
  const double angle_rad = options_.misalignment_deg * kDegree;
  const Mat3 R_BI = io.R_BI();
  const Vec3 dv_B = R_BI * dv, u_B = unit(dv_B);
  const Vec3 transverse_B = std::fabs(u_B.z) > 0.9945 ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  const Vec3 axis_B = unit(cross(u_B, transverse_B));
  return transpose(R_BI) * (std::cos(angle_rad) * dv_B + std::sin(angle_rad) * cross(axis_B, dv_B));
}

void ImpulsiveThruster::burn(DeviceContext& io, const Vec3& dv_ECI) {
  const bool executed = io.fault("lost", 0.0) == 0.0;
  const Vec3 delivered = delivered_ECI(io, dv_ECI);
  const double delivered_mps = executed ? norm(delivered) : 0.0;
  log_burn({io.now(), dv_ECI, executed});
  delta_v_mps_ += delivered_mps;
  if (executed) io.apply_impulse(delivered);
  io.record("dv_mps", delivered_mps);
}

}  // namespace orrery
