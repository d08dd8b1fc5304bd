/// NRLMSISE-00: composition, density and temperature of the atmosphere from the ground to 1000 km.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <array>
#include <optional>

namespace orrery {

/// Geomagnetic activity that led up to an instant, as the model weighs it [2 nT]:
/// [0] daily Ap; three-hourly ap [1] of the running interval, [2] to [4] of the three before it;
/// mean of the eight three-hourly ap [5] from 12 to 33 h and [6] from 36 to 57 h before.
using ApHistory = std::array<double, 7>;

/// Arguments in the units of the publication.
struct Nrlmsise00Input {
  int day_of_year = 1;       // 1 to 366
  double ut_s = 0;           // seconds of the UT day, 0 to 86400
  double altitude_km = 0;    // above the ellipsoid, 0 to 1000
  double latitude_deg = 0;   // geodetic, -90 to 90
  double longitude_deg = 0;  // east, -180 to 360
  double local_solar_time_h =
      0;                   // 0 to 24; ut_s / 3600 + longitude_deg / 15 but for the equation of time
  double f107a_sfu = 150;  // mean of 81 days centred on the day, 50 to 300
  double f107_sfu = 150;   // of the day before, as observed, 50 to 450
  double ap_daily = 4;     // 0 to 400
  std::optional<ApHistory> ap_history;  // when given, used instead of ap_daily ("switch 9 = -1")
};

struct Nrlmsise00Output {
  // Number densities [1/m^3]. Below 72.5 km the model has no O, H, N and anomalous O: they are 0.
  double helium_pm3 = 0;
  double oxygen_pm3 = 0;
  double nitrogen_molecules_pm3 = 0;
  double oxygen_molecules_pm3 = 0;
  double argon_pm3 = 0;
  double hydrogen_pm3 = 0;
  double nitrogen_pm3 = 0;
  double anomalous_oxygen_pm3 = 0;  // not in thermal equilibrium; matters above 500 km
  double density_kgpm3 = 0;         // gtd7: without anomalous oxygen
  double drag_density_kgpm3 = 0;    // gtd7d: with it; what satellite drag is computed from
  double exospheric_temperature_K = 0;
  double temperature_K = 0;  // at the altitude
};

/// The model at one place and instant. Pure: it keeps nothing between calls, so the order of calls
/// and the number of spacecraft and threads change no bit. About 1 us.
///
/// Method   Bates temperature profile above 123 km and cubic splines of 1/T in geopotential height
/// below;
///          its parameters and the densities at 120 km are spherical harmonics of latitude, local
///          time, season, solar flux and geomagnetic activity; diffusive equilibrium merged with
///          full mixing below the turbopause, chemistry corrections. J. M. Picone, A. E. Hedin, D.
///          P. Drob, A. C. Aikin, J. Geophys. Res. 107(A12), 1468, 2002; coefficients of the
///          published model (models/data). All optional variations on: switches 1 to 23 of the
///          publication are 1.
/// Differs  from the equations as published by 1e-13: sums are taken in another order, and
/// densities stay
///          logarithms until the end.
/// Bits     the same from g++ and clang, with and without optimisation, on one C library.
/// Checked  test_suites/validation/models/atmosphere/nrlmsise00_test.cpp, 17 published cases, and
///          test_suites/unit/models/atmosphere/nrlmsise00_equations_test.cpp, term by term
/// @throws std::invalid_argument  an argument that is not finite, or a day, time or angle out of
/// range.
/// @throws std::domain_error  altitude, F10.7 or ap out of range, or a combination of them for
/// which the
///         published model has no physical temperature. Seen for a daily Ap from 200 between 110
///         and 124 km, near 400 below 300 km, and for F10.7 far from F10.7A.
Nrlmsise00Output evaluate_nrlmsise00(const Nrlmsise00Input& input);

}  // namespace orrery
