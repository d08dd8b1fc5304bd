/// Temperature profiles of NRLMSISE-00 and the densities that follow from them. Not a public
/// header.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <span>

namespace orrery::nrlmsise00 {

constexpr double kGasConstant =
    831.4;  // 1e-5 J/(mol K) over 1e3: with g in cm/s^2 and heights in km
/// Exponents are cut off here, as in the published model; no valid argument comes near.
constexpr double kHighestExponent = 50;

/// Gravity at a latitude and the radius that makes it fall off rightly.
struct Gravity {
  double surface_cmps2 = 0, radius_km = 0;

  /// At a height [cm/s^2].
  double at(double height_km) const {
    const double ratio = 1 + height_km / radius_km;
    return surface_cmps2 / (ratio * ratio);
  }
  /// Geopotential height of z above z0, per gravity at z0 [km].
  double geopotential_km(double z_km, double z0_km) const {
    return (z_km - z0_km) * (radius_km + z0_km) / (radius_km + z_km);
  }
};

/// @param cosine_2lat  cosine of twice the geodetic latitude
inline Gravity gravity_at_latitude(double cosine_2lat) {
  const double surface_cmps2 = 980.616 * (1 - 0.0026373 * cosine_2lat);
  return {surface_cmps2, 2 * surface_cmps2 / (3.085462e-6 + 2.27e-9 * cosine_2lat) * 1e-5};
}

/// A cubic spline of 1/T in geopotential height between nodes that descend from `heights[0]`, with
/// given gradients dT/dz [K/km] at both ends.
class InverseTemperatureSpline {
 public:
  static constexpr std::size_t kMostNodes = 5;

  InverseTemperatureSpline(const Gravity& gravity, std::span<const double> heights_km,
                           std::span<const double> temperatures_K, double top_gradient,
                           double bottom_gradient);

  struct Point {
    double temperature_K = 0;
    double integral = 0;  // of 1/T from the top, per unit of the spline's own length [1/K]
  };
  /// @param height_km  at or below the top; below the bottom the bottom is taken
  /// @throws std::domain_error  the spline is not positive there.
  Point at(double height_km) const;

  double top_temperature_K() const { return 1 / y_[0]; }
  /// Change of ln(pressure) from the top for a gas of this mass.
  double pressure_exponent(const Point& point, double mass_amu) const;

 private:
  void solve(double first_slope, double last_slope);
  double whole_segment(std::size_t k) const;

  Gravity gravity_;
  std::size_t count_;
  double top_km_, bottom_km_, length_km_;  // length: geopotential, negative
  double exponent_per_amu_;
  std::array<double, kMostNodes> x_{}, y_{}, second_{};
};

/// Bates profile from 120 km up, T(z) = T_inf - (T_inf - T_120) exp(-s zeta), and the spline below
/// 123 km.
class ThermosphereProfile {
 public:
  struct Bates {
    double exospheric_K = 0, boundary_K = 0, shape_pkm = 0;  // s
    double boundary_km = 0, lowest_km = 0;
  };
  /// Temperatures at 110, 100, 90, 72.5 km, and the gradient there [K/km].
  struct Lower {
    std::array<double, 4> temperatures_K;
    double bottom_gradient_Kpkm;
  };

  /// @param lower  Needed for points below `bates.lowest_km` only.
  ThermosphereProfile(const Gravity& gravity, const Bates& bates,
                      const std::optional<Lower>& lower);

  /// What densities of all species at one height share.
  struct Point {
    double temperature_K = 0;
    double ln_bates_cooling = 0;  // ln(T_120 / T), of the Bates profile at the height or at its end
    double bates_length_km = 0;   // geopotential height above 120 km, of the same
    double ln_spline_cooling = 0;
    std::optional<InverseTemperatureSpline::Point> spline;
  };
  Point at(double height_km) const;

  /// ln of the density at the point over that at 120 km in diffusive equilibrium.
  double ln_density_ratio(const Point& point, double mass_amu, double thermal_diffusion) const;

 private:
  Point bates_point(double height_km) const;

  Gravity gravity_;
  Bates bates_;
  double boundary_gravity_per_gas_;
  Point lowest_;
  std::optional<InverseTemperatureSpline> spline_;
};

}  // namespace orrery::nrlmsise00
