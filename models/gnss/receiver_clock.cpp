#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/gnss/receiver_clock.hpp>

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr double kPi = std::numbers::pi;

void check(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw std::invalid_argument("ReceiverClock: " + std::string(name) + " = " + to_text(value) +
                              "; accepted: " + to_text(low) + " to " + to_text(high));
}

}  // namespace

ReceiverClock::ReceiverClock(const ReceiverClockOptions& options)
    : options_(options), bias_s_(options.initial_bias_s), drift_sps_(options.initial_drift_sps) {
  check("h0_s", options.h0_s, 0, 1e-15);
  check("h_2_ps", options.h_2_ps, 0, 1e-15);
  check("initial_bias_s", options.initial_bias_s, -1e-3, 1e-3);
  check("initial_drift_sps", options.initial_drift_sps, -1e-4, 1e-4);
  check("sigma_bias_s", options.sigma_bias_s, 0, 1e-6);
  check("sigma_drift_sps", options.sigma_drift_sps, 0, 1e-6);
  check("steering_time_s", options.steering_time_s, 1, 1e4);
}

void ReceiverClock::advance(double dt_s, RandomStream& noise) {
  const double q_drift = 2 * kPi * kPi * options_.h_2_ps * dt_s;
  const double q_bias = 0.5 * options_.h0_s * dt_s + q_drift * dt_s * dt_s / 3;
  RandomStream* const streams[] = {&noise, &noise};
  std::array<std::array<double, 3>, 2> z;
  normal_triples(streams, z);
  bias_s_ += drift_sps_ * dt_s + std::sqrt(q_bias) * z[0][0];
  drift_sps_ += std::sqrt(q_drift) * z[0][1];
  const double bias_seen = bias_s_ + options_.sigma_bias_s * z[1][0];
  const double drift_error = options_.sigma_drift_sps * z[1][1];
  if (options_.steered) {
    if (dt_s > 0) {
      const double wanted = std::expm1(-dt_s / options_.steering_time_s) / dt_s * bias_seen;
      drift_sps_ = wanted + drift_error;
    }
  } else if (std::abs(bias_s_) > 5e-4) {
    bias_s_ -= std::copysign(1e-3, bias_s_);
  }
}

void ReceiverClock::jump(double by_s) {
  bias_s_ += by_s;
  take_out_milliseconds();
}

void ReceiverClock::set_to_gps_time(RandomStream& noise) {
  bias_s_ = options_.sigma_bias_s * noise.normal();
}

void ReceiverClock::take_out_milliseconds() {
  if (std::abs(bias_s_) > 1e-3) bias_s_ = std::remainder(bias_s_, 1e-3);
}

}  // namespace orrery
