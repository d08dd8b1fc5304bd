#include "formation_gnc/mission/formation_gnc.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>

#include "support/crc32.h"
#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

enum Slot : std::uint32_t { kRecordSlot = 0, kPlanSlot = 1, kDeltaVSlot = 2 };
// Of the package, beside the transition protocol's.
enum PayloadType : unsigned { kForwardedCommand = 16, kManeuverNotice = 17 };

constexpr std::int64_t kNs = 1000000000;
constexpr std::int64_t kForecastPeriod_ns = 60 * kNs;
constexpr std::int64_t kEpochSilence_ns = 50 * kNs;
constexpr std::int64_t kReceiverSilence_ns = 60 * kNs;
constexpr std::int64_t kHousekeeping_ns = 60 * kNs;
constexpr std::int64_t kRetry_ns = kNs;
constexpr std::uint32_t kChunk = 512;  // of the receiver's stream at a time
constexpr int kUnsafeForecasts = 3;    // in a row, before an escape

std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

TransitionRecord loaded_record(Outputs& out, Mode initial_mode) {
  unsigned char bytes[kTransitionRecordBytes];
  TransitionRecord record;
  record.mode = record.current.mode = initial_mode;
  const std::int32_t count = out.load(kRecordSlot, bytes, sizeof bytes);
  if (count > 0 && !restore(bytes, static_cast<std::uint32_t>(count), &record)) {
    out.log(LogLevel::kError, "the stored mode is damaged: as at the first boot");
  }
  return record;
}

CommandPlan loaded_plan(Outputs& out) {
  unsigned char bytes[CommandPlan::kStoredBytes];
  CommandPlan plan;
  const std::int32_t count = out.load(kPlanSlot, bytes, sizeof bytes);
  if (count > 0 && !plan.restore(bytes, static_cast<std::uint32_t>(count))) {
    out.log(LogLevel::kError, "the stored plan is damaged: empty");
  }
  return plan;
}

double loaded_delta_v(Outputs& out) {
  unsigned char bytes[12];
  if (out.load(kDeltaVSlot, bytes, sizeof bytes) != sizeof bytes) return 0.0;
  if (orrery_get_u32(bytes + 8) != flight_crc32_common(bytes, 8)) return 0.0;
  return orrery_get_f64(bytes);
}

Vec3 vec3_of(const double* v) {
  return vec3(v[0], v[1], v[2]);
}

double trace_of_position(const Matrix6& P) {
  return P(0, 0) + P(1, 1) + P(2, 2);
}

}  // namespace

FormationGnc::FormationGnc(Outputs& outputs, const Configuration& configuration, const Boot& boot)
    : out_(outputs),
      configuration_(configuration),
      boot_count_(boot.boot_count),
      navigation_(configuration.navigation),
      separation_(configuration.separation),
      crosslink_(configuration.role, boot.boot_count, configuration.link),
      mission_(configuration.role, configuration.mission,
               loaded_record(outputs, configuration.initial_mode), loaded_plan(outputs),
               boot.now_ns),
      maneuvers_(gravity_, configuration.maneuvers),
      burn_observer_(configuration.maneuvers.errors),
      delta_v_mps_(loaded_delta_v(outputs)) {
  maneuvers_.enter(mission_.protocol().record().current);
  ask_receiver(boot.now_ns);
  out_.out_mode(boot.now_ns, static_cast<std::uint32_t>(mode()));
  out_.request_tick(boot.now_ns + kHousekeeping_ns);
}

void FormationGnc::say(LogLevel level, const char* format, ...) {
  char line[160];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  out_.log(level, line);
}

// ---- inputs

// A receiver forgets what it was asked for when it loses power.
void FormationGnc::ask_receiver(std::int64_t now_GPS_ns) {
  asked_ns_ = now_GPS_ns;
  char command[64];
  for (const char* log : {"RANGEB", "BESTXYZB"}) {
    std::snprintf(command, sizeof command, "LOG %s ONTIME %g\r\n", log,
                  configuration_.gnss_period_s);
    out_.out_gnss(command);
  }
  out_.out_gnss("LOG RAWEPHEMB ONCHANGED\r\n");
}

