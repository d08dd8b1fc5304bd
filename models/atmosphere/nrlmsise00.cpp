#include <orrery/models/atmosphere/nrlmsise00.hpp>
#include <orrery/models/atmosphere/nrlmsise00_harmonics.hpp>
#include <orrery/models/atmosphere/nrlmsise00_profile.hpp>
#include <orrery/models/atmosphere/nrlmsise00_tables.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

namespace orrery {
namespace nrlmsise00 {
namespace {

constexpr double kMesopause_km = 72.5;       // below: no diffusion, no atoms
constexpr double kStratosphere_km = 32.5;    // below: a spline of its own
constexpr double kFullyMixed_km = 62.5;      // below: composition of the ground
constexpr double kTidalNodes_km = 300;       // above, nodes at 110 to 72.5 km keep their means
constexpr double kHighestMixing_km = 450;    // of any species
constexpr double kAtomicMass_kg = 1.66e-27;  // with the publication's digits
constexpr double kPerCubicMetre = 1e6;       // the coefficients give 1/cm^3

// ---- Arguments

[[noreturn]] void refuse_range(const char* name, double value, const char* unit, double low,
                               double high, bool of_the_model) {
  std::ostringstream what;
  what << "evaluate_nrlmsise00: " << name << " = " << value << " " << unit << "; accepted: " << low
       << " to " << high << " " << unit;
  if (of_the_model && std::isfinite(value)) throw std::domain_error(what.str());
  throw std::invalid_argument(what.str());
}

// Written so that NaN fails.
void check(const char* name, double value, const char* unit, double low, double high,
           bool of_the_model = false) {
  if (!(value >= low && value <= high)) {
    refuse_range(name, value, unit, low, high, of_the_model);
  }
}

void check(const Nrlmsise00Input& in) {
  constexpr double kHighestAp = 400;  // the scale of ap ends there
  check("day_of_year", in.day_of_year, "d", 1, 366);
  check("ut_s", in.ut_s, "s", 0, 86400);
  check("altitude_km", in.altitude_km, "km", 0, 1000, true);
  check("latitude_deg", in.latitude_deg, "deg", -90, 90);
  check("longitude_deg", in.longitude_deg, "deg", -180, 360);
  check("local_solar_time_h", in.local_solar_time_h, "h", 0, 24);
  check("f107a_sfu", in.f107a_sfu, "sfu", 50, 300, true);
  check("f107_sfu", in.f107_sfu, "sfu", 50, 450, true);
  check("ap_daily", in.ap_daily, "(2 nT)", 0, kHighestAp, true);
  if (!in.ap_history) return;
  for (const double ap : *in.ap_history) check("ap_history", ap, "(2 nT)", 0, kHighestAp, true);
}

// ---- Temperature

ThermosphereProfile::Bates bates_parameters(const Tables& t, const UpperSums& sums,
                                            double altitude_km) {
  const auto varied = [&](double mean, Set set) {
    return mean * t.upper.scale[set] * (1 + sums.value[set]);
  };
  // Where they do not matter, the publication leaves variations out.
  const bool above_spline = altitude_km > t.bates_from_km;
  const double exospheric_K =
      above_spline ? varied(t.exospheric_temperature_K, kExosphericTemperature)
                   : t.exospheric_temperature_K * t.upper.scale[kExosphericTemperature];
  const double gradient = altitude_km > kMesopause_km ? varied(t.gradient_Kpkm, kGradient)
                                                      : t.gradient_Kpkm * t.upper.scale[kGradient];
  const double boundary_K = varied(t.lower_boundary_temperature_K, kLowerBoundaryTemperature);
  if (!(boundary_K > 0 && exospheric_K > boundary_K && gradient > 0)) {
    throw std::domain_error(
        "evaluate_nrlmsise00: with these arguments the model's temperature does not rise from 120 "
        "km (" +
        std::to_string(boundary_K) + " K) to the exosphere (" + std::to_string(exospheric_K) +
        " K): F10.7 far from F10.7A, or ap, is beyond what it was fitted to");
  }
  return {.exospheric_K = exospheric_K,
          .boundary_K = boundary_K,
          .shape_pkm = gradient / (exospheric_K - boundary_K),
          .boundary_km = t.lower_boundary_km,
          .lowest_km = t.bates_from_km};
}

/// Temperatures and end gradient of a spline's lower nodes; the last lane in use is the gradient's.
template <std::size_t Nodes>
struct LowerNodes {
  std::array<double, Nodes> temperatures_K;
  double gradient_Kpkm;
};

template <std::size_t Nodes, std::size_t N>
LowerNodes<Nodes> lower_nodes(const LowerTables<N>& table, const Lanes<N>& sums) {
  LowerNodes<Nodes> out{};
  for (std::size_t i = 0; i < Nodes; ++i) {
    out.temperatures_K[i] = table.mean[i] / (1 - sums[i]);
  }
  const double warming = out.temperatures_K[Nodes - 1] / table.mean[Nodes - 1];
  out.gradient_Kpkm = table.mean[Nodes] * (1 + sums[Nodes]) * warming * warming;
  return out;
}

LowerNodes<4> lower_thermosphere(const Tables& t, const Harmonics& at, const UpperSums& sums,
                                 double altitude_km) {
  const bool varies = altitude_km < kTidalNodes_km;
  return lower_nodes<4>(
      t.lower_thermosphere,
      varies ? lower_sums(t.lower_thermosphere, at, sums.lower_boundary_storm) : Lanes<6>{});
}

// ---- Composition above 72.5 km, in logarithms of densities per cm^3

/// ln of a factor exp(R / (1 + exp((z - z0) / h))): R far below z0, 0 far above. Hedin 1983, A20.
double transition(double altitude_km, double full, double scale_km, double height_km) {
  const double e = (altitude_km - height_km) / scale_km;
  if (e > 70) return 0;
  if (e < -70) return full;
  return full / (1 + std::exp(e));
}

/// The same with two scales.
double transition(double altitude_km, double full, double scale_km, double scale2_km,
                  double height_km) {
  const double e1 = (altitude_km - height_km) / scale_km;
  const double e2 = (altitude_km - height_km) / scale2_km;
  if (e1 > 70 || e2 > 70) return 0;
  if (e1 < -70 && e2 < -70) return full;
  return full / (1 + 0.5 * (std::exp(e1) + std::exp(e2)));
}

/// Of diffusive and fully mixed density: the larger by far, and a smooth change in between. A12.
double merged(double ln_diffusive, double ln_mixed, double sharpness) {
  const double difference = sharpness * (ln_mixed - ln_diffusive);
  if (difference < -10) return ln_diffusive;
  if (difference > 10) return ln_mixed;
  return ln_diffusive + std::log(1 + std::exp(difference)) / sharpness;
}

/// Densities at one point above 72.5 km. Holds references: lives on the stack of one call.
class Composition {
 public:
  Composition(const Tables& tables, const UpperSums& sums, const ThermosphereProfile& profile,
              const Nrlmsise00Input& in, double altitude_km, double turbopause_variation)
      : t_(tables),
        sums_(sums),
        profile_(profile),
        altitude_km_(altitude_km),
        here_(profile.at(altitude_km)) {
    flux_factor_ = 1 + t_.departure_dfa * (in.f107a_sfu - 150);
    nitrogen_turbopause_km_ = t_.nitrogen_molecules.turbopause_km * turbopause_variation;
    if (altitude_km_ <= kHighestMixing_km) {
      ln_mixed_nitrogen_base_ = ln_mixed_base(t_.nitrogen_molecules, nitrogen_turbopause_km_);
    }
  }

