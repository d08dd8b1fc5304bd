/// NRLMSISE-00 written down term by term, as the equations are published: each set of coefficients
/// on its own, cosines of whole phases, densities rather than logarithms. Slow; the model under
/// test does none of this so. Thermosphere above 72.5 km only.
#pragma once

#include <orrery/models/atmosphere/nrlmsise00.hpp>
#include <orrery/models/data/embedded_tables.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace orrery::term_by_term {

using Set = const std::vector<double>&;

/// block -> rows of numbers, straight from the text.
inline std::map<std::string, std::vector<std::vector<double>>> blocks() {
  std::map<std::string, std::vector<std::vector<double>>> out;
  std::istringstream in{std::string(embedded::nrlmsise00_coefficients())};
  std::string at, name;
  std::size_t rows = 0, columns = 0;
  while (in >> at >> name >> rows >> columns) {
    out[name].assign(rows, std::vector<double>(columns));
    for (auto& row : out[name]) {
      for (double& value : row) in >> value;
    }
  }
  return out;
}

class Model {
 public:
  explicit Model(const Nrlmsise00Input& in) : in_(in) {
    const double c2 = std::cos(2 * kDeg * in.latitude_deg);
    gravity_ = 980.616 * (1 - 0.0026373 * c2);
    radius_ = 2 * gravity_ / (3.085462e-6 + 2.27e-9 * c2) * 1e-5;
  }

  /// He, O, N2, O2, Ar, H, N, anomalous O [1/cm^3], T [K].
  std::array<double, 9> evaluate();

 private:
  static constexpr double kDeg = 1.74533e-2, kDay = 1.72142e-2, kSec = 7.2722e-5, kHour = 0.2618;

  double P(int m, int n) const;
  double ap_amplitude(Set p) const;
  double G(Set p) const;
  double G_low(Set p, double ap) const;
  double density(double z, double at_120, double mass, double alpha);
  double temperature_and_integral(double z, double& integral);

  double zeta(double z, double z0) const { return (z - z0) * (radius_ + z0) / (radius_ + z); }
  double g(double z) const { return gravity_ / ((1 + z / radius_) * (1 + z / radius_)); }
  double season(int times, double phase) const {
    return std::cos(times * kDay * (in_.day_of_year - phase));
  }

  Nrlmsise00Input in_;
  double gravity_, radius_;
  double T_inf_ = 0, T_120_ = 0, s_ = 0, z_a_ = 0;
  std::array<double, 5> z_{}, T_{};
  double bottom_gradient_ = 0;
};

/// From the definition: derivatives of (x^2 - 1)^n, by Legendre's sum of powers.
inline double Model::P(int m, int n) const {
  const double x = std::sin(kDeg * in_.latitude_deg), y = std::cos(kDeg * in_.latitude_deg);
  double sum = 0;
  for (int k = 0; 2 * k <= n - m; ++k) {
    const double magnitude = std::tgamma(2 * n - 2 * k + 1) / std::tgamma(k + 1) /
                             std::tgamma(n - k + 1) / std::tgamma(n - 2 * k - m + 1) / std::exp2(n);
    sum += (k % 2 == 0 ? 1 : -1) * magnitude * std::pow(x, n - 2 * k - m);
  }
  return sum * std::pow(y, m);
}

inline double Model::ap_amplitude(Set p) const {
  const auto response = [&](double ap, double rate, double slope) {
    return ap - 4 + (slope - 1) * (ap - 4 + (std::exp(-rate * (ap - 4)) - 1) / rate);
  };
  if (!in_.ap_history) return response(in_.ap_daily, p[43], p[44]);
  if (p[51] == 0) return 0;
  const double fading =
      std::exp(-10800 * std::abs(p[51]) / (1 + p[138] * (45 - std::abs(in_.latitude_deg))));
  // A geometric series over twenty intervals, the two means standing for eight each. The published
  // divisor has the powers of the intervals' ends.
  double sum = 0, weights = 0;
  for (int k = 0; k < 20; ++k) {
    const std::size_t entry = k < 4 ? static_cast<std::size_t>(k) + 1 : k < 12 ? 5 : 6;
    sum += std::pow(fading, k) *
           response((*in_.ap_history)[entry], std::max(std::abs(p[24]), 1e-4), p[25]);
    weights += k == 0 ? 1 : std::pow(fading, k - 0.5);
  }
  return sum / weights;
}

