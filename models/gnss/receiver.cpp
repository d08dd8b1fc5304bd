#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/frames/frames.hpp>
#include <orrery/models/gnss/novatel.hpp>
#include <orrery/models/gnss/receiver.hpp>

#include <stdexcept>
#include <string>

namespace orrery {

namespace {

constexpr Duration kShortestPeriod = 100ms;  // 10 Hz
constexpr Duration kLongestPeriod = 60s;     // 1/60 Hz
constexpr double kLargestSigmaPosition_m = 1e4;
constexpr double kLargestSigmaVelocity_mps = 1e3;
constexpr double kLongestLeverArm_m = 100;
constexpr std::uint8_t kChannels = 12;  // all on GPS L1, until there is a constellation
constexpr std::uint8_t kGpsL1 = 0x01;

void check_period(Duration period) {
  if (period < kShortestPeriod || period > kLongestPeriod || period % 1ms != 0ns) {
    throw std::invalid_argument("GnssReceiver: period = " + to_string(period) +
                                "; accepted: whole milliseconds from 100 ms to 60 s");
  }
}

// Written so that NaN fails.
void check_sigma(const char* option, double value, double largest) {
  if (!(value >= 0 && value <= largest)) {
    throw std::invalid_argument("GnssReceiver: " + std::string(option) + " = " + to_text(value) +
                                "; accepted: 0 to " + to_text(largest));
  }
}

void check_lever_arm(const Vec3& lever_arm_B) {
  if (!(norm(lever_arm_B) <= kLongestLeverArm_m)) {
    throw std::invalid_argument("GnssReceiver: |lever_arm_B| = " + to_text(norm(lever_arm_B)) +
                                " m; accepted: 0 to 100 m");
  }
}

Duration until_next_epoch(SimTime now, Duration period) {
  const Duration since_epoch = now.time_since_epoch() % period;
  return since_epoch == 0ns ? 0ns : period - since_epoch;
}

// Centre of mass to antenna; the body is taken as not turning (receiver.hpp).
InertialState antenna_state(const OrbitState& body, const Mat3& R_BI, const Vec3& lever_arm_B) {
  return {body.r_ECI + transpose(R_BI) * lever_arm_B, body.v_ECI};
}

// One draw per statement: the order of arguments is the compiler's.
Vec3 white_noise(RandomStream& stream, double sigma) {
  Vec3 noise;
  noise.x = stream.normal(0, sigma);
  noise.y = stream.normal(0, sigma);
  noise.z = stream.normal(0, sigma);
  return noise;
}

}  // namespace

GnssReceiver::GnssReceiver(const Options& options) : options_(options) {
  check_period(options.period);
  check_sigma("sigma_position_m", options.sigma_position_m, kLargestSigmaPosition_m);
  check_sigma("sigma_velocity_mps", options.sigma_velocity_mps, kLargestSigmaVelocity_mps);
  check_lever_arm(options.lever_arm_B);
}

void GnssReceiver::start(DeviceContext& io) {
  io.after(until_next_epoch(io.now(), options_.period),
           [this, &io] { io.every(options_.period, [this, &io] { measure(io); }); });
}

void GnssReceiver::measure(DeviceContext& io) {
  const Vec3 noise_r = white_noise(io.random("position_noise"), options_.sigma_position_m);
  const Vec3 noise_v = white_noise(io.random("velocity_noise"), options_.sigma_velocity_mps);
  if (io.fault("outage", 0.0) != 0.0) return;

  const Surroundings around = io.surroundings();
  const EarthFixedState antenna =
      to_earth_fixed(antenna_state(io.truth(), io.R_BI(), options_.lever_arm_B), around.R_EI,
                     around.omega_EI_ECEF);

  const double sigma_r = options_.sigma_position_m;
  const double sigma_v = options_.sigma_velocity_mps;
  const novatel::BestXyz message{.r_ECEF = antenna.r_ECEF + noise_r,
                                 .sigma_r_ECEF = {sigma_r, sigma_r, sigma_r},
                                 .v_ECEF = antenna.v_ECEF + noise_v,
                                 .sigma_v_ECEF = {sigma_v, sigma_v, sigma_v},
                                 .satellites_tracked = kChannels,
                                 .satellites_used = kChannels,
                                 .satellites_used_L1 = kChannels,
                                 .gps_glonass_mask = kGpsL1};
  frame_.clear();
  novatel::append_frame({.message_id = novatel::kBestXyzId, .t = io.now()},
                        novatel::encode(message), frame_);
  io.to_flight(frame_);
}

}  // namespace orrery