  double temperature_K() const { return here_.temperature_K; }

  double ln_nitrogen_molecules() const {
    const Species& s = t_.nitrogen_molecules;
    const double ln_diffusive = ln_boundary(s) + ln_ratio(here_, s.mass_amu, s.thermal_diffusion);
    if (altitude_km_ > s.mixed_up_to_km) return ln_diffusive;
    return merged(ln_diffusive, ln_mixed_nitrogen(), sharpness(s));
  }

  /// What N2 would be, were it mixed with the air of the ground. Up to 160 km.
  double ln_mixed_nitrogen() const {
    return ln_mixed_nitrogen_base_ + ln_ratio(here_, t_.mean_mass_amu, 0);
  }

  /// He, Ar, H, N: mixed below the turbopause, corrected to the mixing ratio at the ground,
  /// chemistry.
  double ln_minor(const Species& s) const {
    const Merged density = ln_merged(s);
    if (!density.mixing) return density.ln_value;
    const double to_ground = ln_mixed_nitrogen_base_ + s.ln_mixing_ratio - density.ln_base;
    double ln_value = density.ln_value +
                      transition(altitude_km_, to_ground, s.mixing_scale_km, s.mixing_height_km);
    if (s.chemistry != 0) ln_value += ln_chemistry(s);
    return ln_value;
  }