bool FormationGnc::in_gnss(std::int64_t now_ns, const unsigned char* bytes, std::uint32_t count) {
  const std::uint32_t bad_before = decoder_.bytes_dropped();
  while (count > 0) {
    const std::uint32_t part = std::min(count, kChunk);
    decoder_.write(bytes, part);
    bytes += part;
    count -= part;
    for (auto what = decoder_.next(); what != GnssDecoder::kNothing; what = decoder_.next()) {
      if (what == GnssDecoder::kEphemeris) navigation_.ephemeris(decoder_.ephemeris());
      if (what == GnssDecoder::kEpoch) handle_epoch(decoder_.epoch(), now_ns);
    }
  }
  if (decoder_.flush()) handle_epoch(decoder_.epoch(), now_ns);
  return decoder_.bytes_dropped() == bad_before || reject();
}

bool FormationGnc::in_bus(std::int64_t, const unsigned char* message, std::uint32_t bytes) {
  if (bytes != ORRERY_BUS_BYTES) return reject();
  std::int64_t t_ns = 0;
  double q[4], omega[3], on_time_s[6];
  orrery_get_bus(message, &t_ns, q, omega, on_time_s);
  const double length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  // Written so that a NaN is rejected.
  if (!(std::fabs(length2 - 1.0) < 1e-3) || !(norm(vec3_of(omega)) < 10.0)) return reject();
  attitude_.take(clock_.gps_ns(t_ns), {q[0], q[1], q[2], q[3]}, vec3_of(omega));
  return true;
}

bool FormationGnc::in_crosslink(std::int64_t now_onboard_ns, const unsigned char* packet,
                                std::uint32_t bytes) {
  bool new_session = false;
  const auto verdict = crosslink_.read(packet, bytes, &new_session);
  if (verdict == CrosslinkLayer::Verdict::kRejected) return reject();
  const std::int64_t now_ns = clock_.gps_ns(now_onboard_ns);
  partner_heard_ns_ = now_ns;
  if (new_session) mission_.protocol().peer_restarted();
  mission_.protocol().hear_committed(crosslink_.committed());
  bool good = true;
  if (verdict == CrosslinkLayer::Verdict::kMeasurement) {
    ++measurements_heard_;
    navigation_.remote_epoch(crosslink_.epoch(), crosslink_.q_BI());
    const UpdateReports& reports = navigation_.reports();
    if (reports.t_ns == crosslink_.epoch().t_ns) {
      graphic_.add(reports.graphic_other);
      sdcp_.add(reports.sdcp);
    }
  }
  Payload payload;
  while (crosslink_.link().take(&payload)) good = take_payload(payload, now_ns) && good;
  work_blindly(now_onboard_ns);
  return good || reject();
}

bool FormationGnc::take_payload(const Payload& payload, std::int64_t now_ns) {
  if (payload.bytes == 0) return false;
  if (payload.data[0] == kForwardedCommand) {
    return take_command(payload.data + 1, payload.bytes - 1);
  }
  if (payload.data[0] == kManeuverNotice) return take_maneuver(payload);
  const bool good = mission_.protocol().receive(payload, now_ns);
  settle(now_ns);
  return good;
}

// So that the filter here knows what the other one does.
bool FormationGnc::take_maneuver(const Payload& payload) {
  ByteReader reader(payload.data, payload.bytes);
  reader.u8();
  Maneuver maneuver;
  maneuver.who = Who::kOther;
  maneuver.t_ns = reader.i64();
  for (int k = 0; k < 3; ++k) maneuver.dv_ECI[k] = reader.f64();
  maneuver.sigma_mps = reader.f64();
  maneuver.more_along_mps = reader.f64();
  if (!reader.whole() || !is_finite(maneuver.dv_ECI) || !std::isfinite(maneuver.sigma_mps) ||
      !std::isfinite(maneuver.more_along_mps)) {
    return false;
  }
  navigation_.maneuver(maneuver);
  return true;
}

