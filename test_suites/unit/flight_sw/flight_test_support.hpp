/// What the tests of the flight packages share: frames made by hand, noise, and an orbit propagated
/// by other means than the flight code's.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "orrery_messages.h"
#include "support/gnss_fix.hpp"
#include "support/orbit/constants.hpp"
#include "support/orbit/relative_elements.hpp"

namespace flight_test {

using flight_support::OrbitElements;
using flight_support::StateEci;
using flight_support::Vec3;

/// 2025-03-20 00:00:00 GPST, of the reference mission: week 2358, Thursday.
constexpr std::int64_t kEpoch_ns = (2358LL * 604800 + 4 * 86400) * flight_support::kSecond_ns;

/// The chief of the reference mission.
inline OrbitElements reference_chief() {
  OrbitElements chief;
  chief.a_m = 6928137.0;
  chief.ex = 0.0006;
  chief.ey = 0.0008;
  chief.i_rad = 97.59 * flight_support::kPi / 180.0;
  chief.raan_rad = 5.48;
  chief.u_rad = 0.7;
  return chief;
}

inline flight_support::RelativeElements roe(double da, double dl, double dex, double dey,
                                            double dix, double diy) {
  return {{{da}, {dl}, {dex}, {dey}, {dix}, {diy}}};
}

/// CRC-32 as NovAtel's manual prints it, bit by bit.
inline std::uint32_t novatel_crc(const std::vector<unsigned char>& bytes) {
  std::uint32_t crc = 0;
  for (unsigned char byte : bytes) {
    std::uint32_t low = (crc ^ byte) & 0xFFu;
    for (int bit = 0; bit < 8; ++bit) low = (low & 1u) ? (low >> 1) ^ 0xEDB88320u : low >> 1;
    crc = ((crc >> 8) & 0x00FFFFFFu) ^ low;
  }
  return crc;
}

inline void put_u16(std::vector<unsigned char>* to, std::size_t at, unsigned value) {
  (*to)[at] = static_cast<unsigned char>(value & 0xFFu);
  (*to)[at + 1] = static_cast<unsigned char>(value >> 8);
}
inline void put_f32(std::vector<unsigned char>* to, std::size_t at, float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  orrery_put_u32(to->data() + at, bits);
}
/// Puts the CRC of everything before it into the last four bytes.
inline void seal(std::vector<unsigned char>* frame) {
  const std::vector<unsigned char> covered(frame->begin(), frame->end() - 4);
  orrery_put_u32(frame->data() + covered.size(), novatel_crc(covered));
}

/// A BESTXYZ log as a receiver sends it; offsets as in NovAtel's manual.
inline std::vector<unsigned char> bestxyz_frame(const flight_support::GnssFix& fix) {
  std::vector<unsigned char> frame(28 + 112 + 4, 0);
  frame[0] = 0xAA, frame[1] = 0x44, frame[2] = 0x12, frame[3] = 28;
  put_u16(&frame, 4, 241);
  frame[7] = 0x20;
  put_u16(&frame, 8, 112);
  frame[13] = 180;  // FINESTEERING
  put_u16(&frame, 14, static_cast<unsigned>(fix.epoch_ns / flight_support::kWeek_ns));
  orrery_put_u32(&frame[16],
                 static_cast<std::uint32_t>(fix.epoch_ns % flight_support::kWeek_ns / 1000000));
  orrery_put_u32(&frame[28 + 4], 16);  // SINGLE
  orrery_put_u32(&frame[28 + 48], 8);  // DOPPLER_VELOCITY
  for (std::size_t k = 0; k < 3; ++k) {
    const int axis = static_cast<int>(k);
    orrery_put_f64(&frame[28 + 8 + 8 * k], fix.r_ECEF[axis]);
    orrery_put_f64(&frame[28 + 52 + 8 * k], fix.v_ECEF[axis]);
    put_f32(&frame, 28 + 32 + 4 * k, static_cast<float>(fix.sigma_r_m));
    put_f32(&frame, 28 + 76 + 4 * k, static_cast<float>(fix.sigma_v_mps));
  }
  seal(&frame);
  return frame;
}

/// Standard normal numbers, the same everywhere: SplitMix64 and the polar method of Marsaglia.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed) {}
  double uniform() {
    state_ += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  double normal() {
    for (;;) {
      const double x = 2.0 * uniform() - 1.0;
      const double y = 2.0 * uniform() - 1.0;
      const double r2 = x * x + y * y;
      if (r2 > 0.0 && r2 < 1.0) return x * std::sqrt(-2.0 * std::log(r2) / r2);
    }
  }
  Vec3 normal3(double sigma) {
    Vec3 v;
    for (int k = 0; k < 3; ++k) v[k] = sigma * normal();
    return v;
  }

 private:
  std::uint64_t state_;
};

/// Acceleration of an oblate Earth [m/s^2], in Cartesian form: Vallado, Fundamentals (2013),
/// §8.7.1.
inline Vec3 oblate_acceleration_ECI(const Vec3& r) {
  using namespace flight_support;
  const double r2 = dot(r, r), d = std::sqrt(r2);
  const double k = 1.5 * kJ2 * kRadiusEarth_m * kRadiusEarth_m / r2;
  const double z2 = 5.0 * r[2] * r[2] / r2;
  const double g = -kMuEarth_m3ps2 / (r2 * d);
  return flight_support::vec3(g * r[0] * (1.0 - k * (z2 - 1.0)), g * r[1] * (1.0 - k * (z2 - 1.0)),
                              g * r[2] * (1.0 - k * (z2 - 3.0)));
}

/// The state `dt_s` later, by RK4 in steps of at most 5 s: 0.02 m after a day, nearly the same for
/// two spacecraft side by side.
inline StateEci propagate_oblate(StateEci s, double dt_s) {
  const int steps = static_cast<int>(std::ceil(std::fabs(dt_s) / 5.0));
  for (int k = 0; k < steps; ++k) {
    const double h = dt_s / steps;
    const Vec3 v1 = s.v_ECI, a1 = oblate_acceleration_ECI(s.r_ECI);
    const Vec3 v2 = s.v_ECI + 0.5 * h * a1, a2 = oblate_acceleration_ECI(s.r_ECI + 0.5 * h * v1);
    const Vec3 v3 = s.v_ECI + 0.5 * h * a2, a3 = oblate_acceleration_ECI(s.r_ECI + 0.5 * h * v2);
    const Vec3 v4 = s.v_ECI + h * a3, a4 = oblate_acceleration_ECI(s.r_ECI + h * v3);
    s.r_ECI = s.r_ECI + (h / 6.0) * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    s.v_ECI = s.v_ECI + (h / 6.0) * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }
  return s;
}

inline StateEci state_of_mean(const OrbitElements& mean) {
  return flight_support::state_from_osculating(flight_support::osculating_from_mean(mean));
}
inline OrbitElements mean_of_state(const StateEci& state) {
  return flight_support::mean_from_osculating(flight_support::osculating_from_state(state));
}

/// What a GNSS receiver says of `state`, with noise of 1.5 m and 30 mm/s per axis (Table 2 of the
/// paper).
inline flight_support::GnssFix noisy_fix(std::int64_t epoch_ns, const StateEci& state,
                                         Noise* noise) {
  using namespace flight_support;
  const flight_support::Mat3 R_EI = transpose(ecef_to_eci(epoch_ns, EarthTime()));
  const Vec3 omega = flight_support::vec3(0, 0, kEarthRotation_radps);
  GnssFix fix;
  fix.epoch_ns = epoch_ns;
  fix.r_ECEF = R_EI * state.r_ECI;
  fix.v_ECEF = R_EI * state.v_ECI - cross(omega, fix.r_ECEF);
  fix.r_ECEF = fix.r_ECEF + noise->normal3(1.5);
  fix.v_ECEF = fix.v_ECEF + noise->normal3(0.03);
  fix.sigma_r_m = 1.5;
  fix.sigma_v_mps = 0.03;
  return fix;
}

}  // namespace flight_test
