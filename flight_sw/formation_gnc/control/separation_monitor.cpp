#include "formation_gnc/control/separation_monitor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

constexpr int kSamplesPerRevolution = 120;
constexpr int kPhases = 72;
constexpr int kDirections = 12;  // of escape that are tried where the cheapest leads too near
constexpr double kHorizon_rev = 2.0;
// What the escape aims at, over what it must reach: room for execution errors of 2 %, for a*da that
// they leave, and for the drift of the vectors.
constexpr double kEscapeMargin = 1.15;

Matrix6 elements_from_rtn(double u_rad, double n_radps) {
  // The derivative in RTN less that in ECI, in RTN components: n across.
  Matrix6 to_inertial = identity<6>();
  to_inertial(3, 1) = -n_radps;
  to_inertial(4, 0) = n_radps;
  return relative_elements_from_inertial_rtn(u_rad, n_radps) * to_inertial;
}

struct Sample {
  double distance_m, sigma_m;
};

// Radial and cross-track distance at u, of elements and covariance that Phi takes there; and the
// largest deviation that the covariance has in that plane.
Sample sample_at(double u_rad, double n_radps, const Matrix6& Phi, const RelativeElements& a_roe,
                 const Matrix6& P) {
  const Matrix6 to_rtn = rtn_from_relative_elements(u_rad, n_radps);
  Matrix<2, 6> H;
  for (int c = 0; c < 6; ++c) {
    H(0, c) = to_rtn(0, c);
    H(1, c) = to_rtn(2, c);
  }
  H = H * Phi;
  const Matrix<2, 1> rn = H * a_roe;
  const Matrix<2, 2> S = H * P * transpose(H);
  const double mean = 0.5 * (S(0, 0) + S(1, 1)), half = 0.5 * (S(0, 0) - S(1, 1));
  const double largest = mean + std::hypot(half, S(0, 1));
  return {norm(rn), std::sqrt(std::fmax(largest, 0.0))};
}

// Vectors of `size_m` along a phase, or longer where they are so already.
RelativeElements escape_target(const RelativeElements& now, double size_m, double phase_rad,
                               double sign) {
  const double c = std::cos(phase_rad), s = std::sin(phase_rad);
  const double di_m = std::fmax(size_m, c * now[kDix] + s * now[kDiy]);
  const double de_m = std::fmax(size_m, sign * (c * now[kDex] + s * now[kDey]));
  RelativeElements target;
  target[kDex] = sign * de_m * c;
  target[kDey] = sign * de_m * s;
  target[kDix] = di_m * c;
  target[kDiy] = di_m * s;
  return target;
}

// In proportion to delta-v, in plane and normal apart.
double cost(const RelativeElements& from, const RelativeElements& to) {
  return std::hypot(to[kDex] - from[kDex], to[kDey] - from[kDey]) / 2.0 +
         std::hypot(to[kDix] - from[kDix], to[kDiy] - from[kDiy]);
}

// The cheapest in each of as many sectors, the cheapest of all first.
std::array<RelativeElements, kDirections> targets_by_cost(const RelativeElements& now,
                                                          double size_m) {
  std::array<std::pair<double, RelativeElements>, kDirections> best;
  for (auto& one : best) one.first = INFINITY;
  for (int k = 0; k < kPhases; ++k) {
    for (const int side : {0, 1}) {
      const RelativeElements target =
          escape_target(now, size_m, kTwoPi * k / kPhases, side == 0 ? 1.0 : -1.0);
      const double price = cost(now, target);
      auto& sector =
          best[static_cast<std::size_t>(k * kDirections / (2 * kPhases) + side * kDirections / 2)];
      if (price < sector.first) sector = {price, target};
    }
  }
  std::stable_sort(best.begin(), best.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::array<RelativeElements, kDirections> targets;
  for (std::size_t k = 0; k < targets.size(); ++k) targets[k] = best[k].second;
  return targets;
}

// The least distance, along-track included, while burns are flown and coasted after.
double closest_approach_m(const RelativeOrbit& now, const std::vector<Burn>& burns) {
  const double n = mean_motion_radps(now.chief.a_m);
  RelativeElements a_roe = now.a_roe;
  std::int64_t t_ns = now.t_ns;
  const auto coast_to = [&](std::int64_t until_ns) {
    const OrbitElements chief = propagate_mean(now.chief, seconds(t_ns - now.t_ns));
    a_roe = state_transition(chief, seconds(until_ns - t_ns)) * a_roe;
    t_ns = until_ns;
    return propagate_mean(now.chief, seconds(until_ns - now.t_ns));
  };
  double least_m = INFINITY;
  std::size_t next = 0;
  for (int k = 0; k <= kHorizon_rev * kSamplesPerRevolution; ++k) {
    const std::int64_t sample_ns = now.t_ns + nanoseconds(kTwoPi * k / (kSamplesPerRevolution * n));
    for (; next < burns.size() && burns[next].t_ns <= sample_ns; ++next) {
      const OrbitElements chief = coast_to(burns[next].t_ns);
      a_roe = a_roe + control_input(chief) * burns[next].dv_RTN;
    }
    const OrbitElements chief = coast_to(sample_ns);
    const Vector<6> x = rtn_from_relative_elements(chief.u_rad, n) * a_roe;
    least_m = std::fmin(least_m, std::hypot(x[0], x[1], x[2]));
  }
  return least_m;
}

RelativeOrbit relative_orbit_of(const SeparationState& now) {
  RelativeOrbit orbit;
  orbit.t_ns = now.t_ns;
  orbit.chief = mean_from_osculating(osculating_from_state(now.chief));
  orbit.a_roe =
      relative_elements(orbit.chief, mean_from_osculating(osculating_from_state(now.deputy)));
  return orbit;
}

}  // namespace

