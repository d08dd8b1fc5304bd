// The package at its ports: bytes in, bytes out, one instance per spacecraft.

#include <cmath>
#include <cstdio>
#include <cstring>

#include "configuration.hpp"
#include "crosslink_protocol.hpp"
#include "formation_controller.hpp"
#include "formation_keeping_messages.h"
#include "orrery_flight.hpp"
#include "orrery_messages.h"
#include "relative_navigation.hpp"
#include "support/orbit/constants.hpp"

namespace formation_keeping {

using namespace flight_support;

namespace {

using flight_support::Vec3;
using orrery_abi::Bytes;
using orrery_abi::Host;
using Port = orrery_abi::Port<class FormationKeeping>;

enum PortId : std::uint32_t {
  kGnss = 1,
  kCrosslink = 2,
  kCommand = 3,
  kThruster = 4,
  kEstimate = 5,
  kMode = 6,
  kTelemetry = 7
};
constexpr std::uint32_t kCommandSlot = 0;  // non-volatile: the last command

Role other(Role role) {
  return role == Role::kChief ? Role::kDeputy : Role::kChief;
}

// Read again after create() checked it, so it is sound.
Configuration configuration_of(const orrery_boot& boot) {
  Configuration configuration;
  char message[192];
  parse_configuration(static_cast<const char*>(boot.config), boot.config_bytes, &configuration,
                      message, sizeof message);
  return configuration;
}

class FormationKeeping {
 public:
  FormationKeeping(Host host, const orrery_boot& boot);

  std::int32_t gnss(std::int64_t now_ns, Bytes bytes);
  std::int32_t crosslink(std::int64_t now_ns, Bytes bytes);
  std::int32_t command(std::int64_t now_ns, Bytes bytes);
  std::int32_t tick(std::int64_t now_ns);

  static const Port (&ports())[8];

 private:
  bool is_deputy() const { return configuration_.role == Role::kDeputy; }
  void handle_fix(std::int64_t now_ns, const GnssFix& fix);
  void send_state(const GnssFix& fix);
  void send_estimate(const FormationState& state);
  void send_mode(std::int64_t t_ns);
  void send_telemetry(std::int64_t t_ns, const FormationState* state);
  void decide(std::int64_t now_ns);
  void command_burn(const FormationState& now, const Burn& burn);
  std::int32_t reject() {
    ++rejected_;
    return ORRERY_REJECTED;
  }
  bool take_command(const unsigned char* message, std::uint32_t bytes, std::int64_t now_ns,
                    bool resumed);
  void resume(std::int64_t now_ns);

