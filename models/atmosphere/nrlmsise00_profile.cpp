#include <orrery/models/atmosphere/nrlmsise00_profile.hpp>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace orrery::nrlmsise00 {
namespace {

/// The model's spherical harmonics are unbounded: in storms beyond what they were fitted to, 1/T of
/// the lower thermosphere passes through zero.
double positive(double inverse_K, double height_km) {
  if (inverse_K > 0) return inverse_K;
  throw std::domain_error("evaluate_nrlmsise00: with these arguments the model's temperature at " +
                          std::to_string(height_km) +
                          " km is not positive: ap is beyond what it was fitted to");
}

}  // namespace

InverseTemperatureSpline::InverseTemperatureSpline(const Gravity& gravity,
                                                   std::span<const double> heights_km,
                                                   std::span<const double> temperatures_K,
                                                   double top_gradient, double bottom_gradient)
    : gravity_(gravity),
      count_(heights_km.size()),
      top_km_(heights_km.front()),
      bottom_km_(heights_km.back()),
      length_km_(gravity.geopotential_km(bottom_km_, top_km_)),
      exponent_per_amu_(gravity.at(top_km_) * length_km_ / kGasConstant) {
  for (std::size_t k = 0; k < count_; ++k) {
    x_[k] = gravity.geopotential_km(heights_km[k], top_km_) / length_km_;
    y_[k] = positive(1 / temperatures_K[k], heights_km[k]);
  }
  // d(1/T)/dx from dT/dz; geopotential height grows more slowly at the top than at the bottom.
  const double ratio = (gravity.radius_km + bottom_km_) / (gravity.radius_km + top_km_);
  solve(-top_gradient * y_[0] * y_[0] * length_km_,
        -bottom_gradient * y_[count_ - 1] * y_[count_ - 1] * length_km_ * ratio * ratio);
}

/// Second derivatives at the nodes: the tridiagonal system of a spline with clamped ends.
void InverseTemperatureSpline::solve(double first_slope, double last_slope) {
  std::array<double, kMostNodes> rhs{};
  const std::size_t last = count_ - 1;
  double slope = (y_[1] - y_[0]) / (x_[1] - x_[0]);
  second_[0] = -0.5;
  rhs[0] = 3 / (x_[1] - x_[0]) * (slope - first_slope);
  for (std::size_t k = 1; k < last; ++k) {
    const double span = x_[k + 1] - x_[k - 1];
    const double weight = (x_[k] - x_[k - 1]) / span;
    const double pivot = weight * second_[k - 1] + 2;
    const double next_slope = (y_[k + 1] - y_[k]) / (x_[k + 1] - x_[k]);
    second_[k] = (weight - 1) / pivot;
    rhs[k] = (6 * (next_slope - slope) / span - weight * rhs[k - 1]) / pivot;
    slope = next_slope;
  }
  const double end = 3 / (x_[last] - x_[last - 1]) * (last_slope - slope);
  second_[last] = (end - 0.5 * rhs[last - 1]) / (0.5 * second_[last - 1] + 1);
  for (std::size_t k = last; k-- > 0;) second_[k] = second_[k] * second_[k + 1] + rhs[k];
}

InverseTemperatureSpline::Point InverseTemperatureSpline::at(double height_km) const {
  const double z_km = std::max(height_km, bottom_km_);
  const double x = gravity_.geopotential_km(z_km, top_km_) / length_km_;
  double integral = 0;
  std::size_t k = 0;
  for (; k + 2 < count_ && x >= x_[k + 1]; ++k) integral += whole_segment(k);

  const double h = x_[k + 1] - x_[k];
  const double a = (x_[k + 1] - x) / h, b = (x - x_[k]) / h;
  const double a2 = a * a, b2 = b * b, h2 = h * h;
  const double inverse_K = a * y_[k] + b * y_[k + 1] +
                           (a * (a2 - 1) * second_[k] + b * (b2 - 1) * second_[k + 1]) * h2 / 6;
  integral +=
      h * ((1 - a2) * y_[k] / 2 + b2 * y_[k + 1] / 2 +
           ((a2 / 2 - (1 + a2 * a2) / 4) * second_[k] + (b2 * b2 / 4 - b2 / 2) * second_[k + 1]) *
               h2 / 6);
  return {1 / positive(inverse_K, z_km), integral};
}

double InverseTemperatureSpline::whole_segment(std::size_t k) const {
  const double h = x_[k + 1] - x_[k];
  return h * ((y_[k] + y_[k + 1]) / 2 - (second_[k] + second_[k + 1]) * h * h / 24);
}

double InverseTemperatureSpline::pressure_exponent(const Point& point, double mass_amu) const {
  return -std::min(mass_amu * exponent_per_amu_ * point.integral, kHighestExponent);
}

ThermosphereProfile::ThermosphereProfile(const Gravity& gravity, const Bates& bates,
                                         const std::optional<Lower>& lower)
    : gravity_(gravity),
      bates_(bates),
      boundary_gravity_per_gas_(gravity.at(bates.boundary_km) /
                                (kGasConstant * bates.exospheric_K)) {
  if (!lower) return;
  lowest_ = bates_point(bates_.lowest_km);
  const double ratio =
      (gravity.radius_km + bates_.boundary_km) / (gravity.radius_km + bates_.lowest_km);
  const double top_gradient =
      (bates_.exospheric_K - lowest_.temperature_K) * bates_.shape_pkm * ratio * ratio;
  const std::array<double, 5> heights_km{bates_.lowest_km, 110, 100, 90, 72.5};
  const auto& t = lower->temperatures_K;
  const std::array<double, 5> temperatures_K{lowest_.temperature_K, t[0], t[1], t[2], t[3]};
  spline_.emplace(gravity, heights_km, temperatures_K, top_gradient, lower->bottom_gradient_Kpkm);
}

ThermosphereProfile::Point ThermosphereProfile::bates_point(double height_km) const {
  Point point;
  point.bates_length_km = gravity_.geopotential_km(height_km, bates_.boundary_km);
  point.temperature_K =
      bates_.exospheric_K - (bates_.exospheric_K - bates_.boundary_K) *
                                std::exp(-bates_.shape_pkm * point.bates_length_km);
  point.ln_bates_cooling = std::log(bates_.boundary_K / point.temperature_K);
  return point;
}

ThermosphereProfile::Point ThermosphereProfile::at(double height_km) const {
  if (height_km >= bates_.lowest_km) return bates_point(height_km);
  Point point = lowest_;
  point.spline = spline_->at(height_km);
  point.temperature_K = point.spline->temperature_K;
  point.ln_spline_cooling = std::log(lowest_.temperature_K / point.temperature_K);
  return point;
}

double ThermosphereProfile::ln_density_ratio(const Point& point, double mass_amu,
                                             double thermal_diffusion) const {
  const double weight = mass_amu * boundary_gravity_per_gas_;  // per km of geopotential
  const double gamma = weight / bates_.shape_pkm;
  // The published cut-off of exp(...) at 50 rather than at exp(50).
  constexpr double kLn50 = 3.912023005428146;
  const double bates = (1 + thermal_diffusion + gamma) * point.ln_bates_cooling +
                       std::min(-weight * point.bates_length_km, kLn50);
  if (!point.spline) return bates;
  return bates + (1 + thermal_diffusion) * point.ln_spline_cooling +
         spline_->pressure_exponent(*point.spline, mass_amu);
}

}  // namespace orrery::nrlmsise00