SeparationForecast SeparationMonitor::forecast(const SeparationState& now) const {
  const RelativeOrbit orbit = relative_orbit_of(now);
  const double n = mean_motion_radps(orbit.chief.a_m);
  const double rate_radps = secular_rates(orbit.chief).u_radps;
  const Matrix6 J = elements_from_rtn(orbit.chief.u_rad, n);
  const Matrix6 P = symmetric(J * now.relative_covariance_RTN * transpose(J));
  SeparationForecast forecast;
  forecast.a_roe = orbit.a_roe;
  forecast.minimum_m = forecast.nominal_minimum_m = INFINITY;
  const int samples = static_cast<int>(std::ceil(options_.horizon_rev * kSamplesPerRevolution));
  for (int k = 0; k <= samples; ++k) {
    const double dt_s = kTwoPi * k / (kSamplesPerRevolution * n);
    const Sample sample = sample_at(orbit.chief.u_rad + rate_radps * dt_s, n,
                                    state_transition(orbit.chief, dt_s), orbit.a_roe, P);
    const double sure_m = sample.distance_m - options_.sigmas * sample.sigma_m;
    forecast.nominal_minimum_m = std::fmin(forecast.nominal_minimum_m, sample.distance_m);
    // Written so that a NaN is the minimum.
    if (!(sure_m >= forecast.minimum_m)) {
      forecast.minimum_m = sure_m;
      forecast.when_ns = now.t_ns + nanoseconds(dt_s);
      if (std::isnan(sure_m)) break;
    }
  }
  if (forecast.minimum_m < 0.0) forecast.minimum_m = 0.0;
  return forecast;
}

bool SeparationMonitor::must_escape(const SeparationForecast& forecast, bool in_science) const {
  return !(forecast.minimum_m >= (in_science ? options_.science_m : options_.elsewhere_m));
}

// In one revolution if the impulse limits allow, or else in the least number of halves that do. The
// cheapest direction that keeps `clear_m` on the way, or else the one that keeps most.
TransferPlan SeparationMonitor::escape(const SeparationState& now, std::int64_t earliest_ns) const {
  TransferStart start;
  start.orbit = relative_orbit_of(now);
  const double revolution_s = kTwoPi / secular_rates(start.orbit.chief).u_radps;
  TransferOptions options;
  options.limits = options_.limits;
  options.first_ns = earliest_ns;
  options.waypoints = 0;
  options.budget_mps = 1e3;           // whatever it costs
  options.min_radial_normal_m = 0.0;  // nothing is safer than to try
  TransferPlan best;
  double best_m = -1.0;
  for (const double revolutions : {1.0, 1.5, 2.0, 3.0}) {
    TransferGoal goal;
    goal.end_ns = earliest_ns + nanoseconds(revolutions * revolution_s);
    goal.along_track_free = true;
    const RelativeElements then = coast(start, goal.end_ns);
    for (const RelativeElements& target :
         targets_by_cost(then, kEscapeMargin * options_.escape_m)) {
      goal.a_roe = target;
      TransferPlan plan = ReconfigurationPlanner(options).plan(start, goal);
      if (!plan.usable()) continue;
      const double closest_m = closest_approach_m(start.orbit, plan.burns);
      if (closest_m <= best_m) continue;
      best = std::move(plan);
      best_m = closest_m;
      if (best_m >= options_.clear_m) return best;
    }
    if (best.usable()) break;
  }
  return best;
}

}  // namespace formation_gnc
