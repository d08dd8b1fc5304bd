#include "formation_gnc/navigation/broadcast_ephemeris.hpp"

#include <cmath>

#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using flight_support::kSecond_ns;
using flight_support::kWeek_ns;
using flight_support::seconds;
using flight_support::Vec3;
using flight_support::vec3;

// IS-GPS-200: the broadcast model has constants of its own.
constexpr double kMuGps_m3ps2 = 3.986005e14;
constexpr double kOmegaEarthGps_radps = 7.2921151467e-5;
constexpr double kPiGps = 3.1415926535898;
constexpr double kRelativity_sprootm = -4.442807633e-10;  // F

constexpr std::int64_t kUsableFromToe_ns = 9000 * kSecond_ns;

/// Bits of a subframe without parity, most significant first.
class Bits {
 public:
  explicit Bits(const unsigned char* bytes) : bytes_(bytes) {}
  void skip(int bits) { at_ += bits; }
  std::uint32_t unsigned_of(int bits) {
    std::uint64_t value = 0;
    for (int k = 0; k < bits; ++k, ++at_) {
      value = value << 1 | (bytes_[at_ / 8] >> (7 - at_ % 8) & 1u);
    }
    return static_cast<std::uint32_t>(value);
  }
  std::int32_t signed_of(int bits) {
    const std::int64_t value = unsigned_of(bits);
    const std::int64_t half = std::int64_t{1} << (bits - 1);
    return static_cast<std::int32_t>(value >= half ? value - 2 * half : value);
  }
  double scaled(int bits, int power) { return std::ldexp(signed_of(bits), power); }
  double angle(int bits, int power) { return scaled(bits, power) * kPiGps; }

 private:
  const unsigned char* bytes_;
  int at_ = 0;
};

// TLM and HOW: 24 + 17 + 2 bits, then the number of the subframe.
bool begin_subframe(Bits* bits, std::uint32_t number) {
  const bool preamble = bits->unsigned_of(8) == 0x8B;
  bits->skip(16 + 17 + 2);
  const bool right = bits->unsigned_of(3) == number;
  bits->skip(2);
  return preamble && right;
}

bool read_subframe_1(const unsigned char* bytes, BroadcastEphemeris* e, double* toc_s) {
  Bits bits(bytes);
  if (!begin_subframe(&bits, 1)) return false;
  bits.skip(10 + 2 + 4);
  e->health = static_cast<std::uint8_t>(bits.unsigned_of(6));
  const std::uint32_t iodc_high = bits.unsigned_of(2);
  bits.skip(1 + 87);
  e->tgd_s = bits.scaled(8, -31);
  e->iodc = static_cast<std::uint16_t>(iodc_high << 8 | bits.unsigned_of(8));
  *toc_s = 16.0 * bits.unsigned_of(16);
  e->af2_sps2 = bits.scaled(8, -55);
  e->af1_sps = bits.scaled(16, -43);
  e->af0_s = bits.scaled(22, -31);
  return true;
}

bool read_subframe_2(const unsigned char* bytes, BroadcastEphemeris* e) {
  Bits bits(bytes);
  if (!begin_subframe(&bits, 2)) return false;
  if (bits.unsigned_of(8) != (e->iodc & 255u)) return false;
  e->crs_m = bits.scaled(16, -5);
  e->delta_n_radps = bits.angle(16, -43);
  e->m0_rad = bits.angle(32, -31);
  e->cuc_rad = bits.scaled(16, -29);
  e->eccentricity = std::ldexp(bits.unsigned_of(32), -33);
  e->cus_rad = bits.scaled(16, -29);
  e->sqrt_a_sqrtm = std::ldexp(bits.unsigned_of(32), -19);
  e->toe_s = 16.0 * bits.unsigned_of(16);
  return true;
}

bool read_subframe_3(const unsigned char* bytes, BroadcastEphemeris* e) {
  Bits bits(bytes);
  if (!begin_subframe(&bits, 3)) return false;
  e->cic_rad = bits.scaled(16, -29);
  e->raan0_rad = bits.angle(32, -31);
  e->cis_rad = bits.scaled(16, -29);
  e->i0_rad = bits.angle(32, -31);
  e->crc_m = bits.scaled(16, -5);
  e->omega_rad = bits.angle(32, -31);
  e->raan_rate_radps = bits.angle(24, -43);
  if (bits.unsigned_of(8) != (e->iodc & 255u)) return false;
  e->i_rate_radps = bits.angle(14, -43);
  return true;
}

// The instant with this second of the week that is nearest to `near_ns`.
std::int64_t nearest_ns(double second_of_week, std::int64_t near_ns) {
  std::int64_t t = near_ns - near_ns % kWeek_ns + flight_support::nanoseconds(second_of_week);
  if (t - near_ns > kWeek_ns / 2) t -= kWeek_ns;
  if (near_ns - t > kWeek_ns / 2) t += kWeek_ns;
  return t;
}