bool FormationGnc::in_command(std::int64_t now_onboard_ns, const unsigned char* message,
                              std::uint32_t bytes) {
  formation_gnc_command command;
  if (formation_gnc_get_command(message, bytes, &command) == 0) {
    out_.log(LogLevel::kWarning, "command rejected: length, CRC or version");
    return reject();
  }
  if (!is_deputy()) {
    if (!take_command(message, bytes)) return reject();
  } else {
    Payload payload;
    payload.data[0] = kForwardedCommand;
    std::memcpy(payload.data + 1, message, bytes);
    payload.bytes = bytes + 1;
    if (!is_valid(command) || !crosslink_.link().send(payload)) {
      out_.log(LogLevel::kWarning, "command rejected: a field is out of range, or no room");
      return reject();
    }
  }
  work_blindly(now_onboard_ns);
  return true;
}

bool FormationGnc::take_command(const unsigned char* message, std::uint32_t bytes) {
  formation_gnc_command command;
  if (is_deputy() || formation_gnc_get_command(message, bytes, &command) == 0) return false;
  const char* why = mission_.command(command);
  if (why == nullptr) return true;
  say(LogLevel::kWarning, "command %u rejected: %s", static_cast<unsigned>(command.number), why);
  return false;
}

void FormationGnc::in_tick(std::int64_t now_ns) {
  work_blindly(now_ns);
}

// ---- epochs

void FormationGnc::handle_epoch(const GnssEpoch& epoch, std::int64_t now_onboard_ns) {
  clock_.compare(epoch.t_ns, now_onboard_ns);
  last_epoch_ns_ = epoch.t_ns;
  const std::int64_t now_ns = clock_.gps_ns(now_onboard_ns);
  if (epoch.count > 0) last_range_ns_ = epoch.t_ns;
  if (attitude_.known()) {
    const Quaternion q_BI = attitude_.at(epoch.t_ns);
    navigation_.own_epoch(epoch, q_BI);
    if (navigation_.reports().t_ns == epoch.t_ns) graphic_.add(navigation_.reports().graphic_self);
    // Slots are counted in GPS time, so that both send the same epochs.
    const std::int64_t slot = epoch.t_ns / nanoseconds(configuration_.crosslink_period_s);
    if (slot != last_crosslink_slot_) {
      last_crosslink_slot_ = slot;
      send_measurement(epoch, q_BI);
    }
  }
  const FormationEstimate estimate = navigation_.at(epoch.t_ns);
  if (estimate.valid) send_estimate(estimate);
  navigation_valid_ = estimate.valid;
  const std::int64_t slot = epoch.t_ns / nanoseconds(configuration_.telemetry_period_s);
  if (slot != last_telemetry_slot_) {
    last_telemetry_slot_ = slot;
    send_telemetry(now_ns, estimate);
  }
  work(now_onboard_ns, estimate.valid ? &estimate : nullptr);
}

void FormationGnc::send_measurement(const GnssEpoch& epoch, const Quaternion& q_BI) {
  CrosslinkLayer::Packet packet;
  const std::uint32_t bytes =
      crosslink_.write_measurement(epoch, q_BI, mission_.protocol().committed_id(), packet);
  ++measurements_sent_;
  out_.out_crosslink(packet, bytes);
}

// ---- decisions

// Estimates are asked for at epochs, where they are published anyway, and on ticks when the
// receiver is silent: a packet in between changes nothing that would not wait for the next epoch.
void FormationGnc::work_blindly(std::int64_t now_onboard_ns) {
  const std::int64_t now_ns = clock_.gps_ns(now_onboard_ns);
  if (now_ns - last_epoch_ns_ < kEpochSilence_ns) {
    work(now_onboard_ns, nullptr);
    return;
  }
  const FormationEstimate estimate = navigation_.at(now_ns);
  navigation_valid_ = estimate.valid;
  work(now_onboard_ns, estimate.valid ? &estimate : nullptr);
}

// After every input: faults, plan, protocol, storage, manoeuvres, then what is to be said. Stored
// before it is said: what the partner hears of is never forgotten.
void FormationGnc::work(std::int64_t now_onboard_ns, const FormationEstimate* estimate) {
  const std::int64_t now_ns = clock_.gps_ns(now_onboard_ns);
  if (now_ns - std::max(last_range_ns_, asked_ns_) > kReceiverSilence_ns) ask_receiver(now_ns);
  if (estimate != nullptr) watch_separation(*estimate);
  mission_.watch(now_ns,
                 {navigation_valid_,
                  is_deputy() && configuration_.escape && unsafe_forecasts_ >= kUnsafeForecasts,
                  partner_heard_ns_, delta_v_mps_});
  settle(now_ns);
  if (estimate != nullptr) place_observation(*estimate);
  mission_.poll(now_ns, &crosslink_.link());
  settle(now_ns);
  if (is_deputy() && estimate != nullptr) maneuver(*estimate);
  burn_observer_.learn(now_ns, navigation_);
  send_due(now_onboard_ns);
  schedule(now_ns, now_onboard_ns);
}

