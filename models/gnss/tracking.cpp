#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/gnss/tracking.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

using gps::kL1Wavelength_m;
using gps::kL2Wavelength_m;
using gps::kSpeedOfLight_mps;

constexpr Duration kShortLoss = 60s;  // after which a satellite is searched for anew

void check(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw std::invalid_argument("GnssTracker: " + std::string(name) + " = " + to_text(value) +
                              "; accepted: " + to_text(low) + " to " + to_text(high));
}

void check_delay(const char* name, const DelayRange& range) {
  check(name, range.from_s, 0, 3600);
  check(name, range.to_s, range.from_s, 3600);
}

void check_options(const GnssTrackingOptions& o) {
  check("channels", o.channels, 1, o.l2 ? 16 : 24);
  check("hysteresis_dB", o.hysteresis_dB, 0, 24);
  check_delay("acquire", o.acquire);
  check_delay("reacquire", o.reacquire);
  check_delay("cold_acquire", o.cold_acquire);
  check("parity_delay", to_seconds(o.parity_delay), 0, 60);
  check("lose_lock_below_dBHz", o.lose_lock_below_dBHz, 0, 60);
  check("relock_hysteresis_dB", o.relock_hysteresis_dB, 0, 24);
  check("l2_loss_dB", o.l2_loss_dB, 0, 20);
  check("doppler_per_phase", o.doppler_per_phase, 0, 1000);
  check("vertical_tecu", o.vertical_tecu, 0, 1000);
  check("code_multipath_m", o.code_multipath_m, 0, 100);
  check("phase_multipath_m", o.phase_multipath_m, 0, 0.1);
  check("multipath_time_s", o.multipath_time_s, 1, 1e5);
  check("ambiguity_limit", static_cast<double>(o.ambiguity_limit), 0, 1e9);
  check("slips_per_s", o.slips_per_s, 0, 1);
  check("slips_below_dBHz", o.slips_below_dBHz, 0, 100);
}

double uniform(RandomStream& stream, const DelayRange& range) {
  return stream.uniform(range.from_s, range.to_s);
}

std::string label(int prn, const char* what) {
  return (prn < 10 ? "G0" : "G") + std::to_string(prn) + " " + what;
}

}  // namespace

/// What all channels share at one epoch.
struct GnssTracker::Epoch {
  const GpsSnapshot& gps;
  const GpsConstellation& constellation;
  const AntennaPlace& antenna;
  const Vec3& r_sun_ECEF;
  double bias_s, drift_sps, dt_s;
};

GnssTracker::GnssTracker(const GnssTrackingOptions& options, const AntennaPattern& pattern,
                         const Streams& streams)
    : options_((check_options(options), options)),
      sight_(options.sight),
      cn0_(pattern, options.cn0_law) {
  for (int prn = 1; prn <= gps::kSatellites; ++prn) {
    Satellite& s = satellite(prn);
    s.noise = &streams(label(prn, "noise"));
    s.arc = &streams(label(prn, "arc"));
    if (options.l2) s.l2_noise = &streams(label(prn, "L2 noise"));
    if (options.code_multipath_m > 0 || options.phase_multipath_m > 0) {
      s.multipath = &streams(label(prn, "multipath"));
    }
  }
  candidates_.reserve(gps::kSatellites);
  channels_.reserve(static_cast<std::size_t>(options.channels));
  const auto most = static_cast<std::size_t>(2 * options.channels);
  observations_.reserve(most);
  noise_streams_.reserve(most);
  normals_.resize(most, {0, 0, 0});
}

void GnssTracker::start(GnssStart how) {
  channels_.clear();
  observations_.clear();
  for (Satellite& s : satellites_) s.lost_before = false;
  first_ = true;
  tracking_start_ = how == GnssStart::kTracking;
  cold_ = how == GnssStart::kCold;
}

