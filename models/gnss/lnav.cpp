#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/gnss/lnav.hpp>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace orrery::lnav {

namespace {

constexpr int kSecondsPerWeek = 604800;
constexpr int kWeeksPerRollover = 1024;
constexpr std::uint32_t kPreamble = 0x8B;

[[noreturn]] void refuse(const char* function, int prn, const std::string& what) {
  throw std::invalid_argument(std::string("lnav::") + function + ": PRN " + std::to_string(prn) +
                              ": " + what);
}

/// A field's number of bits and the weight of its last one, 2^exponent; Tables 20-I and 20-III.
struct Field {
  const char* name;
  int bits;
  int exponent;
  bool is_signed;
  double unit = 1;  // in SI: kGpsPi for semicircles
};

constexpr Field kTgd{"tgd_s", 8, -31, true};
constexpr Field kToc{"toc_s", 16, 4, false};
constexpr Field kAf2{"af2_sps2", 8, -55, true};
constexpr Field kAf1{"af1_sps", 16, -43, true};
constexpr Field kAf0{"af0_s", 22, -31, true};
constexpr Field kCrs{"crs_m", 16, -5, true};
constexpr Field kDeltaN{"delta_n_radps", 16, -43, true, kGpsPi};
constexpr Field kM0{"mean_anomaly_rad", 32, -31, true, kGpsPi};
constexpr Field kCuc{"cuc_rad", 16, -29, true};
constexpr Field kEccentricity{"eccentricity", 32, -33, false};
constexpr Field kCus{"cus_rad", 16, -29, true};
constexpr Field kSqrtA{"sqrt_a_sqrtm", 32, -19, false};
constexpr Field kToe{"toe_s", 16, 4, false};
constexpr Field kCic{"cic_rad", 16, -29, true};
constexpr Field kRaan0{"raan0_rad", 32, -31, true, kGpsPi};
constexpr Field kCis{"cis_rad", 16, -29, true};
constexpr Field kI0{"i0_rad", 32, -31, true, kGpsPi};
constexpr Field kCrc{"crc_m", 16, -5, true};
constexpr Field kPerigee{"argument_of_perigee_rad", 32, -31, true, kGpsPi};
constexpr Field kRaanRate{"raan_rate_radps", 24, -43, true, kGpsPi};
constexpr Field kIRate{"i_rate_radps", 14, -43, true, kGpsPi};

double steps_of(const Field& field, double value) {
  return std::ldexp(value / field.unit, -field.exponent);
}

double value_of(const Field& field, double steps) {
  return std::ldexp(steps, field.exponent) * field.unit;
}

/// Puts 240 bits, the most significant first.
class BitWriter {
 public:
  BitWriter(Subframe& subframe, int prn) : subframe_(subframe), prn_(prn) { subframe_.fill({}); }

  void bits(std::uint64_t value, int count) {
    for (int i = count - 1; i >= 0; --i, ++at_) {
      if (((value >> i) & 1u) == 0) continue;
      subframe_[static_cast<std::size_t>(at_ / 8)] |= static_cast<std::byte>(0x80u >> (at_ % 8));
    }
  }
  void whole(const char* name, int value, int count) {
    const int largest = (1 << count) - 1;
    if (value < 0 || value > largest) {
      refuse("pack", prn_,
             std::string(name) + " = " + std::to_string(value) + "; accepted: 0 to " +
                 std::to_string(largest));
    }
    bits(static_cast<std::uint64_t>(value), count);
  }
  void scaled(const Field& field, double value) {
    const double low = field.is_signed ? -std::ldexp(1, field.bits - 1) : 0;
    const double high = std::ldexp(1, field.is_signed ? field.bits - 1 : field.bits) - 1;
    const double steps = std::round(steps_of(field, value));
    if (!(steps >= low && steps <= high)) {  // so that NaN fails
      refuse("pack", prn_,
             std::string(field.name) + " = " + to_text(value) + "; accepted: " +
                 to_text(value_of(field, low)) + " to " + to_text(value_of(field, high)));
    }
    bits(static_cast<std::uint64_t>(static_cast<std::int64_t>(steps)), field.bits);
  }
  // An angle that any number of turns may be added to.
  void angle(const Field& field, double value) {
    const double steps = std::round(steps_of(field, value));
    if (!(std::abs(steps) < std::ldexp(1, 52))) {
      refuse("pack", prn_,
             std::string(field.name) + " = " + to_text(value) +
                 "; accepted: any finite angle up to 1e6 turns");
    }
    bits(static_cast<std::uint64_t>(static_cast<std::int64_t>(steps)), field.bits);
  }
  // A time of week goes out exactly or not at all: rounding it would move the satellite.
  void seconds(const Field& field, double value) {
    if (!(value >= 0 && value < kSecondsPerWeek) || std::fmod(value, 16) != 0) {
      refuse("pack", prn_,
             std::string(field.name) + " = " + to_text(value) +
                 "; accepted: multiples of 16 from 0 to 604784");
    }
    scaled(field, value);
  }

