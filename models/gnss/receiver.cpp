#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/frames/frames.hpp>
#include <orrery/models/gnss/gps_constants.hpp>
#include <orrery/models/gnss/lnav.hpp>
#include <orrery/models/gnss/receiver.hpp>
#include <orrery/models/orbit/earth.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace orrery {

namespace {

constexpr Duration kShortestPeriod = 100ms;  // 10 Hz
constexpr Duration kLongestPeriod = 60s;     // 1/60 Hz
constexpr double kLargestSigmaPosition_m = 1e4;
constexpr double kLargestSigmaVelocity_mps = 1e3;
constexpr double kLongestLeverArm_m = 100;
constexpr double kSteered_s = 1e-7;
constexpr Duration kFrame = 30s;      // of the LNAV message
constexpr Duration kSubframes = 18s;  // its first three
constexpr Duration kGoodAfterToe = 2h;
constexpr int kFewestSatellites = 4;

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

/// Axes of the antenna: z along its boresight, x as near to the body's x as that allows.
Mat3 antenna_axes(const Vec3& boresight_B) {
  if (!is_finite(boresight_B) || !(norm(boresight_B) > 0)) {
    throw std::invalid_argument("GnssReceiver: boresight_B has no direction");
  }
  const Vec3 z = unit(boresight_B);
  const Vec3 near = std::abs(z.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 x = unit(near - dot(near, z) * z);
  return {x, cross(z, x), z};
}

// Faults whose names carry numbers.
constexpr std::string_view kSector = "sector ", kBias = "bias ";

void check_sector(const SkySector& s) {
  const double width_deg = s.azimuth_to_deg - s.azimuth_from_deg;
  if (width_deg > 0 && width_deg <= 360 && s.elevation_to_deg > s.elevation_from_deg) return;
  throw std::invalid_argument("GnssReceiver: sector of " + to_text(width_deg) +
                              " deg in azimuth and " +
                              to_text(s.elevation_to_deg - s.elevation_from_deg) +
                              " deg in elevation; accepted: above 0, azimuth to 360");
}

void check_bias(const Vec3& by_ECEF) {
  if (is_finite(by_ECEF)) return;
  throw std::invalid_argument("GnssReceiver: bias of the solution is not finite");
}

template <std::size_t kCount>
std::array<double, kCount> numbers_of(std::string_view name, std::string_view prefix) {
  std::array<double, kCount> out{};
  const char *at = name.data() + prefix.size(), *const end = name.data() + name.size();
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto [after, error] = std::from_chars(at, end, out[i]);
    const bool last = i + 1 == kCount;
    if (error != std::errc{} || (last ? after != end : after == end || *after != ' ')) {
      throw std::invalid_argument("GnssReceiver: fault '" + std::string(name) + "'; accepted: '" +
                                  std::string(prefix) + "' and " + std::to_string(kCount) +
                                  " numbers");
    }
    at = after + !last;
  }
  return out;
}

Duration until_next_epoch(SimTime now, Duration period) {
  const Duration since_epoch = now.time_since_epoch() % period;
  return since_epoch == 0ns ? 0ns : period - since_epoch;
}

std::string label(int prn) {
  return (prn < 10 ? "G0" : "G") + std::to_string(prn);
}

std::vector<novatel::LogRequest> requests(const GnssReceiverOptions& options) {
  if (!options.logs.empty()) return options.logs;
  return {{.message_id = novatel::kBestXyzId,
           .trigger = novatel::LogTrigger::kOnTime,
           .period = options.period}};
}

}  // namespace

GnssReceiver::GnssReceiver(const Options& options, std::shared_ptr<GpsConstellation> gps)
    : options_(options),
      gps_(std::move(gps)),
      R_AB_(antenna_axes(options.boresight_B)),
      clock_(options.clock) {
  check_period(options.period);
  check_sigma("sigma_position_m", options.sigma_position_m, kLargestSigmaPosition_m);
  check_sigma("sigma_velocity_mps", options.sigma_velocity_mps, kLargestSigmaVelocity_mps);
  check_lever_arm(options.lever_arm_B);
  // What the tracker and the logs refuse shows here rather than at power-on.
  RandomStream unused(0);
  GnssTracker(options.tracking, options.antenna,
              [&unused](std::string_view) -> RandomStream& { return unused; });
  for (const novatel::LogRequest& request : requests(options)) {
    if (!logs_.log(request)) {
      throw std::invalid_argument("GnssReceiver: more than " +
                                  std::to_string(novatel::LogSchedule::kMaxLogs) + " logs");
    }
  }
  for (int prn = 1; prn <= gps::kSatellites; ++prn) {
    fault_names_[static_cast<std::size_t>(prn - 1)] = {"outage " + label(prn), "slip " + label(prn),
                                                       "withhold " + label(prn)};
  }
}