void GnssTracker::epoch(const GpsSnapshot& gps, const GpsConstellation& constellation,
                        const AntennaPlace& antenna, const Vec3& r_sun_ECEF, double bias_s,
                        double drift_sps, const Faults& faults) {
  const Epoch e{gps,
                constellation,
                antenna,
                r_sun_ECEF,
                bias_s,
                drift_sps,
                first_ ? 0 : to_seconds(antenna.t - last_)};
  find_candidates(gps, antenna, faults.blocked);
  drop_channels(antenna.t);
  take_channels(antenna.t);
  for (GnssChannel& channel : channels_) {
    channel.reported = false;
    if (!channel.locked && channel.acquired <= antenna.t) lock(channel);
  }
  draw_noise();
  observations_.clear();
  std::size_t place = 0;
  for (GnssChannel& channel : channels_) {
    if (!channel.locked) continue;
    const auto index = static_cast<std::size_t>(channel.prn - 1);
    if ((faults.slipped >> index & 1u) != 0) slip(channel, faults.cycles[index], antenna.t);
    slip_by_itself(channel, antenna.t, e.dt_s);
    settle_parity(channel, antenna.t);
    measure(channel, e, place++);
  }
  first_ = false;
  last_ = antenna.t;
}

void GnssTracker::find_candidates(const GpsSnapshot& gps, const AntennaPlace& antenna,
                                  std::uint32_t blocked) {
  candidates_.clear();
  in_sight_ = 0;
  const double radius_m = norm(antenna.r_ECEF);
  std::uint32_t followed = 0;
  for (const GnssChannel& channel : channels_) followed |= 1u << (channel.prn - 1);
  const std::uint32_t held = first_ && tracking_start_ ? ~0u : followed;
  for (int prn = 1; prn <= gps::kSatellites; ++prn) {
    const std::uint32_t bit = 1u << (prn - 1);
    if ((gps.transmitting & ~blocked & bit) == 0) continue;
    const Sight sight = sight_(antenna, radius_m, gps[prn].r_ECEF);
    if (!sight.clear) continue;
    const double cn0 = cn0_.at_cosine(sight.cos_off_boresight);
    in_sight_ |= bit;
    const double margin = (held & bit) != 0 ? 0 : options_.relock_hysteresis_dB;
    if (options_.lose_lock_below_dBHz > 0 && cn0 < options_.lose_lock_below_dBHz + margin) continue;
    const double bonus = (followed & bit) != 0 ? options_.hysteresis_dB : 0;
    candidates_.push_back({prn, cn0 + bonus, sight, cn0});
  }
  chosen_ = std::min(candidates_.size(), static_cast<std::size_t>(options_.channels));
  if (chosen_ < candidates_.size()) {
    // Equal ranks in order of PRN, so that the choice is defined.
    std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
      return a.rank_dBHz != b.rank_dBHz ? a.rank_dBHz > b.rank_dBHz : a.prn < b.prn;
    });
  }
  chosen_of_.fill(nullptr);
  for (std::size_t i = 0; i < chosen_; ++i) {
    chosen_of_[static_cast<std::size_t>(candidates_[i].prn - 1)] = &candidates_[i];
  }
}

const GnssTracker::Candidate* GnssTracker::candidate(int prn) const {
  return chosen_of_[static_cast<std::size_t>(prn - 1)];
}

void GnssTracker::drop_channels(SimTime t) {
  std::size_t kept = 0;
  for (const GnssChannel& channel : channels_) {
    if (candidate(channel.prn) != nullptr) {
      channels_[kept++] = channel;
    } else if (channel.locked) {
      satellite(channel.prn).lost_before = true;
      satellite(channel.prn).lost = t;
    }
  }
  channels_.resize(kept);
}

void GnssTracker::take_channels(SimTime t) {
  for (std::size_t i = 0; i < chosen_; ++i) {
    const Candidate& c = candidates_[i];
    const auto same = [&c](const GnssChannel& channel) { return channel.prn == c.prn; };
    auto channel = std::find_if(channels_.begin(), channels_.end(), same);
    if (channel == channels_.end()) {
      // The lowest free number; the list is in order of numbers.
      auto at = channels_.begin();
      int number = 0;
      while (at != channels_.end() && at->number == number) ++at, ++number;
      GnssChannel fresh;
      fresh.prn = c.prn;
      fresh.number = number;
      acquire(fresh, t);
      channel = channels_.insert(at, fresh);
    }
    channel->cn0_dBHz = c.cn0_dBHz;
    channel->sin_elevation = c.sight.sin_elevation;
    channel->cos_off_boresight = c.sight.cos_off_boresight;
  }
}

