/// Coefficients of NRLMSISE-00 in the order in which they are used. Not a public header.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <array>
#include <cstddef>
#include <string_view>

namespace orrery::nrlmsise00 {

/// One number for each of N coefficient sets. Arithmetic runs through all sets at once, so that the
/// harmonics, which are the same for all, are computed once and compilers can use vector registers
/// without changing the order in which any one set is summed.
template <std::size_t N>
using Lanes = std::array<double, N>;

template <std::size_t Terms, std::size_t N>
using TermTable = std::array<Lanes<N>, Terms>;

struct CosSin {
  double cosine = 1, sine = 0;
};

/// cos(angle - phase) for each set, from the angle's cosine and sine.
template <std::size_t N>
struct PhaseTable {
  Lanes<N> cosine, sine;

  double at(std::size_t set, const CosSin& angle) const {
    return cosine[set] * angle.cosine + sine[set] * angle.sine;
  }
};

/// Response to the daily Ap and to the ap history have the same form, with coefficients of their
/// own.
template <std::size_t N>
struct MagneticTables {
  TermTable<3, N> zonal, zonal_annual, diurnal, longitude, longitude_annual, ut;
  PhaseTable<N> diurnal_phase, longitude_phase, longitude_annual_phase, ut_phase;
  Lanes<N> longitude_P10;
};

/// Saturation of the response to ap: a function of ap with two parameters. Most sets share theirs.
struct StormShape {
  double rate = 0, slope = 0;
};
template <std::size_t N>
struct StormTables {
  std::array<StormShape, N> shapes;  // the first `count` are distinct
  std::size_t count = 0;
  std::array<std::size_t, N> shape_of;  // set -> index in shapes
};

/// Sets of the thermosphere ("globe7"): what each of their harmonic sums modulates.
enum Set : std::size_t {
  kExosphericTemperature,
  kGradient,
  kHelium,
  kOxygen,
  kNitrogenMolecules,
  kLowerBoundaryTemperature,
  kOxygenMolecules,
  kArgon,
  kHydrogen,
  kNitrogen,
  kAnomalousOxygen,
  kSets
};
constexpr std::size_t kUpperLanes = 12;  // an even number, for vector registers

struct UpperTables {
  using L = Lanes<kUpperLanes>;
  L scale;  // first coefficient of each set
  TermTable<19, kUpperLanes> plain;
  L f1_dfa, f2_dfa, flux_df, flux_df2;  // modulation of annual and tidal terms by solar flux
  TermTable<2, kUpperLanes> annual;
  TermTable<12, kUpperLanes> tides;
  TermTable<10, kUpperLanes> tides_annual;
  TermTable<12, kUpperLanes> longitude;
  TermTable<6, kUpperLanes> longitude_annual;
  TermTable<3, kUpperLanes> ut, ut_longitude;
  L longitude_dfa, ut_P10, ut_dfa, ut_annual_P10, ut_longitude_dfa;
  PhaseTable<kUpperLanes> annual_phase, ut_phase, ut_longitude_phase;
  MagneticTables<kUpperLanes> daily, history;
  StormTables<kUpperLanes> daily_storm, history_storm;
  L history_decay, history_decay_latitude;
};

/// Sets of the lower atmosphere ("glob7s").
template <std::size_t N>
struct LowerTables {
  Lanes<N> mean;  // mean of the temperature [K] or gradient [K/km] that the set modulates
  TermTable<7, N> plain;
  TermTable<3, N> annual_symmetric, semiannual, annual;
  Lanes<N> semiannual_asymmetric;
  PhaseTable<N> annual_symmetric_phase, semiannual_phase, annual_phase, semiannual_asymmetric_phase;
  TermTable<12, N> tides;
  TermTable<10, N> tides_annual;
  TermTable<12, N> longitude;
  // Four seasonal modulations of the longitude terms: annual and semiannual, each with and without
  // P10.
  Lanes<N> longitude_annual_P10, longitude_semiannual_P10, longitude_annual, longitude_semiannual;
  PhaseTable<N> longitude_annual_P10_phase, longitude_semiannual_P10_phase, longitude_annual_phase,
      longitude_semiannual_phase;
  TermTable<2, N> daily, history;  // magnetic activity
};

/// Constants of one species at and below the turbopause.
struct Species {
  Set set;
  double mass_amu, thermal_diffusion;
  double mixed_up_to_km;       // above, mixing is not computed
  double ln_boundary_density;  // of the mean density at 120 km [1/cm^3]
  double turbopause_km;
  double ln_mixing_ratio;                    // to N2, at the ground
  double mixing_height_km, mixing_scale_km;  // where and how fast the density goes over to it
  double chemistry, chemistry_height_km, chemistry_scale_km;
};

struct Tables {
  UpperTables upper;
  LowerTables<6> lower_thermosphere;  // T at 110, 100, 90, 72.5 km, gradient at 72.5 km
  LowerTables<4> mesosphere;          // T at 55, 45, 32.5 km, gradient at 32.5 km
  LowerTables<6> stratosphere;        // T at 20, 15, 10, 0 km, gradient at 0 km
  Species helium, oxygen, nitrogen_molecules, oxygen_molecules, argon, hydrogen, nitrogen;
  // Second forms of the correction, of oxygen and oxygen molecules, grow with F10.7A.
  double oxygen_ratio, oxygen_scale2_km;
  double oxygen_molecules_departure, oxygen_molecules_departure_height_km,
      oxygen_molecules_departure_scale_km, oxygen_molecules_departure_scale2_km;
  double departure_dfa;
  double lower_boundary_km, lower_boundary_temperature_K, gradient_Kpkm, exospheric_temperature_K;
  double bates_from_km;  // the Bates profile goes down to here
  double turbopause_factor, turbopause_annual;
  double merging_scale_km, mean_mass_amu;
  double anomalous_temperature_K, anomalous_height_km, anomalous_scale_km, ln_anomalous_density;
  double helium_fraction, oxygen_molecules_fraction, argon_fraction;  // of N2, below 62.5 km
};

/// The model's own, read from the compiled-in text once and constant from then on.
const Tables& tables();

/// @throws std::invalid_argument  with source and line: text that is not the model's complete
/// table.
Tables parse_tables(std::string_view text, std::string_view source_name);

// Angular rates of the publication, with its digits.
constexpr double kDay_rad = 1.72142e-2;    // per day of the year
constexpr double kSecond_rad = 7.2722e-5;  // per second of UT
constexpr double kHour_rad = 0.2618;       // per hour of local time
constexpr double kDegree_rad = 1.74533e-2;

}  // namespace orrery::nrlmsise00