void FormationGnc::settle(std::int64_t now_ns) {
  TransitionProtocol::Execution execution;
  while (mission_.protocol().take(&execution)) this->execute(execution, now_ns);
  const TransitionProtocol& protocol = mission_.protocol();
  const bool observing =
      protocol.has_pending() && protocol.pending().kind == Event::Kind::kObservation;
  maneuvers_.set_observation(
      observing ? (protocol.pending().begin_ns + protocol.pending().end_ns) / 2 : 0);
  save();
}

void FormationGnc::save() {
  if (mission_.protocol().changed()) {
    unsigned char bytes[kTransitionRecordBytes];
    const std::uint32_t count = formation_gnc::store(mission_.protocol().record(), bytes);
    out_.store(kRecordSlot, bytes, count);
  }
  if (mission_.plan_changed()) {
    unsigned char bytes[CommandPlan::kStoredBytes];
    const std::uint32_t count = mission_.plan().store(bytes);
    out_.store(kPlanSlot, bytes, count);
  }
}

void FormationGnc::execute(const TransitionProtocol::Execution& execution, std::int64_t now_ns) {
  const Event& event = execution.event;
  if (event.kind == Event::Kind::kObservation) {
    if (now_ns >= event.end_ns) {
      ++skipped_;
      say(LogLevel::kWarning, "observation %u missed: heard of too late", event.observations + 0u);
      return;
    }
    ++observations_;
    out_.out_observation(event.begin_ns, event.end_ns);
    return;
  }
  maneuvers_.enter(event);
  unsafe_forecasts_ = 0;
  out_.out_mode(now_ns, static_cast<std::uint32_t>(event.mode));
  say(execution.emergency ? LogLevel::kWarning : LogLevel::kInfo, "mode %u%s%s, transition %u",
      static_cast<unsigned>(event.mode), execution.emergency ? ", emergency" : "",
      execution.late ? ", late" : "", static_cast<unsigned>(event.id));
}

FormationEstimate FormationGnc::from_chief(const FormationEstimate& estimate) const {
  return is_deputy() ? seen_from_other(estimate) : estimate;
}

Situation FormationGnc::situation(const FormationEstimate& estimate) const {
  const FormationEstimate e = from_chief(estimate);
  Situation s;
  s.t_ns = e.t_ns;
  s.chief = {e.r_self_ECI, e.v_self_ECI};
  s.deputy = {e.r_other_ECI, e.v_other_ECI};
  s.relative_covariance_RTN = e.relative_covariance_RTN;
  s.sigma_r_m = std::sqrt(trace_of_position(e.relative_covariance_RTN));
  // Gauss: d(a*da)/dt = 2 a_T / n.
  const double n_radps = mean_motion_radps(osculating_from_state(s.chief).a_m);
  s.a_da_rate_mps = 2.0 * e.drag_difference_mps2 / n_radps;
  s.budget_mps = configuration_.mission.delta_v_budget_mps - delta_v_mps_;
  return s;
}

// A forecast that is not based on anything yet must not lead to an escape.
void FormationGnc::watch_separation(const FormationEstimate& estimate) {
  // Every minute; after one that looks unsafe at the next epoch, so that two more soon decide.
  if (estimate.t_ns / kForecastPeriod_ns == last_forecast_slot_ && unsafe_forecasts_ == 0) return;
  last_forecast_slot_ = estimate.t_ns / kForecastPeriod_ns;
  const Situation s = situation(estimate);
  if (!(s.sigma_r_m < configuration_.maneuvers.planning_sigma_r_m)) return;
  forecast_ = separation_.forecast({s.t_ns, s.chief, s.deputy, s.relative_covariance_RTN});
  // On the way between the two orbits the limit is that of the narrower one.
  const bool near = mode() == Mode::kScience || mode() == Mode::kTransfer || mode() == Mode::kSafe;
  const bool unsafe = mode() != Mode::kEscape && separation_.must_escape(forecast_, near);
  unsafe_forecasts_ = unsafe ? unsafe_forecasts_ + 1 : 0;
}

