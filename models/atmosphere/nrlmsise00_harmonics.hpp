/// The spherical-harmonic sums of NRLMSISE-00. Not a public header.
#pragma once

#include <orrery/models/atmosphere/nrlmsise00.hpp>
#include <orrery/models/atmosphere/nrlmsise00_tables.hpp>

namespace orrery::nrlmsise00 {

/// Everything the sums need of place and instant, computed once per call and shared by all sets.
/// Names: P20 is the associated Legendre function of degree 2 and order 0 of sin(latitude),
/// unnormalised; its products with local time, longitude and season stand in the order of the
/// tables.
struct Harmonics {
  std::array<double, 19> plain;
  std::array<double, 12> tides;
  std::array<double, 10> tides_annual;
  std::array<double, 12> longitude;
  std::array<double, 6> longitude_annual;
  std::array<double, 3> P1m_odd;     // P11, P31, P51
  std::array<double, 3> P1m_even;    // P21, P41, P61
  std::array<double, 3> P2m;         // P32, P52, P72
  std::array<double, 3> zonal_odd;   // P10, P30, P50
  std::array<double, 3> zonal_even;  // 1, P20, P40
  double P60;
  CosSin year, half_year, ut, hour, east, ut_east;  // ut_east: UT angle plus twice the longitude
  double latitude_deg;
  double df, dfa;  // F10.7 - F10.7A, F10.7A - 150
  double ap_daily;
  std::optional<ApHistory> ap_history;
};

Harmonics harmonics(const Nrlmsise00Input& input);

struct UpperSums {
  Lanes<kUpperLanes> value;     // by Set; "G" of the paper
  double lower_boundary_storm;  // response to ap at 120 km, on which the sets below build
};
UpperSums upper_sums(const UpperTables& tables, const Harmonics& at);

/// @param storm  UpperSums::lower_boundary_storm; below 72.5 km no set responds to it.
template <std::size_t N>
Lanes<N> lower_sums(const LowerTables<N>& tables, const Harmonics& at, double storm);

extern template Lanes<4> lower_sums(const LowerTables<4>&, const Harmonics&, double);
extern template Lanes<6> lower_sums(const LowerTables<6>&, const Harmonics&, double);

}  // namespace orrery::nrlmsise00