 private:
  Subframe& subframe_;
  int prn_;
  int at_ = 0;
};

class BitReader {
 public:
  explicit BitReader(const Subframe& subframe) : subframe_(subframe) {}

  std::uint32_t bits(int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i, ++at_) {
      const auto byte =
          std::to_integer<std::uint32_t>(subframe_[static_cast<std::size_t>(at_ / 8)]);
      value = value << 1 | ((byte >> (7 - at_ % 8)) & 1u);
    }
    return value;
  }
  int whole(int count) { return static_cast<int>(bits(count)); }
  bool flag() { return bits(1) != 0; }
  void skip(int count) { at_ += count; }
  double scaled(const Field& field) {
    const std::int64_t raw = bits(field.bits);
    const bool negative = field.is_signed && (raw >> (field.bits - 1)) != 0;
    return value_of(field, static_cast<double>(negative ? raw - (1LL << field.bits) : raw));
  }

 private:
  const Subframe& subframe_;
  int at_ = 0;
};

// Telemetry word without message, then the hand-over word with the count of the next subframe's
// start in units of 6 s.
void put_words_1_and_2(BitWriter& w, int tow_s, int id) {
  w.bits(kPreamble, 8);
  w.bits(0, 16);
  w.bits(static_cast<std::uint64_t>((tow_s / 6 + id) % (kSecondsPerWeek / 6)), 17);
  w.bits(0, 1);  // no alert
  w.bits(1, 1);  // anti-spoofing on
  w.bits(static_cast<std::uint64_t>(id), 3);
  w.bits(0, 2);  // they solve for the parity, which is removed
}

// The message counts the week of its transmission, toe may lie across a turn of the week.
int weeks_from_transmission(double toe_s, double tow_s) {
  constexpr double kHalfWeek = kSecondsPerWeek / 2;
  if (toe_s - tow_s > kHalfWeek) return -1;
  return toe_s - tow_s < -kHalfWeek ? 1 : 0;
}

Subframe subframe_1(const BroadcastEphemeris& e, int tow_s) {
  Subframe subframe;
  BitWriter w(subframe, e.prn);
  const int week = e.week - weeks_from_transmission(e.toe_s, tow_s);
  if (e.week < 0) {
    refuse("pack", e.prn, "week = " + std::to_string(e.week) + "; accepted: from 0");
  }
  put_words_1_and_2(w, tow_s, 1);
  w.bits(static_cast<std::uint64_t>(week + kWeeksPerRollover) % kWeeksPerRollover, 10);
  w.whole("l2_codes", e.l2_codes, 2);
  w.whole("ura_index", e.ura_index, 4);
  w.whole("health", e.health, 6);
  w.bits(static_cast<std::uint64_t>(e.iodc >> 8), 2);
  w.bits(e.l2p_data_off ? 1 : 0, 1);
  w.bits(0, 64);  // reserved
  w.bits(0, 23);
  w.scaled(kTgd, e.tgd_s);
  w.bits(static_cast<std::uint64_t>(e.iodc & 0xFF), 8);
  w.seconds(kToc, e.toc_s);
  w.scaled(kAf2, e.af2_sps2);
  w.scaled(kAf1, e.af1_sps);
  w.scaled(kAf0, e.af0_s);
  return subframe;
}