std::string GnssReceiver::sector_fault(const SkySector& s) {
  check_sector(s);
  return std::string(kSector) + to_text(s.azimuth_from_deg) + ' ' + to_text(s.azimuth_to_deg) +
         ' ' + to_text(s.elevation_from_deg) + ' ' + to_text(s.elevation_to_deg);
}

std::string GnssReceiver::bias_fault(const Vec3& by_ECEF) {
  check_bias(by_ECEF);
  return std::string(kBias) + to_text(by_ECEF.x) + ' ' + to_text(by_ECEF.y) + ' ' +
         to_text(by_ECEF.z);
}

void GnssReceiver::fault_set(std::string_view name) {
  const auto same = [name](const auto& fault) { return fault.name == name; };
  if (name.starts_with(kSector) && std::ranges::none_of(sectors_, same)) {
    const auto n = numbers_of<4>(name, kSector);
    const SkySector sector{n[0], n[1], n[2], n[3]};
    check_sector(sector);
    sectors_.push_back({std::string(name), sector});
  }
  if (name.starts_with(kBias) && std::ranges::none_of(biases_, same)) {
    const auto n = numbers_of<3>(name, kBias);
    const Vec3 by_ECEF{n[0], n[1], n[2]};
    check_bias(by_ECEF);
    biases_.push_back({std::string(name), by_ECEF});
  }
}

void GnssReceiver::start(DeviceContext& io) {
  power_on(io);
  io.after(until_next_epoch(io.now(), options_.period),
           [this, &io] { io.every(options_.period, [this, &io] { measure(io); }); });
}

void GnssReceiver::power_on(DeviceContext& io) {
  if (gps_ == nullptr) {
    RandomStreams streams(0);
    gps_ = std::make_shared<GpsConstellation>(GpsConstellationOptions{.sigma_orbit_m = 0}, io.now(),
                                              streams);
  }
  position_noise_ = &io.random("position_noise");
  velocity_noise_ = &io.random("velocity_noise");
  clock_noise_ = &io.random("clock");
  if (!tracker_) {
    tracker_.emplace(
        options_.tracking, options_.antenna,
        [&io](std::string_view purpose) -> RandomStream& { return io.random(purpose); });
  }
  if (powered_before_) logs_ = {};
  commands_.emplace(logs_, options_.period);
  for (const novatel::LogRequest& request : requests(options_)) logs_.log(request);
  const GnssStart how = powered_before_ ? GnssStart::kCold : options_.start;
  restart(how);
  powered_before_ = true;
  if (how == GnssStart::kCold) return;
  for (int prn = 1; prn <= gps::kSatellites; ++prn) {
    if (const BroadcastEphemeris* sent = gps_->broadcast(prn, io.now())) learn(*sent);
  }
}

void GnssReceiver::learn(const BroadcastEphemeris& sent) {
  ephemerides_[static_cast<std::size_t>(sent.prn - 1)] = {
      .iodc = sent.iodc,
      .good_until = time_of_ephemeris(sent) + kGoodAfterToe,
      .raw_changed = true,
      .gps_changed = true,
      .data = sent};
  logs_.note_change(novatel::kRawEphemId);
  logs_.note_change(novatel::kGpsEphemId);
}

void GnssReceiver::restart(GnssStart how) {
  tracker_->start(how);
  first_epoch_ = true;
  solution_ = {};
  if (how != GnssStart::kCold) return;
  for (Ephemeris& e : ephemerides_) e = {};
  time_known_ = false;
  clock_.jump(clock_noise_->uniform(-5e-4, 5e-4));
}

void GnssReceiver::from_flight(DeviceContext& io, Bytes bytes) {
  answers_.clear();
  commands_->take(bytes, header(io), answers_);
  if (!answers_.empty()) io.to_flight(answers_);
}