inline double Model::G(Set p) const {
  const double df = in_.f107_sfu - in_.f107a_sfu, dfa = in_.f107a_sfu - 150;
  const double flux = p[19] * df + p[20] * df * df;
  const double f1 = 1 + p[47] * dfa + flux, f2 = 1 + p[49] * dfa + flux;
  const double year = season(1, p[13]);
  const double t = kHour * in_.local_solar_time_h, east = kDeg * in_.longitude_deg;
  const auto ut = [&](double phase) { return kSec * (in_.ut_s - phase); };
  double sum =
      p[30] + p[19] * df * (1 + p[59] * dfa) + p[20] * df * df + p[21] * dfa + p[29] * dfa * dfa;
  sum +=
      p[1] * P(0, 2) + p[2] * P(0, 4) + p[22] * P(0, 6) + p[14] * P(0, 2) * dfa + p[26] * P(0, 1);
  sum += p[18] * season(1, p[31]) + (p[15] + p[16] * P(0, 2)) * season(2, p[17]);
  sum += f1 * (p[9] * P(0, 1) + p[10] * P(0, 3)) * year + p[37] * P(0, 1) * season(2, p[38]);
  sum +=
      f2 *
      ((p[3] * P(1, 1) + p[4] * P(1, 3) + p[27] * P(1, 5) + p[11] * P(1, 2) * year) * std::cos(t) +
       (p[6] * P(1, 1) + p[7] * P(1, 3) + p[28] * P(1, 5) + p[12] * P(1, 2) * year) * std::sin(t));
  sum += f2 * ((p[5] * P(2, 2) + p[41] * P(2, 4) + (p[23] * P(2, 3) + p[35] * P(2, 5)) * year) *
                   std::cos(2 * t) +
               (p[8] * P(2, 2) + p[42] * P(2, 4) + (p[33] * P(2, 3) + p[36] * P(2, 5)) * year) *
                   std::sin(2 * t));
  sum += f2 * ((p[39] * P(3, 3) + (p[93] * P(3, 4) + p[46] * P(3, 6)) * year) * std::sin(3 * t) +
               (p[40] * P(3, 3) + (p[94] * P(3, 4) + p[48] * P(3, 6)) * year) * std::cos(3 * t));
  sum +=
      (1 + p[80] * dfa) *
      ((p[64] * P(1, 2) + p[65] * P(1, 4) + p[66] * P(1, 6) + p[103] * P(1, 1) + p[104] * P(1, 3) +
        p[105] * P(1, 5) + (p[109] * P(1, 1) + p[110] * P(1, 3) + p[111] * P(1, 5)) * year) *
           std::cos(east) +
       (p[90] * P(1, 2) + p[91] * P(1, 4) + p[92] * P(1, 6) + p[106] * P(1, 1) + p[107] * P(1, 3) +
        p[108] * P(1, 5) + (p[112] * P(1, 1) + p[113] * P(1, 3) + p[114] * P(1, 5)) * year) *
           std::sin(east));
  sum += (1 + p[95] * P(0, 1)) * (1 + p[81] * dfa) * (1 + p[119] * P(0, 1) * year) *
         (p[68] * P(0, 1) + p[69] * P(0, 3) + p[70] * P(0, 5)) * std::cos(ut(p[71]));
  sum += (p[76] * P(2, 3) + p[77] * P(2, 5) + p[78] * P(2, 7)) * std::cos(ut(p[79]) + 2 * east) *
         (1 + p[137] * dfa);

  // Indices of the daily response and of that to the history.
  const bool h = in_.ap_history.has_value();
  const auto q = [&](int daily, int history) {
    return p[static_cast<std::size_t>(h ? history : daily)];
  };
  const auto local = [&](double phase) {
    return std::cos(kHour * (in_.local_solar_time_h - phase));
  };
  const auto lon = [&](double phase) { return std::cos(kDeg * (in_.longitude_deg - phase)); };
  sum +=
      ap_amplitude(p) *
      (q(32, 50) + q(45, 96) * P(0, 2) + q(34, 54) * P(0, 4) +
       (q(100, 125) * P(0, 1) + q(101, 126) * P(0, 3) + q(102, 127) * P(0, 5)) * year +
       (q(121, 128) * P(1, 1) + q(122, 129) * P(1, 3) + q(123, 130) * P(1, 5)) *
           local(q(124, 131)) +
       (1 + q(120, 132) * P(0, 1)) *
           (q(60, 52) * P(1, 2) + q(61, 98) * P(1, 4) + q(62, 67) * P(1, 6)) * lon(q(63, 97)) +
       (q(115, 133) * P(1, 1) + q(116, 134) * P(1, 3) + q(117, 135) * P(1, 5)) * year *
           lon(q(118, 136)) +
       (q(83, 55) * P(0, 1) + q(84, 56) * P(0, 3) + q(85, 57) * P(0, 5)) * std::cos(ut(q(75, 58))));
  return sum;
}