  Host host_;
  Configuration configuration_;
  unsigned char gnss_room_[kGnssRoomBytes];
  novatel_framer gnss_framer_;
  GnssFix last_fix_;
  CrosslinkSender sender_;
  CrosslinkReceiver receiver_;
  RelativeNavigation navigation_;
  FormationController controller_;
  Mode reported_mode_ = Mode::kPassive;
  std::int64_t last_crosslink_slot_ = -1;
  std::int64_t last_telemetry_slot_ = -1;
  bool in_trouble_ = false;
  double delta_v_mps_ = 0.0;
  std::uint32_t burns_ = 0, rejected_ = 0;
};

const Port (&FormationKeeping::ports())[8] {
  static const Port table[8] = {
      {kGnss, ORRERY_IN, ORRERY_STREAM, "gnss", 4096, &FormationKeeping::gnss},
      {kCrosslink, ORRERY_IN, ORRERY_PACKET, "crosslink", 256, &FormationKeeping::crosslink},
      {kCommand, ORRERY_IN, ORRERY_PACKET, "command", 256, &FormationKeeping::command},
      {kCrosslink, ORRERY_OUT, ORRERY_PACKET, "crosslink", kCrosslinkBytes, nullptr},
      {kThruster, ORRERY_OUT, ORRERY_PACKET, "thruster", ORRERY_THRUSTER_BYTES, nullptr},
      {kEstimate, ORRERY_OUT, ORRERY_PACKET, "estimate", ORRERY_ESTIMATE_BYTES, nullptr},
      {kMode, ORRERY_OUT, ORRERY_PACKET, "mode", ORRERY_MODE_BYTES, nullptr},
      {kTelemetry, ORRERY_OUT, ORRERY_PACKET, "telemetry", FORMATION_TELEMETRY_BYTES, nullptr},
  };
  return table;
}

FormationKeeping::FormationKeeping(Host host, const orrery_boot& boot)
    : host_(host),
      configuration_(configuration_of(boot)),
      sender_(configuration_.role, boot.boot_count),
      receiver_(other(configuration_.role)),
      navigation_(configuration_.navigation),
      controller_(configuration_.control, configuration_.planner) {
  novatel_framer_init(&gnss_framer_, gnss_room_, sizeof gnss_room_);
  if (is_deputy()) {
    reported_mode_ = Mode::kAcquiring;
    resume(boot.now_ns);
    host_.request_tick(boot.now_ns + 60 * kSecond_ns);
  }
  send_mode(boot.now_ns);
}

// A reboot forgets everything but the last command.
void FormationKeeping::resume(std::int64_t now_ns) {
  unsigned char message[FORMATION_COMMAND_BYTES];
  if (!ORRERY_HAS(host_.operator->(), nv_load)) return;
  const std::int32_t bytes = host_->nv_load(host_->context, kCommandSlot, message, sizeof message);
  if (bytes > 0 && take_command(message, static_cast<std::uint32_t>(bytes), now_ns, true)) {
    host_.log(ORRERY_INFO, "resumed the last command");
  }
}

std::int32_t FormationKeeping::gnss(std::int64_t now_ns, Bytes bytes) {
  const unsigned char* data = static_cast<const unsigned char*>(bytes.data);
  const std::uint32_t bad_before = gnss_framer_.bad_frames;
  for (std::size_t left = bytes.size; left > 0;) {
    const std::size_t taken = novatel_framer_write(&gnss_framer_, data, left);
    data += taken;
    left -= taken;
    novatel_frame frame;
    GnssFix fix;
    while (novatel_framer_next(&gnss_framer_, &frame) != 0) {
      if (!read_fix(frame, &fix)) continue;
      const bool stale = repeats(last_fix_, fix);
      last_fix_ = fix;
      if (!stale) handle_fix(now_ns, fix);
    }
  }
  return gnss_framer_.bad_frames == bad_before ? ORRERY_OK : reject();
}

void FormationKeeping::handle_fix(std::int64_t now_ns, const GnssFix& fix) {
  // Periods are counted in GPS time, not from boot: so both spacecraft send the same epochs
  // whatever their receivers' rates.
  const std::int64_t slot = fix.epoch_ns / nanoseconds(configuration_.crosslink_period_s);
  if (slot != last_crosslink_slot_) {
    last_crosslink_slot_ = slot;
    send_state(fix);
  }
  if (!is_deputy()) return;
  if (!navigation_.add_own_fix(fix)) return;
  navigation_.process(now_ns);
  const std::int64_t telemetry_slot = fix.epoch_ns / nanoseconds(configuration_.telemetry_period_s);
  const bool telemetry_due = telemetry_slot != last_telemetry_slot_;
  last_telemetry_slot_ = telemetry_slot;
  if (navigation_.can_predict(fix.epoch_ns)) {
    const FormationState state = navigation_.at(fix.epoch_ns);
    send_estimate(state);
    if (telemetry_due) send_telemetry(fix.epoch_ns, &state);
  } else if (telemetry_due) {
    send_telemetry(fix.epoch_ns, nullptr);
  }
}

void FormationKeeping::send_state(const GnssFix& fix) {
  unsigned char message[kCrosslinkBytes];
  sender_.pack(fix, message);
  host_.output(kCrosslink, {message, sizeof message});
}

std::int32_t FormationKeeping::crosslink(std::int64_t, Bytes bytes) {
  const auto verdict = receiver_.receive(static_cast<const unsigned char*>(bytes.data), bytes.size);
  if (verdict != CrosslinkReceiver::Verdict::kAccepted) return reject();
  if (is_deputy() && !navigation_.add_chief_fix(receiver_.fix())) return reject();
  return ORRERY_OK;
}

std::int32_t FormationKeeping::command(std::int64_t now_ns, Bytes bytes) {
  const unsigned char* message = static_cast<const unsigned char*>(bytes.data);
  if (!is_deputy()) {
    host_.log(ORRERY_WARNING, "command rejected: the chief takes none");
    return reject();
  }
  if (!take_command(message, bytes.size, now_ns, false)) return reject();
  if (ORRERY_HAS(host_.operator->(), nv_store)) {
    host_->nv_store(host_->context, kCommandSlot, message, bytes.size);
  }
  decide(now_ns);
  return ORRERY_OK;
}

bool FormationKeeping::take_command(const unsigned char* message, std::uint32_t bytes,
                                    std::int64_t now_ns, bool resumed) {
  unsigned opcode = 0;
  double a_roe_m[6];
  Goal goal;
  if (!formation_get_command(message, bytes, &opcode, a_roe_m, &goal.end_ns)) {
    host_.log(ORRERY_WARNING, "command rejected: length or CRC");
    return false;
  }
  if (opcode == FORMATION_HALT) {
    controller_.halt();
    return true;
  }
  if (opcode != FORMATION_RECONFIGURE) {
    host_.log(ORRERY_WARNING, "command rejected: unknown opcode");
    return false;
  }
  for (int k = 0; k < 6; ++k) goal.a_roe[k] = a_roe_m[k];
  if (resumed) {
    controller_.resume(goal);
    return true;
  }
  switch (controller_.accept(goal, now_ns)) {
    case FormationController::Acceptance::kAccepted:
      return true;
    case FormationController::Acceptance::kNotSafe:
      host_.log(ORRERY_WARNING, "command rejected: the goal is not passively safe");
      return false;
    case FormationController::Acceptance::kOutOfRange:
      host_.log(ORRERY_WARNING, "command rejected: goal or end epoch out of range");
      return false;
  }
  return false;
}

std::int32_t FormationKeeping::tick(std::int64_t now_ns) {
  decide(now_ns);
  return ORRERY_OK;
}

void FormationKeeping::decide(std::int64_t now_ns) {
  constexpr std::int64_t kRetry_ns = 60 * kSecond_ns;
  navigation_.process(now_ns);
  if (!navigation_.can_predict(now_ns)) {
    host_.request_tick(now_ns + kRetry_ns);
    return;
  }
  const FormationState now = navigation_.at(now_ns);
  const FormationController::Decision decision = controller_.decide(now);
  // Once per spell: a decision that finds no plan comes back every few minutes.
  if (decision.trouble != nullptr && !in_trouble_) host_.log(ORRERY_WARNING, decision.trouble);
  in_trouble_ = decision.trouble != nullptr;
  if (controller_.mode() != reported_mode_) {
    reported_mode_ = controller_.mode();
    send_mode(now_ns);
  }
  if (decision.burn) command_burn(now, decision.what);
  host_.request_tick(decision.next_ns);
}

void FormationKeeping::command_burn(const FormationState& now, const Burn& burn) {
  const FormationState then = navigation_.at(burn.t_ns);
  const OrbitElements deputy = apply_relative_elements(then.chief, then.relative.mean);
  const StateEci state = state_from_osculating(osculating_from_mean(deputy));
  const Vec3 dv_ECI = transpose(eci_to_rtn(state)) * burn.dv_RTN;
  unsigned char message[ORRERY_THRUSTER_BYTES];
  const double dv[3] = {dv_ECI[0], dv_ECI[1], dv_ECI[2]};
  orrery_put_thruster(message, burn.t_ns, dv);
  // What the thruster did not take will not happen, and must not be in the filter.
  if (host_.output(kThruster, {message, sizeof message}) != ORRERY_OK) {
    host_.log(ORRERY_ERROR, "the thruster refused a burn");
    return;
  }
  navigation_.add_burn(burn);
  controller_.commanded(burn);
  const double size_mps = norm(burn.dv_RTN);
  delta_v_mps_ += size_mps;
  ++burns_;
  char line[128];
  std::snprintf(line, sizeof line,
                "burn %u in %.0f s: RTN %.2f %.2f %.2f mm/s, a*de %.1f m, a*di %.1f m", burns_,
                seconds(burn.t_ns - now.t_ns), 1e3 * burn.dv_RTN[0], 1e3 * burn.dv_RTN[1],
                1e3 * burn.dv_RTN[2], std::hypot(now.relative.mean[kDex], now.relative.mean[kDey]),
                std::hypot(now.relative.mean[kDix], now.relative.mean[kDiy]));
  host_.log(ORRERY_INFO, line);
}

void FormationKeeping::send_estimate(const FormationState& state) {
  const OrbitElements deputy = apply_relative_elements(state.chief, state.relative.mean);
  const StateEci chief_state = state_from_osculating(osculating_from_mean(state.chief));
  const RelativeStateRtn relative =
      relative_state_rtn(chief_state, state_from_osculating(osculating_from_mean(deputy)));
  const Matrix6 H =
      rtn_from_relative_elements(state.chief.u_rad, mean_motion_radps(state.chief.a_m));
  const Matrix6 P = H * state.relative.covariance * transpose(H);
  double r[3], v[3], sigma_r[3], sigma_v[3];
  for (int k = 0; k < 3; ++k) {
    r[k] = relative.r_DC_RTN[k];
    v[k] = relative.v_DC_RTN[k];
    sigma_r[k] = std::sqrt(P(k, k));
    sigma_v[k] = std::sqrt(P(k + 3, k + 3));
  }
  unsigned char message[ORRERY_ESTIMATE_BYTES];
  orrery_put_estimate(message, state.t_ns, r, v, sigma_r, sigma_v);
  host_.output(kEstimate, {message, sizeof message});
}

void FormationKeeping::send_mode(std::int64_t t_ns) {
  unsigned char message[ORRERY_MODE_BYTES];
  orrery_put_mode(message, t_ns, static_cast<std::uint32_t>(reported_mode_));
  host_.output(kMode, {message, sizeof message});
}

void FormationKeeping::send_telemetry(std::int64_t t_ns, const FormationState* state) {
  formation_telemetry t;
  std::memset(&t, 0, sizeof t);
  t.t_ns = t_ns;
  t.mode = static_cast<std::uint32_t>(reported_mode_);
  if (state != nullptr) {
    for (int k = 0; k < 6; ++k) {
      t.a_roe_m[k] = state->relative.mean[k];
      t.sigma_m[k] = std::sqrt(state->relative.covariance(k, k));
    }
  }
  t.delta_v_mps = delta_v_mps_;
  t.burns = burns_;
  t.updates = navigation_.updates();
  t.outliers = navigation_.outliers();
  t.rejected = rejected_;
  unsigned char message[FORMATION_TELEMETRY_BYTES];
  formation_put_telemetry(message, &t);
  host_.output(kTelemetry, {message, sizeof message});
}

// In front of the C++ face's own create(), which has no way to fail: a wrong configuration is a
// boot failure with its reason in the log.
std::int32_t create_checked(void** self, const orrery_host* host,
                            const orrery_boot* boot) noexcept {
  Configuration configuration;
  char message[192];
  if (!parse_configuration(static_cast<const char*>(boot->config), boot->config_bytes,
                           &configuration, message, sizeof message)) {
    host->log(host->context, ORRERY_ERROR, message);
    return ORRERY_FATAL;
  }
  return orrery_abi::Thunks<FormationKeeping>::create(self, host, boot);
}

orrery_flight with_checked_create(orrery_flight flight) {
  flight.create = &create_checked;
  return flight;
}

}  // namespace
}  // namespace formation_keeping

extern "C" ORRERY_EXPORT const orrery_flight* ORRERY_FLIGHT_ENTRY(void) {
  using formation_keeping::FormationKeeping;
  static orrery_port
      ports[sizeof(FormationKeeping::ports()) / sizeof(FormationKeeping::ports()[0])];
  static const orrery_flight flight = formation_keeping::with_checked_create(
      orrery_abi::describe(FormationKeeping::ports(), ports, "formation_keeping", "1.0"));
  return &flight;
}
