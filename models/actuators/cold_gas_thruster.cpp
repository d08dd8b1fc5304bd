#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/actuators/cold_gas_thruster.hpp>
#include <orrery/models/attitude/pointing.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "orrery_messages.h"

namespace orrery {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
// On-times are computed this long before the first valve moves.
constexpr Duration kPreparation = 100ms;
constexpr Duration kStuckCheck = 100ms;

struct Axes {
  Vec3 along, first_transverse, second_transverse;
};

Axes axes_of(int nozzle) {
  constexpr Vec3 kAxes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const int axis = nozzle / 2;
  return {nozzle % 2 == 0 ? kAxes[axis] : -kAxes[axis], kAxes[(axis + 1) % 3],
          kAxes[(axis + 2) % 3]};
}

const unsigned char* raw(Bytes bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

// Nearest quantum; between half the minimum and the minimum the minimum, below it none.
Duration quantised(double on_time_s, const ColdGasThrusterOptions& o) {
  const double minimum_s = to_seconds(o.minimum_on_time);
  if (on_time_s < 0.5 * minimum_s) return Duration::zero();
  const auto quanta = std::llround(on_time_s / to_seconds(o.on_time_quantum));
  return std::max<Duration>(o.minimum_on_time, quanta * o.on_time_quantum);
}

// Rounding to a quantum may pass the limit by half of it.
double largest_impulse_Ns(const ColdGasThrusterOptions& o) {
  return o.maximum_impulse_Ns + 0.5 * o.force_N * to_seconds(o.on_time_quantum);
}

Vec3 impulse_B(const ColdGasThruster::OnTimes& on_times, double force_N) {
  Vec3 sum;
  for (int i = 0; i < ColdGasThruster::kNozzles; ++i) {
    sum += force_N * to_seconds(on_times[static_cast<std::size_t>(i)]) * axes_of(i).along;
  }
  return sum;
}

void require(bool holds, const char* name, const std::string& value, const char* accepted) {
  if (holds) return;
  throw std::invalid_argument("ColdGasThruster: " + std::string(name) + " = " + value +
                              "; accepted: " + accepted);
}

void check(const ColdGasThrusterOptions& o) {
  const auto positive = [](const char* name, double value, const char* unit) {
    require(value > 0 && std::isfinite(value), name, to_text(value) + unit, "above 0");
  };
  const auto sigma = [](const char* name, double value, double largest, const char* accepted) {
    require(value >= 0 && value <= largest, name, to_text(value), accepted);
  };
  positive("force_N", o.force_N, " N");
  positive("isp_s", o.isp_s, " s");
  positive("maximum_impulse_Ns", o.maximum_impulse_Ns, " N s");
  if (o.commanded_mass_kg) positive("commanded_mass_kg", *o.commanded_mass_kg, " kg");
  sigma("propellant_kg", o.propellant_kg, 1e6, "0 to 1e6 kg");
  sigma("scale_sigma", o.scale_sigma, 0.1, "0 to 0.1");
  sigma("misalignment_sigma_deg", o.misalignment_sigma_deg, 10, "0 to 10 deg");
  sigma("shot_sigma", o.shot_sigma, 0.1, "0 to 0.1");
  require(o.gain >= 0.01 && o.gain <= 10, "gain", to_text(o.gain), "0.01 to 10");
  require(std::fabs(o.misalignment_deg) <= 30, "misalignment_deg", to_text(o.misalignment_deg),
          "-30 to 30 deg");
  require(o.on_time_quantum > 0ns, "on_time_quantum", to_string(o.on_time_quantum), "above 0 s");
  require(o.minimum_on_time > 0ns && o.minimum_on_time % o.on_time_quantum == 0ns,
          "minimum_on_time", to_string(o.minimum_on_time), "a multiple of on_time_quantum");
  require(o.opening_delay >= 0ns, "opening_delay", to_string(o.opening_delay), "0 s or more");
  require(o.closing_delay >= 0ns && o.closing_delay <= o.minimum_on_time, "closing_delay",
          to_string(o.closing_delay), "0 s to minimum_on_time");
  require(o.minimum_interval >= 0ns && o.minimum_interval <= weeks(52), "minimum_interval",
          to_string(o.minimum_interval), "0 s to 52 weeks");
  require(o.minimum_lead >= 0ns, "minimum_lead", to_string(o.minimum_lead), "0 s or more");
  require(o.maximum_lead >= o.minimum_lead && o.maximum_lead <= weeks(52), "maximum_lead",
          to_string(o.maximum_lead), "minimum_lead to 52 weeks");
}

}  // namespace

ColdGasThruster::ColdGasThruster(const Options& options)
    : options_(options), propellant_kg_(options.propellant_kg) {
  check(options);
}

std::string ColdGasThruster::nozzle_name(int nozzle) {
  static constexpr const char* kNames[kNozzles] = {"+X", "-X", "+Y", "-Y", "+Z", "-Z"};
  if (nozzle < 0 || nozzle >= kNozzles) {
    throw std::out_of_range("ColdGasThruster: nozzle " + std::to_string(nozzle) +
                            "; accepted: 0 to 5");
  }
  return kNames[nozzle];
}

ColdGasThruster::OnTimes ColdGasThruster::on_times(const Vec3& impulse_B_Ns,
                                                   const Options& options) {
  OnTimes times{};
  for (int axis = 0; axis < 3; ++axis) {
    const double along_Ns = impulse_B_Ns[axis];
    const int nozzle = 2 * axis + (along_Ns < 0 ? 1 : 0);
    times[static_cast<std::size_t>(nozzle)] =
        quantised(std::abs(along_Ns) / options.force_N, options);
  }
  return times;
}

void ColdGasThruster::start(DeviceContext& io) {
  if (!drawn_) {
    draw_errors(io);
    commanded_mass_kg_ = options_.commanded_mass_kg.value_or(io.truth().mass_kg);
    edge_ = io.now();
  }
  drawn_ = true;
  account(io);
  firings_.clear();
  commanded_s_ = {};
  bool was_open = false;
  for (Nozzle& nozzle : nozzles_) {
    was_open = was_open || nozzle.open;
    nozzle.thrust = {};
    nozzle.open = nozzle.held = false;
  }
  if (was_open) update_thrust(io);
}

void ColdGasThruster::draw_errors(DeviceContext& io) {
  for (Nozzle& nozzle : nozzles_) {
    nozzle.scale = io.random("scale").normal(1, options_.scale_sigma);
    for (double& tilt_rad : nozzle.tilt_rad) {
      tilt_rad = io.random("misalignment").normal(0, options_.misalignment_sigma_deg * kDegree);
    }
  }
}

void ColdGasThruster::from_flight(DeviceContext& io, Bytes bytes) {
  if (bytes.size() == ORRERY_THRUSTER_BYTES) return accept_delta_v(io, bytes);
  if (bytes.size() == ORRERY_THRUSTER_ON_TIME_BYTES) return accept_on_time(io, bytes);
  reject(io, std::to_string(bytes.size()) +
                 " bytes; accepted: " + std::to_string(ORRERY_THRUSTER_BYTES) + " (thruster) or " +
                 std::to_string(ORRERY_THRUSTER_ON_TIME_BYTES) + " (thruster_on_time)");
}

void ColdGasThruster::accept_delta_v(DeviceContext& io, Bytes message) {
  std::int64_t mid_burn_ns = 0;
  double dv[3];
  orrery_get_thruster(raw(message), &mid_burn_ns, dv);
  const Vec3 dv_ECI{dv[0], dv[1], dv[2]};
  const double impulse_Ns = commanded_mass_kg_ * norm(dv_ECI);
  const Duration longest = impulse_Ns <= largest_impulse_Ns(options_)  // written so that NaN fails
                               ? quantised(impulse_Ns / options_.force_N, options_)
                               : Duration::zero();
  if (longest == Duration::zero()) {
    const double least_Ns = 0.5 * options_.force_N * to_seconds(options_.minimum_on_time);
    return reject(io, "impulse of " + to_text(impulse_Ns) + " N s; accepted: " + to_text(least_Ns) +
                          " to " + to_text(options_.maximum_impulse_Ns));
  }
  if (!lead_is_good(io, mid_burn_ns)) return;
  Firing firing;
  firing.dv_ECI = dv_ECI;
  firing.begin_ns = mid_burn_ns - to_ns(longest) / 2;
  firing.end_ns = firing.begin_ns + to_ns(longest);
  if (!interval_is_good(io, firing)) return;
  firings_.push_back(std::make_unique<Firing>(firing));
  schedule(io, *firings_.back());
}

void ColdGasThruster::accept_on_time(DeviceContext& io, Bytes message) {
  std::int64_t start_ns = 0;
  unsigned nozzle = 0;
  double duration_s = 0;
  orrery_get_thruster_on_time(raw(message), &start_ns, &nozzle, &duration_s);
  if (nozzle >= static_cast<unsigned>(kNozzles)) {
    return reject(io, "nozzle " + std::to_string(nozzle) + "; accepted: 0 to 5");
  }
  const double longest_s = largest_impulse_Ns(options_) / options_.force_N;
  if (!(duration_s >= to_seconds(options_.minimum_on_time) && duration_s <= longest_s)) {
    return reject(io, "on-time of " + to_text(duration_s) +
                          " s; accepted: " + to_string(options_.minimum_on_time) + " to " +
                          to_text(options_.maximum_impulse_Ns / options_.force_N) + " s");
  }
  if (!lead_is_good(io, start_ns)) return;
  Firing firing;
  firing.on_times[nozzle] = quantised(duration_s, options_);
  firing.starts_ns[nozzle] = firing.begin_ns = start_ns;
  firing.end_ns = start_ns + to_ns(firing.on_times[nozzle]);
  if (Firing* pending = overlapping(firing)) {
    if (join(io, *pending, firing)) schedule(io, *pending);
    return;
  }
  if (!interval_is_good(io, firing)) return;
  firings_.push_back(std::make_unique<Firing>(firing));
  schedule(io, *firings_.back());
}

bool ColdGasThruster::lead_is_good(DeviceContext& io, std::int64_t epoch_ns) {
  // The epoch may be any number: it is compared before it is subtracted.
  const std::int64_t earliest_ns = io.onboard_ns() + to_ns(options_.minimum_lead);
  const std::int64_t latest_ns = io.onboard_ns() + to_ns(options_.maximum_lead);
  const bool good = epoch_ns >= earliest_ns && epoch_ns <= latest_ns;
  if (!good) {
    reject(io, "epoch " + std::to_string(epoch_ns) + " ns; accepted now: " +
                   std::to_string(earliest_ns) + " to " + std::to_string(latest_ns));
  }
  return good;
}

bool ColdGasThruster::interval_is_good(DeviceContext& io, const Firing& firing) {
  const std::int64_t apart_ns = to_ns(options_.minimum_interval);
  bool good = !last_end_ns_ || firing.begin_ns - *last_end_ns_ >= apart_ns;
  for (const auto& other : firings_) {
    good = good && (firing.begin_ns - other->end_ns >= apart_ns ||
                    other->begin_ns - firing.end_ns >= apart_ns);
  }
  if (!good) {
    reject(io, "less than " + to_string(options_.minimum_interval) + " from another firing");
  }
  return good;
}

ColdGasThruster::Firing* ColdGasThruster::overlapping(const Firing& firing) {
  for (const auto& other : firings_) {
    const bool apart = firing.begin_ns >= other->end_ns || other->begin_ns >= firing.end_ns;
    if (!apart && !other->dv_ECI && !other->prepared) return other.get();
  }
  return nullptr;
}

bool ColdGasThruster::join(DeviceContext& io, Firing& pending, const Firing& more) {
  Firing both = pending;
  for (std::size_t i = 0; i < kNozzles; ++i) {
    if (more.on_times[i] == Duration::zero()) continue;
    if (both.on_times[i] != Duration::zero()) {
      reject(io, "nozzle " + std::to_string(i) + " has an on-time in this firing already");
      return false;
    }
    both.on_times[i] = more.on_times[i];
    both.starts_ns[i] = more.starts_ns[i];
  }
  const double impulse_Ns = norm(impulse_B(both.on_times, options_.force_N));
  if (impulse_Ns > largest_impulse_Ns(options_)) {
    reject(io, "impulse of the firing would be " + to_text(impulse_Ns) + " N s; accepted: up to " +
                   to_text(options_.maximum_impulse_Ns));
    return false;
  }
  both.begin_ns = std::min(pending.begin_ns, more.begin_ns);
  both.end_ns = std::max(pending.end_ns, more.end_ns);
  pending = both;
  return true;
}

void ColdGasThruster::schedule(DeviceContext& io, Firing& firing) {
  (void)io.cancel(firing.preparation);
  const Duration ahead = io.truth_of_onboard(firing.begin_ns) - io.now();
  const Duration delay = std::max(Duration::zero(), ahead - options_.opening_delay - kPreparation);
  firing.preparation = io.after(delay, [this, &io, &firing] { prepare(io, firing); });
}

void ColdGasThruster::convert(DeviceContext& io, Firing& firing) {
  const std::int64_t middle_ns = firing.begin_ns + (firing.end_ns - firing.begin_ns) / 2;
  firing.middle = io.truth_of_onboard(middle_ns);
  const BodyAttitude now{io.R_BI(), io.omega_BI_B()};
  const Mat3 R_BI = turned(now, to_seconds(firing.middle - io.now()));
  if (!firing.dv_ECI) {
    const Vec3 dv_B = impulse_B(firing.on_times, options_.force_N) / commanded_mass_kg_;
    firing.dv_ECI = transpose(R_BI) * dv_B;
    return;
  }
  firing.on_times = on_times(commanded_mass_kg_ * (R_BI * *firing.dv_ECI), options_);
  for (std::size_t i = 0; i < kNozzles; ++i) {
    firing.starts_ns[i] = middle_ns - to_ns(firing.on_times[i]) / 2;
  }
}

void ColdGasThruster::prepare(DeviceContext& io, Firing& firing) {
  firing.prepared = true;
  convert(io, firing);
  std::array<Duration, kNozzles> delays{};
  Duration total{};
  for (std::size_t i = 0; i < kNozzles; ++i) {
    if (firing.on_times[i] == Duration::zero()) continue;
    total += firing.on_times[i];
    delays[i] = io.truth_of_onboard(firing.starts_ns[i]) - options_.opening_delay - io.now();
    if (delays[i] < Duration::zero()) {
      reject(io, "the onboard clock has stepped over the burn");
      return drop(firing);
    }
  }
  if (total == Duration::zero()) {
    reject(io, "no nozzle reaches its minimum impulse");
    return drop(firing);
  }
  firing.lost = io.fault("lost", 0.0) != 0.0;
  commanded_mass_kg_ -=
      options_.force_N * to_seconds(total) / (kStandardGravity_mps2 * options_.isp_s);
  for (int i = 0; i < kNozzles; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (firing.on_times[k] == Duration::zero()) continue;
    ++firing.shots_open;
    io.after(delays[k], [this, &io, &firing, i] { open_valve(io, firing, i); });
  }
}

void ColdGasThruster::open_valve(DeviceContext& io, Firing& firing, int nozzle) {
  const auto k = static_cast<std::size_t>(nozzle);
  // Always drawn, so that a fault changes no other shot.
  const double shot_factor = io.random("shot").normal(1, options_.shot_sigma);
  const bool stuck_closed = fault(io, nozzle, "stuck_closed", 0) != 0;
  account(io);
  nozzles_[k].delivered_Ns = 0;
  nozzles_[k].delivered_B = {};
  const Duration on_time = firing.on_times[k];
  const SimTime begin = io.now() + options_.opening_delay;
  Shot& shot = firing.shots[k];
  shot = {.nozzle = nozzle,
          .on_time = on_time,
          .valve_opens = io.now(),
          .thrust_begins = begin,
          .valve_closes = begin + on_time - options_.closing_delay,
          .thrust_ends = begin + on_time};
  if (!stuck_closed && !firing.lost && !nozzles_[k].open) {
    io.after(options_.opening_delay,
             [this, &io, nozzle, shot_factor] { begin_thrust(io, nozzle, shot_factor); });
  }
  io.after(shot.valve_closes - io.now(),
           [this, &io, nozzle, on_time] { close_valve(io, nozzle, on_time); });
  io.after(shot.thrust_ends - io.now(),
           [this, &io, &firing, nozzle] { end_shot(io, firing, nozzle); });
}

void ColdGasThruster::begin_thrust(DeviceContext& io, int nozzle, double shot_factor) {
  Nozzle& n = nozzles_[static_cast<std::size_t>(nozzle)];
  account(io);
  n.open = true;
  n.thrust = thrust_of(io, nozzle, shot_factor);
  update_thrust(io);
}

Thrust ColdGasThruster::thrust_of(DeviceContext& io, int nozzle, double shot_factor) const {
  const Nozzle& n = nozzles_[static_cast<std::size_t>(nozzle)];
  const double weak = fault(io, nozzle, "weak", 1);
  const double more_deg = options_.misalignment_deg + fault(io, nozzle, "misaligned", 0);
  const double tilt_rad = n.tilt_rad[0] + more_deg * kDegree;
  const Axes axes = axes_of(nozzle);
  // A tilt about one transverse axis moves the direction along the other.
  const Vec3 direction_B = unit(axes.along + std::tan(tilt_rad) * axes.second_transverse +
                                std::tan(n.tilt_rad[1]) * axes.first_transverse);
  return Thrust::body_fixed(
      options_.force_N * options_.gain * n.scale * shot_factor * weak * direction_B,
      options_.isp_s);
}

double ColdGasThruster::fault(DeviceContext& io, int nozzle, const char* name,
                              double nominal) const {
  const double of_all = io.fault(name, nominal);
  return io.fault(nozzle_name(nozzle) + "/" + name, of_all);
}

void ColdGasThruster::close_valve(DeviceContext& io, int nozzle, Duration on_time) {
  Nozzle& n = nozzles_[static_cast<std::size_t>(nozzle)];
  commanded_s_[static_cast<std::size_t>(nozzle)] += to_seconds(on_time);
  if (n.held || !n.open || fault(io, nozzle, "stuck_open", 0) == 0) return;
  n.held = true;
  io.after(kStuckCheck, [this, &io, nozzle] { while_stuck(io, nozzle); });
}

void ColdGasThruster::while_stuck(DeviceContext& io, int nozzle) {
  if (fault(io, nozzle, "stuck_open", 0) != 0) {
    io.after(kStuckCheck, [this, &io, nozzle] { while_stuck(io, nozzle); });
    return;
  }
  io.after(options_.closing_delay, [this, &io, nozzle] {
    nozzles_[static_cast<std::size_t>(nozzle)].held = false;
    end_thrust(io, nozzle);
  });
}

void ColdGasThruster::end_thrust(DeviceContext& io, int nozzle) {
  Nozzle& n = nozzles_[static_cast<std::size_t>(nozzle)];
  account(io);
  if (!n.open || n.held) return;
  n.open = false;
  n.thrust = {};
  update_thrust(io);
}

void ColdGasThruster::end_shot(DeviceContext& io, Firing& firing, int nozzle) {
  const auto k = static_cast<std::size_t>(nozzle);
  end_thrust(io, nozzle);
  firing.shots[k].impulse_Ns = nozzles_[k].delivered_Ns;
  firing.impulse_B += nozzles_[k].delivered_B;
  shot_log_.push_back(firing.shots[k]);
  io.record(nozzle_name(nozzle) + "/impulse_Ns", nozzles_[k].delivered_Ns);
  if (--firing.shots_open == 0) finish(io, firing);
}

void ColdGasThruster::finish(DeviceContext& io, Firing& firing) {
  const double delivered_Ns = norm(firing.impulse_B);
  log_burn({firing.middle, *firing.dv_ECI, delivered_Ns > 0});
  io.record("dv_mps", delivered_Ns / io.truth().mass_kg);
  io.record("propellant_kg", propellant_kg_);
  last_end_ns_ = std::max(last_end_ns_.value_or(firing.end_ns), firing.end_ns);
  drop(firing);
}

void ColdGasThruster::drop(const Firing& firing) {
  std::erase_if(firings_, [&firing](const auto& one) { return one.get() == &firing; });
}

// What the nozzles have let out since the last edge.
void ColdGasThruster::account(DeviceContext& io) {
  const double span_s = to_seconds(io.now() - edge_);
  edge_ = io.now();
  if (flow_kgps_ == 0) return;
  propellant_kg_ = std::max(0.0, propellant_kg_ - flow_kgps_ * span_s);
  for (Nozzle& nozzle : nozzles_) {
    nozzle.delivered_Ns += span_s * nozzle.thrust.nozzle_N;
    nozzle.delivered_B += span_s * nozzle.thrust.force_B;
  }
}

void ColdGasThruster::update_thrust(DeviceContext& io) {
  constexpr double kLong_s = 1e9;
  Thrust sum;
  if (propellant_kg_ > 0) {
    for (const Nozzle& nozzle : nozzles_) sum = sum + nozzle.thrust;
  }
  flow_kgps_ = sum.mass_flow_kgps;
  (void)io.cancel(empty_);
  if (flow_kgps_ > 0) {
    empty_ = io.after(from_seconds(std::min(kLong_s, propellant_kg_ / flow_kgps_)), [this, &io] {
      account(io);
      propellant_kg_ = 0;
      update_thrust(io);
    });
  }
  io.set_thrust(sum);
}

}  // namespace orrery
