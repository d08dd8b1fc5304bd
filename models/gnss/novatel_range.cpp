#include <orrery/models/gnss/novatel_frame.hpp>
#include <orrery/models/gnss/novatel_messages.hpp>

#include <algorithm>
#include <cmath>

namespace orrery::novatel {

namespace {

constexpr std::size_t kRangeBytes = 44;
constexpr std::size_t kRangeCmpBytes = 24;

// Manual, RANGECMP, note on StdDev-PSR [m].
constexpr std::array<float, 16> kPseudorangeSigma_m = {
    0.050f, 0.075f, 0.113f, 0.169f, 0.253f, 0.380f, 0.570f, 0.854f,
    1.281f, 2.375f, 4.75f,  9.5f,   19.0f,  38.0f,  76.0f,  152.0f};

void put_range(const RangeObservation& o, Writer& w) {
  w.u16(o.prn);
  w.u16(o.glonass_frequency);
  w.f64(o.pseudorange_m);
  w.f32(o.pseudorange_sigma_m);
  w.f64(-o.carrier_phase_cycles);
  w.f32(o.carrier_phase_sigma_cycles);
  w.f32(o.doppler_Hz);
  w.f32(o.cn0_dBHz);
  w.f32(o.lock_time_s);
  w.u32(o.tracking_status);
}

// The nearest integer within [low, high]; NaN gives `low`.
std::int64_t rounded(double value, double low, double high) {
  if (!(value > low)) return static_cast<std::int64_t>(low);
  return value >= high ? static_cast<std::int64_t>(high) : std::llround(value);
}

// The largest table value that is not above sigma, as the receivers of the reference logs do it.
std::uint32_t pseudorange_sigma_index(float sigma_m) {
  const auto above =
      std::upper_bound(kPseudorangeSigma_m.begin() + 1, kPseudorangeSigma_m.end(), sigma_m);
  return static_cast<std::uint32_t>(above - kPseudorangeSigma_m.begin() - 1);
}

// 32 bits of 1/256 cycle: a multiple of 2^24 cycles, hence of the 2^23 that a reader restores,
// falls away. Beyond 2^53 nothing but a defect is left of a phase: 0.
std::uint32_t rolled_phase(double adr_cycles) {
  constexpr double kLargest = 9007199254740992.0;
  const double scaled = adr_cycles * 256;
  if (!(std::abs(scaled) < kLargest)) return 0;
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(std::llround(scaled)));
}

void put_rangecmp(const RangeObservation& o, Writer& w) {
  constexpr double kDopplerEnd = 134217727;        // 28 bits, signed
  constexpr double kPseudorangeEnd = 68719476735;  // 36 bits
  const auto doppler = static_cast<std::uint32_t>(
      rounded(256.0 * static_cast<double>(o.doppler_Hz), -kDopplerEnd - 1, kDopplerEnd));
  const auto range = static_cast<std::uint64_t>(rounded(128 * o.pseudorange_m, 0, kPseudorangeEnd));
  const auto phase_sigma = static_cast<std::uint32_t>(
      rounded(512.0 * static_cast<double>(o.carrier_phase_sigma_cycles) - 1, 0, 15));
  const auto lock =
      static_cast<std::uint32_t>(rounded(32.0 * static_cast<double>(o.lock_time_s), 0, 0x1FFFFF));
  const auto cn0 = static_cast<std::uint32_t>(rounded(static_cast<double>(o.cn0_dBHz) - 20, 0, 31));
  w.u32(o.tracking_status);
  w.u32((doppler & 0x0FFFFFFFu) | static_cast<std::uint32_t>(range << 28));
  w.u32(static_cast<std::uint32_t>(range >> 4));
  w.u32(rolled_phase(-o.carrier_phase_cycles));
  w.u8(
      static_cast<std::uint8_t>(pseudorange_sigma_index(o.pseudorange_sigma_m) | phase_sigma << 4));
  w.u8(static_cast<std::uint8_t>(o.prn));
  w.u32(lock | cn0 << 21 | (o.glonass_frequency & 63u) << 26);
  w.u16(0);  // reserved
}

}  // namespace

void append_range(const Header& header, std::span<const RangeObservation> observations,
                  ByteBuffer& out) {
  append_array(header, kRangeId, observations, kRangeBytes, put_range, out);
}

void append_rangecmp(const Header& header, std::span<const RangeObservation> observations,
                     ByteBuffer& out) {
  append_array(header, kRangeCmpId, observations, kRangeCmpBytes, put_rangecmp, out);
}

}  // namespace orrery::novatel