  double ln_oxygen() const {
    const Species& s = t_.oxygen;
    const Merged density = ln_merged(s);
    if (!density.mixing) return density.ln_value;
    return density.ln_value +
           transition(altitude_km_, t_.oxygen_ratio * flux_factor_, s.mixing_scale_km,
                      t_.oxygen_scale2_km, s.mixing_height_km) +
           ln_chemistry(s);
  }

  double ln_oxygen_molecules() const {
    return ln_minor(t_.oxygen_molecules) + transition(altitude_km_,
                                                      t_.oxygen_molecules_departure * flux_factor_,
                                                      t_.oxygen_molecules_departure_scale_km,
                                                      t_.oxygen_molecules_departure_scale2_km,
                                                      t_.oxygen_molecules_departure_height_km);
  }

 private:
  struct Merged {
    double ln_value;
    double ln_base = 0;
    bool mixing = false;
  };

  double ln_ratio(const ThermosphereProfile::Point& point, double mass_amu,
                  double diffusion) const {
    return profile_.ln_density_ratio(point, mass_amu, diffusion);
  }
  double ln_boundary(const Species& s) const { return s.ln_boundary_density + sums_.value[s.set]; }
  double sharpness(const Species& s) const {
    return t_.merging_scale_km / (t_.mean_mass_amu - s.mass_amu);
  }
  double ln_chemistry(const Species& s) const {
    return transition(altitude_km_, s.chemistry, s.chemistry_scale_km, s.chemistry_height_km);
  }

  /// Density at 120 km of a gas with the mean mass that equals the species' at its turbopause.
  double ln_mixed_base(const Species& s, double turbopause_km) const {
    return ln_boundary(s) + ln_ratio(profile_.at(turbopause_km), s.mass_amu - t_.mean_mass_amu,
                                     s.thermal_diffusion - 1);
  }

  Merged ln_merged(const Species& s) const {
    const double ln_diffusive = ln_boundary(s) + ln_ratio(here_, s.mass_amu, s.thermal_diffusion);
    if (altitude_km_ > s.mixed_up_to_km) return {ln_diffusive};
    const double ln_base = ln_mixed_base(s, s.turbopause_km);
    const double ln_mixed = ln_base + ln_ratio(here_, t_.mean_mass_amu, 0);
    return {merged(ln_diffusive, ln_mixed, sharpness(s)), ln_base, true};
  }