inline double Model::G_low(Set p, double ap) const {
  const double dfa = in_.f107a_sfu - 150, year = season(1, p[13]);
  const double t = kHour * in_.local_solar_time_h, east = kDeg * in_.longitude_deg;
  double sum = p[21] * dfa + p[1] * P(0, 2) + p[2] * P(0, 4) + p[22] * P(0, 6) + p[26] * P(0, 1) +
               p[14] * P(0, 3) + p[59] * P(0, 5);
  sum += (p[18] + p[47] * P(0, 2) + p[29] * P(0, 4)) * season(1, p[31]) +
         (p[15] + p[16] * P(0, 2) + p[30] * P(0, 4)) * season(2, p[17]) +
         (p[9] * P(0, 1) + p[10] * P(0, 3) + p[20] * P(0, 5)) * year +
         p[37] * P(0, 1) * season(2, p[38]);
  sum += (p[3] * P(1, 1) + p[4] * P(1, 3) + p[11] * P(1, 2) * year) * std::cos(t) +
         (p[6] * P(1, 1) + p[7] * P(1, 3) + p[12] * P(1, 2) * year) * std::sin(t);
  sum += (p[5] * P(2, 2) + p[41] * P(2, 4) + (p[23] * P(2, 3) + p[35] * P(2, 5)) * year) *
             std::cos(2 * t) +
         (p[8] * P(2, 2) + p[42] * P(2, 4) + (p[33] * P(2, 3) + p[36] * P(2, 5)) * year) *
             std::sin(2 * t);
  sum += P(3, 3) * (p[39] * std::sin(3 * t) + p[40] * std::cos(3 * t));
  sum += ap * (in_.ap_history ? p[50] + p[96] * P(0, 2) : p[32] + p[45] * P(0, 2));
  const double seasons = 1 + P(0, 1) * (p[80] * season(1, p[81]) + p[85] * season(2, p[86])) +
                         p[83] * season(1, p[84]) + p[87] * season(2, p[88]);
  sum += seasons * ((p[64] * P(1, 2) + p[65] * P(1, 4) + p[66] * P(1, 6) + p[74] * P(1, 1) +
                     p[75] * P(1, 3) + p[76] * P(1, 5)) *
                        std::cos(east) +
                    (p[90] * P(1, 2) + p[91] * P(1, 4) + p[92] * P(1, 6) + p[77] * P(1, 1) +
                     p[78] * P(1, 3) + p[79] * P(1, 5)) *
                        std::sin(east));
  return sum;
}