void GnssReceiver::measure(DeviceContext& io) {
  const double restarted = io.fault("restart", 0.0);
  if (restarted != 0.0) restart(restarted >= 2 ? GnssStart::kCold : GnssStart::kWarm);
  clock_.advance(first_epoch_ ? 0.0 : to_seconds(io.now() - last_epoch_), *clock_noise_);
  clock_.jump(io.fault("clock_jump_s", 0.0));

  const Surroundings around = io.surroundings();
  const AntennaPlace antenna = antenna_place(io, around);
  const GpsSnapshot& gps = gps_->at(io.now());
  const bool outage = io.fault("outage", 0.0) != 0.0;
  GnssTracker::Faults faults = tracking_faults(io, antenna, gps);
  if (outage) faults.blocked = ~0u;
  tracker_->epoch(gps, *gps_, antenna, around.R_EI * around.r_sun_ECI, clock_.bias_s(),
                  clock_.drift_sps(), faults);
  receive_ephemerides(io);
  solve(io, antenna);
  first_epoch_ = false;
  last_epoch_ = io.now();
  if (!outage) send(io);
}

AntennaPlace GnssReceiver::antenna_place(DeviceContext& io, const Surroundings& around) const {
  const OrbitState body = io.truth();
  const Mat3 R_BI = io.R_BI();
  const Vec3& omega = around.omega_EI_ECEF;
  const Mat3 R_IB = transpose(R_BI);
  const Vec3& arm_B = options_.lever_arm_B;
  const EarthFixedState s =
      to_earth_fixed({body.r_ECI + R_IB * arm_B, body.v_ECI + R_IB * cross(io.omega_BI_B(), arm_B)},
                     around.R_EI, omega);
  const double r = norm(s.r_ECEF);
  return {io.now(), s.r_ECEF, s.v_ECEF,
          -kMuEarth_m3ps2 / (r * r * r) * s.r_ECEF - 2 * cross(omega, s.v_ECEF) -
              cross(omega, cross(omega, s.r_ECEF)),
          R_AB_ * R_BI * transpose(around.R_EI)};
}

GnssTracker::Faults GnssReceiver::tracking_faults(DeviceContext& io, const AntennaPlace& antenna,
                                                  const GpsSnapshot& gps) const {
  GnssTracker::Faults faults;
  if (!io.may_be_faulty()) return faults;  // spares a hundred questions an epoch
  for (int prn = 1; prn <= gps::kSatellites; ++prn) {
    const std::uint32_t bit = 1u << (prn - 1);
    if ((gps.transmitting & bit) == 0) continue;
    const auto index = static_cast<std::size_t>(prn - 1);
    const FaultNames& names = fault_names_[index];
    if (io.fault(names.outage, 0.0) != 0.0) faults.blocked |= bit;
    faults.cycles[index] = io.fault(names.slip, 0.0);
    if (faults.cycles[index] != 0.0) faults.slipped |= bit;
    if (!sectors_.empty() && in_blocked_sector(io, antenna.r_ECEF, gps[prn].r_ECEF)) {
      faults.blocked |= bit;
    }
  }
  return faults;
}

bool GnssReceiver::in_blocked_sector(DeviceContext& io, const Vec3& r_ECEF,
                                     const Vec3& satellite_ECEF) const {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const Vec3 up = unit(r_ECEF), u = unit(satellite_ECEF - r_ECEF);
  const Vec3 east = unit(cross(Vec3{0, 0, 1}, up)), north = cross(up, east);
  const double azimuth_deg = std::atan2(dot(u, east), dot(u, north)) * kDegrees;
  const double elevation_deg = std::asin(std::clamp(dot(u, up), -1.0, 1.0)) * kDegrees;
  for (const auto& [name, s] : sectors_) {
    const double turn_deg = azimuth_deg - s.azimuth_from_deg;
    const double inside_deg = turn_deg - 360 * std::floor(turn_deg / 360);
    if (inside_deg < s.azimuth_to_deg - s.azimuth_from_deg &&
        elevation_deg >= s.elevation_from_deg && elevation_deg < s.elevation_to_deg &&
        io.fault(name, 0.0) != 0.0) {
      return true;
    }
  }
  return false;
}