  const Tables& t_;
  const UpperSums& sums_;
  const ThermosphereProfile& profile_;
  double altitude_km_;
  ThermosphereProfile::Point here_;
  double flux_factor_ = 1, nitrogen_turbopause_km_ = 0, ln_mixed_nitrogen_base_ = 0;
};

/// Oxygen that does not share the temperature of the rest: its own isothermal profile, with a
/// source.
double ln_anomalous_oxygen(const Tables& t, const UpperSums& sums, const Gravity& gravity,
                           ThermosphereProfile::Bates bates,
                           const std::optional<ThermosphereProfile::Lower>& lower,
                           double altitude_km) {
  const double mass_amu = t.oxygen.mass_amu;
  bates.exospheric_K = bates.boundary_K = t.anomalous_temperature_K;
  const ThermosphereProfile profile(gravity, bates, lower);
  const double scale_height_km =
      kGasConstant * t.anomalous_temperature_K / (gravity.at(t.anomalous_height_km) * mass_amu);
  const double above = (altitude_km - t.anomalous_height_km) / t.anomalous_scale_km;
  return t.ln_anomalous_density + sums.value[kAnomalousOxygen] +
         profile.ln_density_ratio(profile.at(altitude_km), mass_amu, 0) -
         t.anomalous_scale_km / scale_height_km * (std::exp(-above) - 1);
}

double per_m3(double ln_pcm3) {
  return kPerCubicMetre * std::exp(ln_pcm3);
}

void add_densities(Nrlmsise00Output& out) {
  const double without_anomalous = 4 * out.helium_pm3 + 16 * out.oxygen_pm3 +
                                   28 * out.nitrogen_molecules_pm3 + 32 * out.oxygen_molecules_pm3 +
                                   40 * out.argon_pm3 + out.hydrogen_pm3 + 14 * out.nitrogen_pm3;
  out.density_kgpm3 = kAtomicMass_kg * without_anomalous;
  out.drag_density_kgpm3 = kAtomicMass_kg * (without_anomalous + 16 * out.anomalous_oxygen_pm3);
}

// ---- Composition below 72.5 km

/// The atmosphere at 72.5 km, on which the mesosphere hangs.
struct Mesopause {
  Nrlmsise00Output output;
  double mixed_nitrogen_pm3 = 0;
  double temperature_K = 0, gradient_Kpkm = 0;
};

struct DensityAndTemperature {
  double density_ratio, temperature_K;  // ratio to 72.5 km
};

DensityAndTemperature below_mesopause(const Tables& t, const Harmonics& at, const Gravity& gravity,
                                      const Mesopause& top, double altitude_km) {
  const auto nodes = lower_nodes<3>(t.mesosphere, lower_sums(t.mesosphere, at, 0));
  const auto& T = nodes.temperatures_K;
  const std::array<double, 4> heights_km{kMesopause_km, 55, 45, kStratosphere_km};
  const std::array<double, 4> temperatures_K{top.temperature_K, T[0], T[1], T[2]};
  const InverseTemperatureSpline upper(gravity, heights_km, temperatures_K, top.gradient_Kpkm,
                                       nodes.gradient_Kpkm);
  const auto density = [&](const InverseTemperatureSpline& spline,
                           const InverseTemperatureSpline::Point& point) {
    return spline.top_temperature_K() / point.temperature_K *
           std::exp(spline.pressure_exponent(point, t.mean_mass_amu));
  };
  const auto upper_point = upper.at(altitude_km);
  const double upper_ratio = density(upper, upper_point);
  if (altitude_km > kStratosphere_km) return {upper_ratio, upper_point.temperature_K};

  const auto low = lower_nodes<4>(t.stratosphere, lower_sums(t.stratosphere, at, 0));
  const auto& L = low.temperatures_K;
  const std::array<double, 5> low_heights_km{kStratosphere_km, 20, 15, 10, 0};
  const std::array<double, 5> low_temperatures_K{T[2], L[0], L[1], L[2], L[3]};
  const InverseTemperatureSpline lower(gravity, low_heights_km, low_temperatures_K,
                                       nodes.gradient_Kpkm, low.gradient_Kpkm);
  const auto lower_point = lower.at(altitude_km);
  return {upper_ratio * density(lower, lower_point), lower_point.temperature_K};
}

/// The composition goes over to that of the ground between 72.5 and 62.5 km.
Nrlmsise00Output mixed_composition(const Tables& t, const Mesopause& top,
                                   const DensityAndTemperature& here, double altitude_km) {
  const double diffusive = altitude_km > kFullyMixed_km ? 1 - (kMesopause_km - altitude_km) /
                                                                  (kMesopause_km - kFullyMixed_km)
                                                        : 0;
  const auto going_over = [&](double mixed, double ratio_at_top) {
    return mixed * (1 + (ratio_at_top - 1) * diffusive);
  };
  const double top_nitrogen = top.output.nitrogen_molecules_pm3;
  Nrlmsise00Output out;
  out.exospheric_temperature_K = top.output.exospheric_temperature_K;
  out.temperature_K = here.temperature_K;
  const double nitrogen = going_over(top.mixed_nitrogen_pm3 * here.density_ratio,
                                     top_nitrogen / top.mixed_nitrogen_pm3);
  const auto minor = [&](double fraction, double at_top) {
    return going_over(nitrogen * fraction, at_top / (top_nitrogen * fraction));
  };
  out.nitrogen_molecules_pm3 = nitrogen;
  out.helium_pm3 = minor(t.helium_fraction, top.output.helium_pm3);
  out.oxygen_molecules_pm3 = minor(t.oxygen_molecules_fraction, top.output.oxygen_molecules_pm3);
  out.argon_pm3 = minor(t.argon_fraction, top.output.argon_pm3);
  return out;
}

// ---- The whole model

/// The thermosphere down to 72.5 km; of `altitude_km` rather than the input's altitude.
Mesopause thermosphere(const Tables& t, const Harmonics& at, const Gravity& gravity,
                       const Nrlmsise00Input& in, double altitude_km) {
  const UpperSums sums = upper_sums(t.upper, at);
  const auto bates = bates_parameters(t, sums, altitude_km);
  std::optional<ThermosphereProfile::Lower> lower;
  if (altitude_km <= kHighestMixing_km) {
    const LowerNodes<4> nodes = lower_thermosphere(t, at, sums, altitude_km);
    lower = {nodes.temperatures_K, nodes.gradient_Kpkm};
  }
  const ThermosphereProfile profile(gravity, bates, lower);

  const double season = t.upper.annual_phase.at(kExosphericTemperature, at.year);
  const double turbopause_variation =
      t.turbopause_factor * (1 + t.turbopause_annual * at.zonal_odd[0] * season);
  const Composition composition(t, sums, profile, in, altitude_km, turbopause_variation);

  Mesopause out;
  Nrlmsise00Output& o = out.output;
  o.helium_pm3 = per_m3(composition.ln_minor(t.helium));
  o.oxygen_pm3 = per_m3(composition.ln_oxygen());
  o.nitrogen_molecules_pm3 = per_m3(composition.ln_nitrogen_molecules());
  o.oxygen_molecules_pm3 = per_m3(composition.ln_oxygen_molecules());
  o.argon_pm3 = per_m3(composition.ln_minor(t.argon));
  o.hydrogen_pm3 = per_m3(composition.ln_minor(t.hydrogen));
  o.nitrogen_pm3 = per_m3(composition.ln_minor(t.nitrogen));
  o.anomalous_oxygen_pm3 = per_m3(ln_anomalous_oxygen(t, sums, gravity, bates, lower, altitude_km));
  o.exospheric_temperature_K = bates.exospheric_K;
  o.temperature_K = out.temperature_K = composition.temperature_K();
  if (lower) out.gradient_Kpkm = lower->bottom_gradient_Kpkm;
  if (altitude_km <= kMesopause_km) {
    out.mixed_nitrogen_pm3 = per_m3(composition.ln_mixed_nitrogen());
  }
  return out;
}

}  // namespace
}  // namespace nrlmsise00

Nrlmsise00Output evaluate_nrlmsise00(const Nrlmsise00Input& input) {
  using namespace nrlmsise00;
  check(input);
  const Tables& t = tables();
  const Harmonics at = harmonics(input);
  const double sine = at.zonal_odd[0];
  const Gravity gravity = gravity_at_latitude(1 - 2 * sine * sine);

  const Mesopause top =
      thermosphere(t, at, gravity, input, std::max(input.altitude_km, kMesopause_km));
  Nrlmsise00Output out = top.output;
  if (input.altitude_km < kMesopause_km) {
    const auto here = below_mesopause(t, at, gravity, top, input.altitude_km);
    out = mixed_composition(t, top, here, input.altitude_km);
  }
  add_densities(out);
  return out;
}

}  // namespace orrery