void GnssTracker::acquire(GnssChannel& channel, SimTime t) {
  Satellite& s = satellite(channel.prn);
  if (first_ && tracking_start_) {
    channel.acquired = t;
    return;
  }
  const bool again = s.lost_before && t - s.lost <= kShortLoss;
  const DelayRange& delay = cold_   ? options_.cold_acquire
                            : again ? options_.reacquire
                                    : options_.acquire;
  channel.acquired = t + from_seconds(uniform(*s.arc, delay));
}

void GnssTracker::lock(GnssChannel& channel) {
  Satellite& s = satellite(channel.prn);
  channel.locked = true;
  s.lock_start = channel.acquired;
  const bool known = first_ && tracking_start_;
  s.parity_known = known ? channel.acquired : channel.acquired + options_.parity_delay;
  channel.ambiguity_cycles =
      static_cast<double>(s.arc->integer(-options_.ambiguity_limit, options_.ambiguity_limit));
  if (options_.l2) {
    channel.l2_ambiguity_cycles =
        static_cast<double>(s.arc->integer(-options_.ambiguity_limit, options_.ambiguity_limit));
  }
  const bool half = s.arc->bernoulli(0.5);
  s.half_cycle = half && !known;
  s.half_cycle_added = false;
  if (s.half_cycle) channel.ambiguity_cycles += 0.5;
  channel.wind_up_cycles = 0;
  s.code_multipath_m = s.phase_multipath_m = 0;
  if (s.multipath != nullptr) {
    s.code_multipath_m = s.multipath->normal(0, options_.code_multipath_m);
    s.phase_multipath_m = s.multipath->normal(0, options_.phase_multipath_m);
  }
}

void GnssTracker::slip(GnssChannel& channel, double cycles, SimTime t) {
  Satellite& s = satellite(channel.prn);
  const double whole = std::trunc(cycles);
  channel.ambiguity_cycles += whole;
  channel.l2_ambiguity_cycles += whole;
  s.lock_start = t;  // the receiver notices, as a real one does
  if (cycles == whole) return;
  channel.ambiguity_cycles += cycles - whole;
  s.half_cycle = !s.half_cycle;
  s.parity_known = t + options_.parity_delay;
}

void GnssTracker::slip_by_itself(GnssChannel& channel, SimTime t, double dt_s) {
  if (!(options_.slips_per_s > 0)) return;
  RandomStream& stream = *satellite(channel.prn).arc;
  const bool slips = stream.bernoulli(-std::expm1(-options_.slips_per_s * dt_s));
  if (!slips || channel.cn0_dBHz >= options_.slips_below_dBHz) return;
  const double size = static_cast<double>(stream.integer(1, 10));
  slip(channel, stream.bernoulli(0.5) ? size : -size, t);
}

/// The receiver learns the sign of the bits and takes half a cycle out of its phase.
void GnssTracker::settle_parity(GnssChannel& channel, SimTime t) {
  Satellite& s = satellite(channel.prn);
  if (!s.half_cycle || t < s.parity_known) return;
  s.half_cycle = false;
  s.half_cycle_added = true;
  channel.ambiguity_cycles = std::floor(channel.ambiguity_cycles);
}

void GnssTracker::wander(GnssChannel& channel, double dt_s) {
  Satellite& s = satellite(channel.prn);
  if (s.multipath == nullptr || !(dt_s > 0)) return;
  const double keep = std::exp(-dt_s / options_.multipath_time_s);
  const double add = std::sqrt(1 - keep * keep);
  s.code_multipath_m =
      keep * s.code_multipath_m + add * s.multipath->normal(0, options_.code_multipath_m);
  s.phase_multipath_m =
      keep * s.phase_multipath_m + add * s.multipath->normal(0, options_.phase_multipath_m);
}

/// All of an epoch at once, which is faster than one after another.
void GnssTracker::draw_noise() {
  if (!options_.noise) return;
  noise_streams_.clear();
  for (const GnssChannel& channel : channels_) {
    if (channel.locked) noise_streams_.push_back(satellite(channel.prn).noise);
  }
  for (const GnssChannel& channel : channels_) {
    if (channel.locked && options_.l2) noise_streams_.push_back(satellite(channel.prn).l2_noise);
  }
  normal_triples(noise_streams_, normals_);
}

