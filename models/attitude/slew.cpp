#include <orrery/models/attitude/slew.hpp>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

void require_positive(const char* name, double value, const char* unit) {
  if (value > 0 && std::isfinite(value)) return;
  throw std::invalid_argument("SlewLimits: " + std::string(name) + " = " + std::to_string(value) +
                              " " + unit + "; accepted: above 0");
}

}  // namespace

SlewProfile::SlewProfile(double angle_rad, const SlewLimits& limits) : angle_rad_(angle_rad) {
  require_positive("rate_degps", limits.rate_degps, "deg/s");
  require_positive("acceleration_degps2", limits.acceleration_degps2, "deg/s^2");
  if (!(angle_rad >= 0 && std::isfinite(angle_rad))) {
    throw std::invalid_argument("SlewProfile: angle_rad = " + std::to_string(angle_rad) +
                                " rad; accepted: 0 or more");
  }
  const double rate = limits.rate_degps * kDegree;
  acceleration_radps2_ = limits.acceleration_degps2 * kDegree;
  const bool cruises = angle_rad * acceleration_radps2_ > rate * rate;
  ramp_s_ = cruises ? rate / acceleration_radps2_ : std::sqrt(angle_rad / acceleration_radps2_);
  cruise_s_ = cruises ? angle_rad / rate - ramp_s_ : 0;
}

double SlewProfile::angle_rad(double t_s) const {
  if (t_s <= 0) return 0;
  const double left_s = duration_s() - t_s;
  if (left_s <= 0) return angle_rad_;
  if (t_s < ramp_s_) return 0.5 * acceleration_radps2_ * t_s * t_s;
  if (left_s < ramp_s_) return angle_rad_ - 0.5 * acceleration_radps2_ * left_s * left_s;
  return acceleration_radps2_ * ramp_s_ * (t_s - 0.5 * ramp_s_);
}

double SlewProfile::rate_radps(double t_s) const {
  const double left_s = duration_s() - t_s;
  if (t_s <= 0 || left_s <= 0) return 0;
  if (t_s < ramp_s_) return acceleration_radps2_ * t_s;
  if (left_s < ramp_s_) return acceleration_radps2_ * left_s;
  return acceleration_radps2_ * ramp_s_;
}

}  // namespace orrery