Subframe subframe_2(const BroadcastEphemeris& e, int tow_s) {
  Subframe subframe;
  BitWriter w(subframe, e.prn);
  put_words_1_and_2(w, tow_s, 2);
  w.whole("iode", e.iode, 8);
  w.scaled(kCrs, e.crs_m);
  w.scaled(kDeltaN, e.delta_n_radps);
  w.angle(kM0, e.mean_anomaly_rad);
  w.scaled(kCuc, e.cuc_rad);
  w.scaled(kEccentricity, e.eccentricity);
  w.scaled(kCus, e.cus_rad);
  w.scaled(kSqrtA, e.sqrt_a_sqrtm);
  w.seconds(kToe, e.toe_s);
  w.bits(e.fit_interval_above_4h ? 1 : 0, 1);
  w.whole("aodo", e.aodo, 5);
  return subframe;
}

Subframe subframe_3(const BroadcastEphemeris& e, int tow_s) {
  Subframe subframe;
  BitWriter w(subframe, e.prn);
  put_words_1_and_2(w, tow_s, 3);
  w.scaled(kCic, e.cic_rad);
  w.angle(kRaan0, e.raan0_rad);
  w.scaled(kCis, e.cis_rad);
  w.scaled(kI0, e.i0_rad);
  w.scaled(kCrc, e.crc_m);
  w.angle(kPerigee, e.argument_of_perigee_rad);
  w.scaled(kRaanRate, e.raan_rate_radps);
  w.bits(static_cast<std::uint64_t>(e.iode), 8);
  w.scaled(kIRate, e.i_rate_radps);
  return subframe;
}

void check_issues(const BroadcastEphemeris& e) {
  if (e.iodc < 0 || e.iodc > 1023) {
    refuse("pack", e.prn, "iodc = " + std::to_string(e.iodc) + "; accepted: 0 to 1023");
  }
  if (e.iode != (e.iodc & 0xFF)) {
    refuse("pack", e.prn,
           "iode = " + std::to_string(e.iode) + " with iodc = " + std::to_string(e.iodc) +
               "; accepted: iodc modulo 256");
  }
}

// Past the first two words; gives the hand-over word's count as seconds of the week.
double read_words_1_and_2(BitReader& r, int id, int prn) {
  const std::uint32_t preamble = r.bits(8);
  r.skip(16);
  const double next_s = 6.0 * r.bits(17);
  r.skip(2);
  const int id_found = r.whole(3);
  r.skip(2);
  if (preamble != kPreamble || id_found != id) {
    refuse("unpack", prn,
           "preamble " + std::to_string(preamble) + ", subframe id " + std::to_string(id_found) +
               "; accepted: 139 and " + std::to_string(id));
  }
  return next_s;
}

int nearest_week(int modulo_1024, int reference_week) {
  const int before = reference_week - kWeeksPerRollover / 2;
  const int ahead =
      ((modulo_1024 - before) % kWeeksPerRollover + kWeeksPerRollover) % kWeeksPerRollover;
  return before + ahead;
}

// Returns the time of transmission, which the week of toe depends on.
double read_subframe_1(const Subframe& subframe, int reference_week, BroadcastEphemeris& e) {
  BitReader r(subframe);
  const double next_s = read_words_1_and_2(r, 1, e.prn);
  e.week = nearest_week(r.whole(10), reference_week);
  e.l2_codes = r.whole(2);
  e.ura_index = r.whole(4);
  e.health = r.whole(6);
  e.iodc = r.whole(2) << 8;
  e.l2p_data_off = r.flag();
  r.skip(87);
  e.tgd_s = r.scaled(kTgd);
  e.iodc |= r.whole(8);
  e.toc_s = r.scaled(kToc);
  e.af2_sps2 = r.scaled(kAf2);
  e.af1_sps = r.scaled(kAf1);
  e.af0_s = r.scaled(kAf0);
  return next_s == 0 ? kSecondsPerWeek - 6.0 : next_s - 6.0;
}