// Written so that NaN fails.
bool is_plausible(const BroadcastEphemeris& e) {
  const double a = e.sqrt_a_sqrtm * e.sqrt_a_sqrtm;
  const double sum = e.m0_rad + e.delta_n_radps + e.omega_rad + e.raan0_rad + e.raan_rate_radps +
                     e.i0_rad + e.i_rate_radps + e.cuc_rad + e.cus_rad + e.crc_m + e.crs_m +
                     e.cic_rad + e.cis_rad + e.af0_s + e.af1_sps + e.af2_sps2 + e.tgd_s;
  return e.prn >= 1 && e.prn <= 32 && a > 2.5e7 && a < 2.8e7 && e.eccentricity >= 0.0 &&
         e.eccentricity < 0.1 && e.toe_s >= 0.0 && e.toe_s < 604800.0 && std::isfinite(sum);
}

bool read_raw(const novatel_rawephem& raw, std::int64_t t_ns, BroadcastEphemeris* e) {
  if (raw.prn > 32) return false;
  e->prn = static_cast<std::uint8_t>(raw.prn);
  double toc_s = 0.0;
  if (!read_subframe_1(raw.subframes[0], e, &toc_s)) return false;
  if (!read_subframe_2(raw.subframes[1], e) || !read_subframe_3(raw.subframes[2], e)) return false;
  if (toc_s >= 604800.0 || e->toe_s >= 604800.0) return false;
  e->toe_ns = nearest_ns(e->toe_s, t_ns);
  e->toc_ns = nearest_ns(toc_s, t_ns);
  return true;
}

bool read_decoded(const novatel_gpsephem& log, std::int64_t t_ns, BroadcastEphemeris* e) {
  if (log.prn > 32 || !(log.semi_major_axis_m > 0.0)) return false;
  if (!(log.toe_s >= 0.0 && log.toe_s < 604800.0 && log.toc_s >= 0.0 && log.toc_s < 604800.0)) {
    return false;
  }
  e->prn = static_cast<std::uint8_t>(log.prn);
  e->iodc = static_cast<std::uint16_t>(log.iodc & 1023u);
  e->health = static_cast<std::uint8_t>(log.health & 63u);
  e->toe_s = log.toe_s;
  e->toe_ns = nearest_ns(log.toe_s, t_ns);
  e->toc_ns = nearest_ns(log.toc_s, t_ns);
  e->sqrt_a_sqrtm = std::sqrt(log.semi_major_axis_m);
  e->eccentricity = log.eccentricity;
  e->m0_rad = log.mean_anomaly_rad, e->delta_n_radps = log.delta_n_radps;
  e->omega_rad = log.argument_of_perigee_rad;
  e->raan0_rad = log.raan0_rad, e->raan_rate_radps = log.raan_rate_radps;
  e->i0_rad = log.i0_rad, e->i_rate_radps = log.i_rate_radps;
  e->cuc_rad = log.cuc_rad, e->cus_rad = log.cus_rad, e->crc_m = log.crc_m, e->crs_m = log.crs_m;
  e->cic_rad = log.cic_rad, e->cis_rad = log.cis_rad;
  e->af0_s = log.af0_s, e->af1_sps = log.af1_sps, e->af2_sps2 = log.af2_sps2;
  e->tgd_s = log.tgd_s;
  return true;
}

double eccentric_anomaly(double M, double e) {
  double E = M + e * std::sin(M);
  for (int k = 0; k < 4; ++k) {
    const double step = (E - e * std::sin(E) - M) / (1.0 - e * std::cos(E));
    E -= step;
    if (std::fabs(step) < 1e-9) break;  // the next one would be 1e-18
  }
  return E;
}

struct Harmonic {
  double value, rate;
};
// c cos(2 phi) + s sin(2 phi)
Harmonic harmonic(double c, double s, double cos2, double sin2, double phi_rate) {
  return {c * cos2 + s * sin2, 2.0 * phi_rate * (s * cos2 - c * sin2)};
}

}  // namespace

bool read_ephemeris(const novatel_frame& frame, BroadcastEphemeris* ephemeris) {
  const std::int64_t t_ns = novatel_time_ns(&frame);
  if (t_ns <= 0) return false;
  BroadcastEphemeris read;
  novatel_rawephem raw;
  novatel_gpsephem decoded;
  if (novatel_get_rawephem(&frame, &raw) != 0) {
    if (!read_raw(raw, t_ns, &read)) return false;
  } else if (novatel_get_gpsephem(&frame, &decoded) == 0 || !read_decoded(decoded, t_ns, &read)) {
    return false;
  }
  if (!is_plausible(read)) return false;
  *ephemeris = read;
  return true;
}

