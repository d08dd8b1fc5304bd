#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/attitude/bus.hpp>
#include <orrery/models/attitude/pointing_law.hpp>

#include <span>
#include <stdexcept>
#include <utility>

#include "orrery_messages.h"

namespace orrery {

Bus::Bus(const Options& options, OnTimes on_times)
    : options_(options), on_times_(std::move(on_times)) {
  if (options.period <= 0ns) {
    throw std::invalid_argument("Bus: period = " + to_string(options.period) +
                                "; accepted: above 0 s");
  }
  if (!(options.knowledge_sigma_deg >= 0 && options.knowledge_sigma_deg <= 10)) {
    throw std::invalid_argument("Bus: knowledge_sigma_deg = " +
                                to_text(options.knowledge_sigma_deg) + " deg; accepted: 0 to 10");
  }
}

void Bus::start(DeviceContext& io) {
  io.every(options_.period, [this, &io] { report(io); });
}

void Bus::report(DeviceContext& io) {
  const Quaternion q = with_knowledge_error(to_quaternion(io.R_BI()), options_.knowledge_sigma_deg,
                                            io.random("knowledge"));
  const Vec3 omega = io.omega_BI_B();
  const double q_BI[4] = {q.w, q.x, q.y, q.z};
  const double omega_BI_B[3] = {omega.x, omega.y, omega.z};
  std::array<double, 6> on_times_s{};
  if (on_times_) on_times_s = on_times_();
  unsigned char message[ORRERY_BUS_BYTES];
  orrery_put_bus(message, io.onboard_ns(), q_BI, omega_BI_B, on_times_s.data());
  io.to_flight(std::as_bytes(std::span(message)));
}

}  // namespace orrery