/// T(z), and the integral of dzeta/T from the top node down to z. The spline as Hermite cubics,
/// whose inner slopes make second derivatives continuous (by sweeps); the integral by Simpson's
/// rule on each cubic, for which it is exact.
inline double Model::temperature_and_integral(double z, double& integral) {
  const double length = zeta(z_[4], z_[0]);
  std::array<double, 5> x{}, y{}, slope{};
  for (std::size_t k = 0; k < 5; ++k) {
    x[k] = zeta(z_[k], z_[0]) / length;
    y[k] = 1 / T_[k];
  }
  const double top_gradient =
      (T_inf_ - T_[0]) * s_ * std::pow((radius_ + 120) / (radius_ + z_[0]), 2);
  slope[0] = -top_gradient / (T_[0] * T_[0]) * length;
  slope[4] = -bottom_gradient_ / (T_[4] * T_[4]) * length *
             std::pow((radius_ + z_[4]) / (radius_ + z_[0]), 2);
  for (int sweep = 0; sweep < 200; ++sweep) {
    for (std::size_t k = 1; k < 4; ++k) {
      const double a = x[k] - x[k - 1], b = x[k + 1] - x[k];
      const double mean = 3 * ((y[k] - y[k - 1]) / (a * a) + (y[k + 1] - y[k]) / (b * b));
      slope[k] = (mean - slope[k - 1] / a - slope[k + 1] / b) / (2 * (1 / a + 1 / b));
    }
  }
  const auto inverse_T = [&](double at) {
    std::size_t k = 0;
    while (k < 3 && at > x[k + 1]) ++k;
    const double h = x[k + 1] - x[k], u = (at - x[k]) / h;
    return y[k] * (1 + 2 * u) * (1 - u) * (1 - u) + y[k + 1] * u * u * (3 - 2 * u) +
           h * u * (1 - u) * (slope[k] * (1 - u) - slope[k + 1] * u);
  };
  const double end = zeta(z, z_[0]) / length;
  integral = 0;
  for (std::size_t k = 0; k < 4 && x[k] < end; ++k) {
    const double to = k == 3 ? end : std::min(x[k + 1], end);
    const double step = to - x[k];
    integral += length * step / 6 * (y[k] + 4 * inverse_T(x[k] + step / 2) + inverse_T(to));
  }
  return 1 / inverse_T(end);
}

inline double Model::density(double z, double at_120, double mass, double alpha) {
  const double top = std::max(z, z_a_);
  const double T = T_inf_ - (T_inf_ - T_120_) * std::exp(-s_ * zeta(top, 120));
  const double gamma = mass * g(120) / (s_ * 831.4 * T_inf_);
  const double n =
      at_120 * std::pow(T_120_ / T, 1 + alpha + gamma) * std::exp(-s_ * gamma * zeta(top, 120));
  if (z >= z_a_) return n;
  double integral = 0;
  const double T_z = temperature_and_integral(z, integral);
  return n * std::pow(T / T_z, 1 + alpha) * std::exp(-mass * g(z_a_) / 831.4 * integral);
}

