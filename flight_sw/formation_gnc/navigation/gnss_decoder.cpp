#include "formation_gnc/navigation/gnss_decoder.hpp"

#include <cmath>

namespace formation_gnc {
namespace {

constexpr std::uint32_t kGps = 0, kL1Ca = 0;

bool is_usable(const novatel_observation& o) {
  return o.prn >= 1 && o.prn <= 32 && NOVATEL_SYSTEM(o.tracking_status) == kGps &&
         NOVATEL_SIGNAL(o.tracking_status) == kL1Ca &&
         (o.tracking_status & NOVATEL_PHASE_LOCKED) != 0 &&
         (o.tracking_status & NOVATEL_CODE_LOCKED) != 0;
}

Observation to_observation(const novatel_observation& o, bool compressed) {
  Observation out;
  out.prn = static_cast<std::uint8_t>(o.prn);
  out.code_m = o.pseudorange_m;
  out.phase_cycles =
      compressed ? novatel_restored_phase_cycles(&o, kWavelength_m) : o.carrier_phase_cycles;
  out.cn0_dBHz = o.cn0_dBHz;
  out.lock_s = o.lock_time_s;
  out.half_cycle = (o.tracking_status & NOVATEL_PARITY_KNOWN) == 0;
  return out;
}

// Keeps the strongest.
void add(GnssEpoch* epoch, const Observation& o) {
  if (epoch->count < kChannels) {
    epoch->observation[epoch->count++] = o;
    return;
  }
  int weakest = 0;
  for (int k = 1; k < kChannels; ++k) {
    if (epoch->observation[k].cn0_dBHz < epoch->observation[weakest].cn0_dBHz) weakest = k;
  }
  if (o.cn0_dBHz > epoch->observation[weakest].cn0_dBHz) epoch->observation[weakest] = o;
}

void take_range(const novatel_frame& frame, GnssEpoch* epoch) {
  const bool compressed = frame.header.message_id == NOVATEL_RANGECMP;
  const std::uint32_t count = novatel_count(&frame);
  epoch->count = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    novatel_observation o;
    const int there =
        compressed ? novatel_get_rangecmp(&frame, k, &o) : novatel_get_range(&frame, k, &o);
    if (there == 0 || !is_usable(o)) continue;
    const Observation observation = to_observation(o, compressed);
    if (is_plausible(observation)) add(epoch, observation);
  }
}

void take_fix(const novatel_frame& frame, GnssEpoch* epoch) {
  novatel_bestxyz log;
  if (novatel_get_bestxyz(&frame, &log) == 0) return;
  epoch->has_fix = log.position_status == NOVATEL_SOL_COMPUTED && log.position_type != 0 &&
                   log.velocity_status == NOVATEL_SOL_COMPUTED && log.velocity_type != 0;
  if (!epoch->has_fix) return;
  float r2 = 0.0f, v2 = 0.0f;
  for (int k = 0; k < 3; ++k) {
    epoch->r_ECEF[k] = log.r_ECEF[k];
    epoch->v_ECEF[k] = log.v_ECEF[k];
    r2 += log.sigma_r_ECEF[k] * log.sigma_r_ECEF[k];
    v2 += log.sigma_v_ECEF[k] * log.sigma_v_ECEF[k];
  }
  epoch->sigma_r_m = std::sqrt(r2 / 3.0f);
  epoch->sigma_v_mps = std::sqrt(v2 / 3.0f);
  GnssEpoch without = *epoch;
  without.has_fix = false;
  if (!is_plausible(*epoch) && is_plausible(without)) epoch->has_fix = false;
}

}  // namespace

GnssDecoder::GnssDecoder() {
  novatel_framer_init(&framer_, room_, sizeof room_);
}

void GnssDecoder::write(const unsigned char* bytes, std::size_t count) {
  const std::size_t taken = novatel_framer_write(&framer_, bytes, count);
  bytes_dropped_ += static_cast<std::uint32_t>(count - taken);
}

GnssDecoder::What GnssDecoder::next() {
  novatel_frame frame;
  if (held_back_) {
    held_back_ = false;
    waiting_ = held_;
    has_range_ = held_has_range_;
    has_fix_log_ = !held_has_range_;
    if (is_complete()) return give();
  }
  while (novatel_framer_next(&framer_, &frame) != 0) {
    if (novatel_is_response(&frame) != 0) continue;
    if (read_ephemeris(frame, &ephemeris_)) return kEphemeris;
    if (take(frame)) return kEpoch;
  }
  return kNothing;
}

bool GnssDecoder::is_complete() const {
  return has_range_ && has_fix_log_;
}

GnssDecoder::What GnssDecoder::give() {
  given_ = waiting_;
  waiting_ = GnssEpoch();
  has_range_ = has_fix_log_ = false;
  return kEpoch;
}

// True: an epoch is complete, and given.
bool GnssDecoder::take(const novatel_frame& frame) {
  const std::uint16_t id = frame.header.message_id;
  const bool range = id == NOVATEL_RANGE || id == NOVATEL_RANGECMP;
  if (!range && id != NOVATEL_BESTXYZ) return false;
  const std::int64_t t_ns = novatel_time_ns(&frame);
  if (t_ns <= 0) return false;
  const bool other_epoch = (has_range_ || has_fix_log_) && t_ns != waiting_.t_ns;
  GnssEpoch* epoch = other_epoch ? &held_ : &waiting_;
  if (other_epoch) held_ = GnssEpoch();
  epoch->t_ns = t_ns;
  if (range) {
    take_range(frame, epoch);
  } else {
    take_fix(frame, epoch);
  }
  if (other_epoch) {
    held_back_ = true;
    held_has_range_ = range;
    give();
    return true;
  }
  (range ? has_range_ : has_fix_log_) = true;
  if (!is_complete()) return false;
  give();
  return true;
}

bool GnssDecoder::flush() {
  if (!has_range_ && !has_fix_log_) return false;
  give();
  return true;
}

}  // namespace formation_gnc