void GnssTracker::measure(GnssChannel& channel, const Epoch& e, std::size_t place) {
  const Candidate& c = *candidate(channel.prn);
  const SatelliteState& truth = e.gps[channel.prn];
  // The receiver's clock shows the tag when GPS time is the tag less the bias.
  const ReceivedSignal signal = receive(truth, e.antenna, c.sight, -e.bias_s);
  if (options_.wind_up) {
    const double w = wind_up_cycles(truth.r_ECEF, e.r_sun_ECEF, e.antenna);
    channel.wind_up_cycles = w + std::round(channel.wind_up_cycles - w);
  }
  wander(channel, e.dt_s);
  append(channel, e, signal, normals_[place], false);
  if (options_.l2) append(channel, e, signal, normals_[noise_streams_.size() / 2 + place], true);
}

void GnssTracker::append(GnssChannel& channel, const Epoch& e, const ReceivedSignal& signal,
                         const std::array<double, 3>& normals, bool l2) {
  Satellite& s = satellite(channel.prn);
  const double wavelength_m = l2 ? kL2Wavelength_m : kL1Wavelength_m;
  const double scale = l2 ? gps::kGamma : 1;
  const double cn0 = channel.cn0_dBHz - (l2 ? options_.l2_loss_dB : 0);
  const auto [sigma_code_m, sigma_phase_m] = tracking_noise(cn0, wavelength_m);
  const double code_noise_m = sigma_code_m * normals[0] + s.code_multipath_m;
  const double phase_noise_m = sigma_phase_m * normals[1] + s.phase_multipath_m;
  const double rate_noise_mps = options_.doppler_per_phase * sigma_phase_m * normals[2];
  if (!l2) channel.code_noise_m = code_noise_m, channel.phase_noise_m = phase_noise_m;

  const bool parity_known = e.antenna.t >= s.parity_known;
  // A slip by half a cycle does not interrupt what is sent; only an arc's beginning waits.
  const bool slipped = s.parity_known > channel.acquired + options_.parity_delay;
  if (!parity_known && !slipped && !options_.report_unknown_parity) return;
  channel.reported = true;

  const double clock_m = kSpeedOfLight_mps * (e.bias_s - signal.satellite_clock_s +
                                              scale * e.constellation.group_delay_s(channel.prn));
  const double iono_m = scale * ionosphere_L1_m(options_.vertical_tecu, channel.sin_elevation);
  const double N = l2 ? channel.l2_ambiguity_cycles : channel.ambiguity_cycles;
  // By the receiver's own time, which runs faster than GPS time by the drift.
  const double dt_rx = 1 - e.drift_sps;
  const double rate_mps =
      signal.range_rate_mps * dt_rx +
      kSpeedOfLight_mps *
          (e.drift_sps - signal.satellite_clock_rate_sps *
                             (1 - signal.range_rate_mps / kSpeedOfLight_mps) * dt_rx);
  novatel::RangeObservation o;
  o.prn = static_cast<std::uint16_t>(channel.prn);
  o.pseudorange_m = signal.range_m + clock_m + iono_m + code_noise_m;
  o.pseudorange_sigma_m = static_cast<float>(sigma_code_m);
  o.carrier_phase_cycles = (signal.range_m + clock_m - iono_m + phase_noise_m) / wavelength_m + N +
                           channel.wind_up_cycles;
  o.carrier_phase_sigma_cycles = static_cast<float>(sigma_phase_m / wavelength_m);
  o.doppler_Hz = static_cast<float>(-(rate_mps + rate_noise_mps) / wavelength_m);
  o.cn0_dBHz = static_cast<float>(cn0);
  o.lock_time_s = static_cast<float>(to_seconds(e.antenna.t - s.lock_start));
  novatel::ChannelStatus status;
  status.channel = static_cast<std::uint8_t>(channel.number + (l2 ? options_.channels : 0));
  status.parity_known = parity_known;
  status.half_cycle_added = !l2 && s.half_cycle_added;
  status.grouped = options_.l2;
  status.primary_L1 = !l2;
  if (l2) status.signal = novatel::GpsSignal::kL2PY;
  o.tracking_status = novatel::to_word(status);
  observations_.push_back(o);
}

}  // namespace orrery