inline std::array<double, 9> Model::evaluate() {
  static const auto kBlocks = blocks();
  const auto row = [&](const char* name, std::size_t i = 0) -> Set { return kBlocks.at(name)[i]; };
  Set pt = row("pt"), ps = row("ps"), ptm = row("ptm"), d1 = row("pdl", 0), d2 = row("pdl", 1);
  const double z = in_.altitude_km, dfa = in_.f107a_sfu - 150;

  z_a_ = d2[15];
  T_inf_ = ptm[0] * pt[0] * (z > z_a_ ? 1 + G(pt) : 1);
  T_120_ = ptm[1] * row("pd", 3)[0] * (1 + G(row("pd", 3)));
  s_ = ptm[3] * ps[0] * (1 + G(ps)) / (T_inf_ - T_120_);
  const double ap = ap_amplitude(row("pd", 3));
  const auto low = [&](Set p) { return z < 300 ? G_low(p, ap) : 0; };
  const double means[] = {ptm[6], ptm[2], ptm[7], ptm[4]};
  z_ = {z_a_, 110, 100, 90, 72.5};
  const auto set_top = [&] {
    T_[0] = T_inf_ - (T_inf_ - T_120_) * std::exp(-s_ * zeta(z_a_, 120));
  };
  set_top();
  for (std::size_t k = 0; k < 4; ++k) {
    T_[k + 1] = means[k] * row("ptl", k)[0] / (1 - low(row("ptl", k)));
  }
  bottom_gradient_ = ptm[8] * row("pma", 8)[0] * (1 + low(row("pma", 8))) *
                     std::pow(T_[4] / (ptm[4] * row("ptl", 3)[0]), 2);

  const double air = row("pdm", 2)[4], merging = row("pdm", 2)[3] * d2[5];
  const auto correction = [&](double full, double scale, double height) {
    return std::exp(full / (1 + std::exp((z - height) / scale)));
  };
  const auto correction2 = [&](double full, double scale, double scale2, double height) {
    return std::exp(full /
                    (1 + 0.5 * (std::exp((z - height) / scale) + std::exp((z - height) / scale2))));
  };
  double base = 0;  // density at 120 km of the mixed gas, of the species last asked for
  const auto species = [&](std::size_t m, std::size_t set, double mass, double alpha,
                           double mixed_to, double turbopause) {
    Set pdm = row("pdm", m);
    const double at_120 = pdm[0] * row("pd", set)[0] * std::exp(G(row("pd", set)));
    const double diffusive = density(z, at_120, mass, alpha);
    base = density(turbopause, at_120, mass - air, alpha - 1);
    if (z > mixed_to) return diffusive;
    const double power = merging / (air - mass);
    const double log_ratio = power * std::log(density(z, base, air, 0) / diffusive);
    if (log_ratio < -10) return diffusive;
    if (log_ratio > 10) return density(z, base, air, 0);
    return diffusive * std::pow(1 + std::exp(log_ratio), 1 / power);
  };

  std::array<double, 9> out{};
  const double turbopause_variation = d2[24] * (1 + d1[24] * P(0, 1) * season(1, pt[13]));
  out[2] = species(2, 2, 28, 0, 160, row("pdm", 2)[2] * turbopause_variation);
  const double air_base = base;
  const auto minor = [&](std::size_t m, std::size_t set, double mass, double alpha, double mixed_to,
                         double ratio, double scale, double height) {
    Set pdm = row("pdm", m);
    const double n = species(m, set, mass, alpha, mixed_to, pdm[2]);
    if (z > mixed_to) return n;
    return n *
           correction(std::log(air_base * pdm[1] * ratio / base), pdm[5] * scale, pdm[4] * height);
  };
  const auto chemistry = [&](std::size_t m, double amount, double scale, double height) {
    Set pdm = row("pdm", m);
    return correction(pdm[3] * amount, pdm[7] * scale, pdm[6] * height);
  };
  out[0] = minor(0, 0, 4, -0.38, 199.999, 1, d2[1], d2[0]);
  Set o = row("pdm", 1), o2 = row("pdm", 3), hot = row("pdm", 7);
  out[1] = species(1, 1, 16, 0, 300, o[2]);
  if (z <= 300) {
    out[1] *=
        correction2(o[1] * d2[16] * (1 + d1[23] * dfa), o[5] * d2[3], o[5] * d2[4], o[4] * d2[2]) *
        chemistry(1, d2[14], d2[13], d2[12]);
  }
  out[3] = minor(3, 4, 32, 0, 250, 1, d2[7], d2[6]) *
           correction2(o2[3] * d2[23] * (1 + d1[23] * dfa), o2[7] * d2[22], o2[7] * d1[22],
                       o2[6] * d2[21]);
  out[4] = minor(4, 5, 40, 0.17, 240, 1, d2[9], d2[8]);
  out[5] = minor(5, 6, 1, -0.38, 320, std::abs(d2[17]), d2[11], d2[10]);
  if (z <= 320) out[5] *= chemistry(5, d2[20], d2[19], d2[18]);
  out[6] = minor(6, 7, 14, 0, 450, std::abs(d1[2]), d1[1], d1[0]);
  if (z <= 450) out[6] *= chemistry(6, d1[5], d1[4], d1[3]);

  double unused = 0;
  out[8] = z < z_a_ ? temperature_and_integral(z, unused)
                    : T_inf_ - (T_inf_ - T_120_) * std::exp(-s_ * zeta(z, 120));

  const double hot_at_120 = hot[0] * row("pd", 8)[0] * std::exp(G(row("pd", 8)));
  T_inf_ = T_120_ = hot[9] * d1[6];
  set_top();
  out[7] = density(z, hot_at_120, 16, 0) * std::exp(-hot[5] / (831.4 * T_inf_ / (g(hot[4]) * 16)) *
                                                    (std::exp(-(z - hot[4]) / hot[5]) - 1));
  return out;
}

}  // namespace orrery::term_by_term