void FormationGnc::place_observation(const FormationEstimate& estimate) {
  const Situation s = situation(estimate);
  const double period_s = 2.0 * kPi / mean_motion_radps(osculating_from_state(s.chief).a_m);
  std::int64_t earliest_ns = 0;
  if (!mission_.wants_observation(s.t_ns, period_s, &earliest_ns)) return;
  mission_.place_observation(maneuvers_.next_observation_ns(s, earliest_ns), s.t_ns);
}

void FormationGnc::maneuver(const FormationEstimate& estimate) {
  Impulse wanted;
  if (maneuvers_.next(situation(estimate), &wanted)) command_burn(wanted);
  const char* trouble = maneuvers_.trouble();
  if (trouble != nullptr) say(LogLevel::kWarning, "no usable plan: %s", trouble);
}

void FormationGnc::command_burn(const Impulse& wanted) {
  const Mat3 R_BI = rotation_of(attitude_.at(wanted.t_ns));
  const ManeuverOptions& options = configuration_.maneuvers;
  // Already as the thruster will round it, so that the filters hear of what is really done.
  const Vec3 commanded_B = in_whole_on_times(
      burn_observer_.scale().command_for(R_BI * wanted.dv_ECI), options.limits, options.errors);
  if (!(norm(commanded_B) > 0.0)) {  // less than half of the smallest, in each axis
    maneuvers_.commanded(wanted, false);
    return;
  }
  const Vec3 commanded = transpose(R_BI) * commanded_B;
  const double dv[3] = {commanded[0], commanded[1], commanded[2]};
  const bool accepted = out_.out_maneuver(clock_.onboard_ns(wanted.t_ns), dv);
  maneuvers_.commanded(wanted, accepted);
  // What the thruster did not take will not happen, and must not be in the filter.
  if (!accepted) {
    out_.log(LogLevel::kError, "the thruster refused a burn");
    return;
  }
  const Maneuver expected = burn_observer_.expected(wanted.t_ns, R_BI, commanded_B);
  navigation_.maneuver(expected);
  burn_observer_.watch(expected, R_BI, commanded_B, navigation_);
  Payload notice;
  ByteWriter writer(notice.data, sizeof notice.data);
  writer.u8(kManeuverNotice);
  writer.i64(expected.t_ns);
  for (int k = 0; k < 3; ++k) writer.f64(expected.dv_ECI[k]);
  writer.f64(expected.sigma_mps);
  writer.f64(expected.more_along_mps);
  notice.bytes = writer.bytes();
  crosslink_.link().send(notice);  // a full window: the other's filter has to find out by itself
  delta_v_mps_ += norm(expected.dv_ECI);
  ++burns_;
  unsigned char stored[12];
  orrery_put_f64(stored, delta_v_mps_);
  orrery_put_u32(stored + 8, flight_crc32_common(stored, 8));
  out_.store(kDeltaVSlot, stored, sizeof stored);
}

// ---- what is said

void FormationGnc::send_due(std::int64_t now_onboard_ns) {
  CrosslinkLayer::Packet packet;
  const std::uint32_t committed = mission_.protocol().committed_id();
  for (;;) {
    const std::uint32_t bytes = crosslink_.write_due(now_onboard_ns, committed, packet);
    if (bytes == 0) return;
    out_.out_crosslink(packet, bytes);
  }
}

void FormationGnc::schedule(std::int64_t now_ns, std::int64_t now_onboard_ns) {
  const std::int64_t mission_ns = mission_.next_ns();
  std::int64_t next = now_onboard_ns + kHousekeeping_ns;
  if (mission_ns < now_ns + kHousekeeping_ns) next = clock_.onboard_ns(mission_ns);
  next = std::min(next, crosslink_.link().due_ns(now_onboard_ns));
  // What is due and could not be done must not be asked for without end.
  out_.request_tick(next > now_onboard_ns ? next : now_onboard_ns + kRetry_ns);
}

}  // namespace formation_gnc
