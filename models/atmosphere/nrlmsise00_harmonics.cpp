#include <orrery/models/atmosphere/nrlmsise00_harmonics.hpp>

#include <algorithm>
#include <cmath>

namespace orrery::nrlmsise00 {
namespace {

// ---- Sums over all sets at once. Each set is summed in the order of its terms, whatever registers
// the compiler uses.

template <std::size_t Terms, std::size_t N>
Lanes<N> sum(const TermTable<Terms, N>& coefficients, const std::array<double, Terms>& basis) {
  Lanes<N> out{};
  for (std::size_t k = 0; k < Terms; ++k) {
    for (std::size_t i = 0; i < N; ++i) out[i] += coefficients[k][i] * basis[k];
  }
  return out;
}

template <std::size_t N>
Lanes<N> cosine(const PhaseTable<N>& phase, const CosSin& angle) {
  Lanes<N> out{};
  for (std::size_t i = 0; i < N; ++i) out[i] = phase.at(i, angle);
  return out;
}

// ---- Legendre functions and angles

constexpr int kOrders = 4, kDegrees = 8;

/// P[m][n], unnormalised and without the factor (-1)^m: 3 cos^2 = P[2][2].
struct Legendre {
  double P[kOrders][kDegrees];
};

/// Upward recursion in degree, with its factors as constants.
struct LegendreFactors {
  double first[kOrders][kDegrees] = {}, second[kOrders][kDegrees] = {};
  constexpr LegendreFactors() {
    for (int m = 0; m < kOrders; ++m) {
      for (int n = m + 1; n < kDegrees; ++n) {
        first[m][n] = (2.0 * n - 1) / (n - m);
        second[m][n] = (n + m - 1.0) / (n - m);
      }
    }
  }
};
constexpr LegendreFactors kFactors;

Legendre legendre(const CosSin& latitude) {
  Legendre out;
  double sectorial = 1;
  for (int m = 0; m < kOrders; ++m) {
    if (m > 0) sectorial *= (2 * m - 1) * latitude.cosine;
    double previous = 0, current = sectorial;
    out.P[m][m] = current;
    for (int n = m + 1; n < kDegrees; ++n) {
      const double next =
          kFactors.first[m][n] * latitude.sine * current - kFactors.second[m][n] * previous;
      out.P[m][n] = next;
      previous = current;
      current = next;
    }
  }
  return out;
}

CosSin cos_sin(double angle_rad) {
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

CosSin plus(const CosSin& a, const CosSin& b) {
  return {a.cosine * b.cosine - a.sine * b.sine, a.sine * b.cosine + a.cosine * b.sine};
}

// ---- Geomagnetic activity

/// How one value of ap heats: grows from 0 at ap = 4, ever more slowly. Picone et al. 2002, A24d.
double storm_response(const StormShape& shape, double ap) {
  const double above_quiet = ap - 4;
  return above_quiet +
         (shape.slope - 1) * (above_quiet + (std::exp(-shape.rate * above_quiet) - 1) / shape.rate);
}

Lanes<kUpperLanes> daily_amplitude(const UpperTables& tables, const Harmonics& at) {
  const StormTables<kUpperLanes>& storm = tables.daily_storm;
  Lanes<kUpperLanes> response{}, out{};
  for (std::size_t j = 0; j < storm.count; ++j) {
    response[j] = storm_response(storm.shapes[j], at.ap_daily);
  }
  for (std::size_t i = 0; i < kUpperLanes; ++i) out[i] = response[storm.shape_of[i]];
  return out;
}

/// Weighted mean of the responses to the history, `fading` being the weight lost in three hours.
/// A24a-c.
double faded(const std::array<double, 7>& response, double fading) {
  const double f2 = fading * fading, f3 = f2 * fading, f4 = f2 * f2, f8 = f4 * f4, f12 = f8 * f4;
  const double f19 = f12 * f4 * f3;
  const double rest = 1 / (1 - fading);
  const double weight = 1 + (1 - f19) * rest * std::sqrt(fading);
  return (response[1] + response[2] * fading + response[3] * f2 + response[4] * f3 +
          (response[5] * f4 + response[6] * f12) * (1 - f8) * rest) /
         weight;
}

Lanes<kUpperLanes> history_amplitude(const UpperTables& tables, const Harmonics& at) {
  constexpr double kThreeHours_s = 10800, kSlowest = 0.99999;
  const StormTables<kUpperLanes>& storm = tables.history_storm;
  std::array<std::array<double, 7>, kUpperLanes> response{};
  for (std::size_t j = 0; j < storm.count; ++j) {
    for (std::size_t k = 1; k < 7; ++k) {
      response[j][k] = storm_response(storm.shapes[j], (*at.ap_history)[k]);
    }
  }
  Lanes<kUpperLanes> out{};
  for (std::size_t i = 0; i < kUpperLanes; ++i) {
    if (tables.history_decay[i] == 0) continue;  // this set knows the daily Ap only
    const double latitude = 1 + tables.history_decay_latitude[i] * (45 - std::abs(at.latitude_deg));
    const double fading = std::exp(-kThreeHours_s * std::abs(tables.history_decay[i]) / latitude);
    out[i] = faded(response[storm.shape_of[i]], std::min(fading, kSlowest));
  }
  return out;
}

/// All that magnetic activity adds, by universal time, longitude and local time.
Lanes<kUpperLanes> magnetic(const MagneticTables<kUpperLanes>& t, const Harmonics& at,
                            const Lanes<kUpperLanes>& amplitude, const Lanes<kUpperLanes>& annual) {
  const auto zonal = sum(t.zonal, at.zonal_even), zonal_annual = sum(t.zonal_annual, at.zonal_odd),
             diurnal = sum(t.diurnal, at.P1m_odd), longitude = sum(t.longitude, at.P1m_even),
             longitude_annual = sum(t.longitude_annual, at.P1m_odd), ut = sum(t.ut, at.zonal_odd);
  const auto diurnal_cosine = cosine(t.diurnal_phase, at.hour),
             longitude_cosine = cosine(t.longitude_phase, at.east),
             longitude_annual_cosine = cosine(t.longitude_annual_phase, at.east),
             ut_cosine = cosine(t.ut_phase, at.ut);
  Lanes<kUpperLanes> out{};
  for (std::size_t i = 0; i < kUpperLanes; ++i) {
    out[i] = amplitude[i] *
             (zonal[i] + zonal_annual[i] * annual[i] + diurnal[i] * diurnal_cosine[i] +
              (1 + t.longitude_P10[i] * at.zonal_odd[0]) * longitude[i] * longitude_cosine[i] +
              longitude_annual[i] * annual[i] * longitude_annual_cosine[i] + ut[i] * ut_cosine[i]);
  }
  return out;
}

/// Terms of longitude and universal time without magnetic activity.
Lanes<kUpperLanes> longitude_and_ut(const UpperTables& t, const Harmonics& at,
                                    const Lanes<kUpperLanes>& annual) {
  const auto longitude = sum(t.longitude, at.longitude),
             longitude_annual = sum(t.longitude_annual, at.longitude_annual),
             ut = sum(t.ut, at.zonal_odd), ut_longitude = sum(t.ut_longitude, at.P2m);
  const auto ut_cosine = cosine(t.ut_phase, at.ut),
             ut_longitude_cosine = cosine(t.ut_longitude_phase, at.ut_east);
  const double P10 = at.zonal_odd[0];
  Lanes<kUpperLanes> out{};
  for (std::size_t i = 0; i < kUpperLanes; ++i) {
    out[i] = (1 + t.longitude_dfa[i] * at.dfa) * (longitude[i] + longitude_annual[i] * annual[i]) +
             (1 + t.ut_P10[i] * P10) * (1 + t.ut_dfa[i] * at.dfa) *
                 (1 + t.ut_annual_P10[i] * P10 * annual[i]) * ut[i] * ut_cosine[i] +
             ut_longitude[i] * ut_longitude_cosine[i] * (1 + t.ut_longitude_dfa[i] * at.dfa);
  }
  return out;
}

// ---- Products of Legendre functions with angles, in the order of the tables

void fill_flux_and_season(Harmonics& at, const Legendre& l, double f107a, double f107) {
  at.df = f107 - f107a;
  at.dfa = f107a - 150;
  const auto& P0 = l.P[0];
  const CosSin &year = at.year, &half = at.half_year;
  at.plain = {1,
              at.df,
              at.df * at.dfa,
              at.df * at.df,
              at.dfa,
              at.dfa * at.dfa,
              P0[2],
              P0[4],
              P0[6],
              P0[2] * at.dfa,
              P0[1],
              year.cosine,
              year.sine,
              half.cosine,
              half.sine,
              P0[2] * half.cosine,
              P0[2] * half.sine,
              P0[1] * half.cosine,
              P0[1] * half.sine};
}

void fill_tides(Harmonics& at, const Legendre& l) {
  const auto &P1 = l.P[1], &P2 = l.P[2], &P3 = l.P[3];
  const CosSin day = at.hour, half = plus(day, day), third = plus(half, day);
  at.tides = {P1[1] * day.cosine, P1[3] * day.cosine, P1[5] * day.cosine,  P1[1] * day.sine,
              P1[3] * day.sine,   P1[5] * day.sine,   P2[2] * half.cosine, P2[4] * half.cosine,
              P2[2] * half.sine,  P2[4] * half.sine,  P3[3] * third.sine,  P3[3] * third.cosine};
  at.tides_annual = {P1[2] * day.cosine,  P1[2] * day.sine,   P2[3] * half.cosine,
                     P2[5] * half.cosine, P2[3] * half.sine,  P2[5] * half.sine,
                     P3[4] * third.sine,  P3[6] * third.sine, P3[4] * third.cosine,
                     P3[6] * third.cosine};
}

void fill_longitude(Harmonics& at) {
  for (std::size_t k = 0; k < 3; ++k) {
    at.longitude[k] = at.P1m_even[k] * at.east.cosine;
    at.longitude[k + 3] = at.longitude_annual[k] = at.P1m_odd[k] * at.east.cosine;
    at.longitude[k + 6] = at.P1m_even[k] * at.east.sine;
    at.longitude[k + 9] = at.longitude_annual[k + 3] = at.P1m_odd[k] * at.east.sine;
  }
}

}  // namespace

Harmonics harmonics(const Nrlmsise00Input& input) {
  Harmonics at;
  at.latitude_deg = input.latitude_deg;
  at.ap_daily = input.ap_daily;
  at.ap_history = input.ap_history;
  at.year = cos_sin(kDay_rad * input.day_of_year);
  at.half_year = plus(at.year, at.year);
  at.ut = cos_sin(kSecond_rad * input.ut_s);
  at.hour = cos_sin(kHour_rad * input.local_solar_time_h);
  at.east = cos_sin(kDegree_rad * input.longitude_deg);
  at.ut_east = plus(at.ut, plus(at.east, at.east));

  const Legendre l = legendre(cos_sin(kDegree_rad * input.latitude_deg));
  at.P1m_odd = {l.P[1][1], l.P[1][3], l.P[1][5]};
  at.P1m_even = {l.P[1][2], l.P[1][4], l.P[1][6]};
  at.P2m = {l.P[2][3], l.P[2][5], l.P[2][7]};
  at.zonal_odd = {l.P[0][1], l.P[0][3], l.P[0][5]};
  at.zonal_even = {1, l.P[0][2], l.P[0][4]};
  at.P60 = l.P[0][6];
  fill_flux_and_season(at, l, input.f107a_sfu, input.f107_sfu);
  fill_tides(at, l);
  fill_longitude(at);
  return at;
}

UpperSums upper_sums(const UpperTables& t, const Harmonics& at) {
  const Lanes<kUpperLanes> annual = cosine(t.annual_phase, at.year);
  const Lanes<kUpperLanes> storm =
      at.ap_history ? history_amplitude(t, at) : daily_amplitude(t, at);
  const auto plain = sum(t.plain, at.plain), tides = sum(t.tides, at.tides),
             tides_annual = sum(t.tides_annual, at.tides_annual),
             asymmetric = sum(t.annual, {at.zonal_odd[0], at.zonal_odd[1]}),
             east = longitude_and_ut(t, at, annual),
             storm_terms = magnetic(at.ap_history ? t.history : t.daily, at, storm, annual);
  UpperSums out{{}, storm[kLowerBoundaryTemperature]};
  for (std::size_t i = 0; i < kUpperLanes; ++i) {
    const double flux = 1 + t.flux_df[i] * at.df + t.flux_df2[i] * at.df * at.df;
    out.value[i] = plain[i] + (flux + t.f1_dfa[i] * at.dfa) * asymmetric[i] * annual[i] +
                   (flux + t.f2_dfa[i] * at.dfa) * (tides[i] + tides_annual[i] * annual[i]) +
                   east[i] + storm_terms[i];
  }
  return out;
}

template <std::size_t N>
Lanes<N> lower_sums(const LowerTables<N>& t, const Harmonics& at, double storm) {
  const auto plain = sum(t.plain, {at.dfa, at.zonal_even[1], at.zonal_even[2], at.P60,
                                   at.zonal_odd[0], at.zonal_odd[1], at.zonal_odd[2]});
  const auto symmetric = sum(t.annual_symmetric, at.zonal_even),
             semiannual = sum(t.semiannual, at.zonal_even), annual = sum(t.annual, at.zonal_odd);
  const auto symmetric_cosine = cosine(t.annual_symmetric_phase, at.year),
             semiannual_cosine = cosine(t.semiannual_phase, at.half_year),
             annual_cosine = cosine(t.annual_phase, at.year),
             asymmetric_cosine = cosine(t.semiannual_asymmetric_phase, at.half_year);
  const auto tides = sum(t.tides, at.tides), tides_annual = sum(t.tides_annual, at.tides_annual);
  const auto magnetic_terms =
      sum(at.ap_history ? t.history : t.daily, {storm, storm * at.zonal_even[1]});
  const auto longitude = sum(t.longitude, at.longitude);
  const auto a1 = cosine(t.longitude_annual_P10_phase, at.year),
             a2 = cosine(t.longitude_semiannual_P10_phase, at.half_year),
             a3 = cosine(t.longitude_annual_phase, at.year),
             a4 = cosine(t.longitude_semiannual_phase, at.half_year);
  const double P10 = at.zonal_odd[0];
  Lanes<N> out{};
  for (std::size_t i = 0; i < N; ++i) {
    const double season =
        1 + P10 * (t.longitude_annual_P10[i] * a1[i] + t.longitude_semiannual_P10[i] * a2[i]) +
        t.longitude_annual[i] * a3[i] + t.longitude_semiannual[i] * a4[i];
    out[i] = plain[i] + symmetric[i] * symmetric_cosine[i] + semiannual[i] * semiannual_cosine[i] +
             annual[i] * annual_cosine[i] +
             t.semiannual_asymmetric[i] * P10 * asymmetric_cosine[i] + tides[i] +
             tides_annual[i] * annual_cosine[i] + magnetic_terms[i] + season * longitude[i];
  }
  return out;
}

template Lanes<4> lower_sums(const LowerTables<4>&, const Harmonics&, double);
template Lanes<6> lower_sums(const LowerTables<6>&, const Harmonics&, double);

}  // namespace orrery::nrlmsise00