void read_subframe_2(const Subframe& subframe, BroadcastEphemeris& e) {
  BitReader r(subframe);
  read_words_1_and_2(r, 2, e.prn);
  e.iode = r.whole(8);
  e.crs_m = r.scaled(kCrs);
  e.delta_n_radps = r.scaled(kDeltaN);
  e.mean_anomaly_rad = r.scaled(kM0);
  e.cuc_rad = r.scaled(kCuc);
  e.eccentricity = r.scaled(kEccentricity);
  e.cus_rad = r.scaled(kCus);
  e.sqrt_a_sqrtm = r.scaled(kSqrtA);
  e.toe_s = r.scaled(kToe);
  e.fit_interval_above_4h = r.flag();
  e.aodo = r.whole(5);
}

int read_subframe_3(const Subframe& subframe, BroadcastEphemeris& e) {
  BitReader r(subframe);
  read_words_1_and_2(r, 3, e.prn);
  e.cic_rad = r.scaled(kCic);
  e.raan0_rad = r.scaled(kRaan0);
  e.cis_rad = r.scaled(kCis);
  e.i0_rad = r.scaled(kI0);
  e.crc_m = r.scaled(kCrc);
  e.argument_of_perigee_rad = r.scaled(kPerigee);
  e.raan_rate_radps = r.scaled(kRaanRate);
  const int iode = r.whole(8);
  e.i_rate_radps = r.scaled(kIRate);
  return iode;
}

}  // namespace

Subframes pack(const BroadcastEphemeris& ephemeris, int tow_s) {
  if (tow_s < 0 || tow_s >= kSecondsPerWeek || tow_s % 30 != 0) {
    refuse("pack", ephemeris.prn,
           "tow_s = " + std::to_string(tow_s) + "; accepted: multiples of 30 from 0 to 604770");
  }
  check_issues(ephemeris);
  return {subframe_1(ephemeris, tow_s), subframe_2(ephemeris, tow_s), subframe_3(ephemeris, tow_s)};
}

BroadcastEphemeris unpack(const Subframes& subframes, int prn, int reference_week) {
  BroadcastEphemeris e{.prn = prn};
  const double sent_s = read_subframe_1(subframes[0], reference_week, e);
  read_subframe_2(subframes[1], e);
  const int iode_3 = read_subframe_3(subframes[2], e);
  if (e.iode != iode_3 || e.iode != (e.iodc & 0xFF)) {
    refuse("unpack", prn,
           "issues " + std::to_string(e.iodc) + ", " + std::to_string(e.iode) + ", " +
               std::to_string(iode_3) + " of subframes 1, 2, 3; accepted: equal modulo 256");
  }
  e.week += weeks_from_transmission(e.toe_s, sent_s);
  return e;
}

BroadcastEphemeris quantised(const BroadcastEphemeris& ephemeris) {
  const int frame_start_s = static_cast<int>(ephemeris.toe_s) / 30 * 30;
  return unpack(pack(ephemeris, frame_start_s), ephemeris.prn, ephemeris.week);
}

double ura_m(int ura_index) {
  constexpr double kNominal_m[15] = {2,  2.8, 4,   5.7, 8,    11.3, 16,  32,
                                     64, 128, 256, 512, 1024, 2048, 4096};
  if (ura_index < 0 || ura_index > 15) {
    throw std::invalid_argument("lnav::ura_m: ura_index = " + std::to_string(ura_index) +
                                "; accepted: 0 to 15");
  }
  return ura_index == 15 ? 6144 : kNominal_m[ura_index];
}

}  // namespace orrery::lnav