SatelliteState satellite_ECEF(const BroadcastEphemeris& e, std::int64_t t_ns) {
  const double tk = seconds(t_ns - e.toe_ns);
  const double a = e.sqrt_a_sqrtm * e.sqrt_a_sqrtm;
  const double n = std::sqrt(kMuGps_m3ps2 / a) / a + e.delta_n_radps;
  const double ecc = e.eccentricity;
  const double E = eccentric_anomaly(e.m0_rad + n * tk, ecc);
  const double sin_E = std::sin(E), cos_E = std::cos(E);
  const double eta = std::sqrt(1.0 - ecc * ecc), one = 1.0 - ecc * cos_E;
  const double E_rate = n / one;
  const double phi = std::atan2(eta * sin_E, cos_E - ecc) + e.omega_rad;
  const double phi_rate = E_rate * eta / one;
  const double sin2 = std::sin(2.0 * phi), cos2 = std::cos(2.0 * phi);
  const Harmonic du = harmonic(e.cuc_rad, e.cus_rad, cos2, sin2, phi_rate);
  const Harmonic dr = harmonic(e.crc_m, e.crs_m, cos2, sin2, phi_rate);
  const Harmonic di = harmonic(e.cic_rad, e.cis_rad, cos2, sin2, phi_rate);
  const double u = phi + du.value, u_rate = phi_rate + du.rate;
  const double r = a * one + dr.value, r_rate = a * ecc * sin_E * E_rate + dr.rate;
  const double i = e.i0_rad + e.i_rate_radps * tk + di.value, i_rate = e.i_rate_radps + di.rate;
  const double node_rate = e.raan_rate_radps - kOmegaEarthGps_radps;
  const double node = e.raan0_rad + node_rate * tk - kOmegaEarthGps_radps * e.toe_s;
  const double sin_u = std::sin(u), cos_u = std::cos(u);
  const double x = r * cos_u, y = r * sin_u;
  const double x_rate = r_rate * cos_u - y * u_rate, y_rate = r_rate * sin_u + x * u_rate;
  const double sin_i = std::sin(i), cos_i = std::cos(i);
  const double sin_o = std::sin(node), cos_o = std::cos(node);
  const double y_plane = y * cos_i, y_plane_rate = y_rate * cos_i - y * sin_i * i_rate;
  SatelliteState s;
  s.r = vec3(x * cos_o - y_plane * sin_o, x * sin_o + y_plane * cos_o, y * sin_i);
  s.v = vec3(x_rate * cos_o - y_plane_rate * sin_o - s.r[1] * node_rate,
             x_rate * sin_o + y_plane_rate * cos_o + s.r[0] * node_rate,
             y_rate * sin_i + y * cos_i * i_rate);
  const double since_toc = seconds(t_ns - e.toc_ns);
  const double relativity = kRelativity_sprootm * ecc * e.sqrt_a_sqrtm;
  s.clock_m = kSpeedOfLight_mps * (e.af0_s + (e.af1_sps + e.af2_sps2 * since_toc) * since_toc +
                                   relativity * sin_E - e.tgd_s);
  s.clock_rate_mps =
      kSpeedOfLight_mps * (e.af1_sps + 2.0 * e.af2_sps2 * since_toc + relativity * cos_E * E_rate);
  return s;
}

void EphemerisStore::add(const BroadcastEphemeris& ephemeris) {
  if (ephemeris.prn < 1 || ephemeris.prn > 32) return;
  BroadcastEphemeris(&issue)[2] = issues_[ephemeris.prn - 1];
  for (BroadcastEphemeris& known : issue) {
    if (known.prn != 0 && known.toe_ns == ephemeris.toe_ns) {
      known = ephemeris;
      return;
    }
  }
  BroadcastEphemeris& older =
      issue[1].prn == 0 || (issue[0].prn != 0 && issue[1].toe_ns < issue[0].toe_ns) ? issue[1]
                                                                                    : issue[0];
  older = ephemeris;
}

const BroadcastEphemeris* EphemerisStore::find(int prn, std::int64_t t_ns) const {
  const BroadcastEphemeris* nearest = nullptr;
  std::int64_t best_ns = kUsableFromToe_ns;
  for (const BroadcastEphemeris& known : issues_[prn - 1]) {
    const std::int64_t apart_ns = known.toe_ns > t_ns ? known.toe_ns - t_ns : t_ns - known.toe_ns;
    if (known.prn != 0 && apart_ns <= best_ns) {
      nearest = &known;
      best_ns = apart_ns;
    }
  }
  return nearest != nullptr && nearest->health == 0 ? nearest : nullptr;
}

}  // namespace formation_gnc