void GnssReceiver::receive_ephemerides(DeviceContext& io) {
  const SimTime now = io.now();
  if (io.fault("withhold", 0.0) != 0.0) return;
  for (const GnssChannel& channel : tracker_->channels()) {
    if (!channel.locked) continue;
    const auto index = static_cast<std::size_t>(channel.prn - 1);
    const BroadcastEphemeris* sent = gps_->broadcast(channel.prn, now);
    if (sent == nullptr || sent->iodc == ephemerides_[index].iodc) continue;
    const int now_sent = sent->iodc;  // broadcast() keeps one issue a satellite
    // The last frame whose subframes have come must have begun in lock and within this issue.
    const SimTime frame = now - kSubframes - (now - kSubframes).time_since_epoch() % kFrame;
    if (frame < channel.acquired) continue;
    const BroadcastEphemeris* then = gps_->broadcast(channel.prn, frame);
    if (then == nullptr || then->iodc != now_sent) continue;
    if (io.fault(fault_names_[index].withhold, 0.0) != 0.0) continue;
    learn(*then);
  }
}

std::uint32_t GnssReceiver::ephemerides_known() const {
  std::uint32_t known = 0;
  for (std::size_t i = 0; i < ephemerides_.size(); ++i) {
    if (ephemerides_[i].iodc >= 0) known |= 1u << i;
  }
  return known;
}

void GnssReceiver::solve(DeviceContext& io, const AntennaPlace& antenna) {
  RandomStream* const streams[] = {position_noise_, velocity_noise_};
  std::array<std::array<double, 3>, 2> z;
  normal_triples(streams, z);
  const double times = io.fault("noise", 1.0);
  const Vec3 noise_r = times * options_.sigma_position_m * Vec3{z[0][0], z[0][1], z[0][2]};
  const Vec3 noise_v = times * options_.sigma_velocity_mps * Vec3{z[1][0], z[1][1], z[1][2]};
  int usable = 0;
  for (const GnssChannel& channel : tracker_->channels()) {
    const Ephemeris& e = ephemerides_[static_cast<std::size_t>(channel.prn - 1)];
    usable += channel.locked && e.iodc >= 0 && e.data.health == 0 && io.now() < e.good_until;
  }
  if (io.fault("freeze", 0.0) != 0.0 && solution_.computed) return;
  solution_.satellites = usable;
  solution_.computed = usable >= kFewestSatellites;
  if (!solution_.computed) return;
  solution_.r_ECEF = antenna.r_ECEF + noise_r;
  for (const BiasFault& bias : biases_) {
    if (io.fault(bias.name, 0.0) != 0.0) solution_.r_ECEF += bias.by_ECEF;
  }
  solution_.v_ECEF = antenna.v_ECEF + noise_v;
  if (!time_known_) {
    time_known_ = true;
    tracker_->solution_found();
    clock_.set_to_gps_time(*clock_noise_);
  }
}

novatel::Header GnssReceiver::header(DeviceContext& io) const {
  novatel::Header h;
  const double weeks_off = io.fault("week_offset", 0.0);
  h.t = io.now() + static_cast<std::int64_t>(weeks_off) * gps::kWeek;
  h.time_status = !time_known_                             ? novatel::TimeStatus::kUnknown
                  : std::abs(clock_.bias_s()) < kSteered_s ? novatel::TimeStatus::kFineSteering
                                                           : novatel::TimeStatus::kCoarse;
  return h;
}

void GnssReceiver::send(DeviceContext& io) {
  frames_.clear();
  const novatel::Header head = header(io);
  for (const novatel::DueLog& log : logs_.due(io.now())) {
    const std::size_t from = frames_.size();
    append(log, head);
    if (frames_.size() > from) damage(io, from);
  }
  if (!frames_.empty()) io.to_flight(frames_);
}

void GnssReceiver::damage(DeviceContext& io, std::size_t from) {
  const double bits = io.fault("corrupt", 0.0);
  for (int i = 0; i < static_cast<int>(bits); ++i) {
    RandomStream& stream = io.random("wire");
    const auto length = static_cast<std::int64_t>(frames_.size() - from);
    const auto bit = static_cast<std::size_t>(stream.integer(0, 8 * length - 1));
    frames_[from + bit / 8] ^= std::byte{1} << (bit % 8);
  }
  const double cut = io.fault("cut", 0.0);
  if (cut > 0) {
    const auto missing = static_cast<std::size_t>(std::min(cut, 1e6));
    frames_.resize(frames_.size() - std::min(missing, frames_.size() - from));
  }
}

}  // namespace orrery
