#include "rpo_kit/far_range/initial_orbit.hpp"

#include <cmath>
#include <vector>

#include "support/orbit/constants.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;

// What is solved for: a_roe at the first bearing, then the errors of the burns.
constexpr int kUnknowns = 6 + 3 * kMostBatchBurns;
using Unknowns = Vector<kUnknowns>;
using Normal = Matrix<kUnknowns, kUnknowns>;

// Steps of the partials [m, m/s]: large against rounding (1e-8 of 7e6 m), small against curvature.
constexpr double kStep_m = 5.0, kStep_mps = 1e-4;

struct Arc {
  const BatchMeasurement* measurements;
  int count;
  const ObserverBurn* burns;
  int burn_count;
};

// Follows the target through the arc, with the bearings' tangent planes as they come.
class Follower {
 public:
  Follower(const Arc& arc, const Unknowns& unknowns)
      : arc_(arc), unknowns_(unknowns), now_(arc.measurements[0].observer) {
    for (int k = 0; k < 6; ++k) a_roe_[k] = unknowns[k];
  }
  // On to measurement k; k ascends.
  const RelativeElements& at(int k) {
    const Observer& observer = arc_.measurements[k].observer;
    while (next_burn_ < arc_.burn_count && arc_.burns[next_burn_].t_ns <= observer.t_ns) burn();
    move(observer.t_ns);
    now_ = observer;
    return a_roe_;
  }

 private:
  void move(std::int64_t to_ns) {
    const double dt_s = seconds(to_ns - now_.t_ns);
    if (dt_s == 0.0) return;
    a_roe_ = drift(now_.mean, a_roe_, dt_s);
    now_ = propagate(now_, to_ns);
  }
  void burn() {
    const ObserverBurn& burn = arc_.burns[next_burn_];
    move(burn.t_ns);
    Vec3 dv = burn.dv_RTN;
    for (int k = 0; k < 3; ++k) dv[k] += unknowns_[6 + 3 * next_burn_ + k];
    const OrbitElements after = after_burn(now_.mean, dv);
    a_roe_ = seen_from(now_.mean, after, a_roe_);
    now_.mean = after;
    ++next_burn_;
  }

  const Arc& arc_;
  const Unknowns& unknowns_;
  Observer now_;
  RelativeElements a_roe_;
  int next_burn_ = 0;
};

// Information of what is known beforehand; `free_range`: a*dl is not held.
Normal prior(const Arc& arc, const BatchOptions& options, bool free_range) {
  Normal information;
  information(kDa, kDa) = 1.0 / (options.prior_da_m * options.prior_da_m);
  // 1 mm holds; without it the farthest distance is no more than a weak bound.
  const double range_m = free_range ? options.farthest_m : 1e-3;
  information(kDl, kDl) = 1.0 / (range_m * range_m);
  for (int k = kDex; k <= kDiy; ++k) {
    information(k, k) = 1.0 / (options.prior_m * options.prior_m);
  }
  for (int b = 0; b < kMostBatchBurns; ++b) {
    Mat3 known = identity<3>();
    if (b < arc.burn_count) {
      // A floor of 1e-6 m/s, for burns that are claimed to be exact.
      solve(arc.burns[b].covariance_RTN + 1e-12 * identity<3>(), identity<3>(), &known);
    }
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) information(6 + 3 * b + r, 6 + 3 * b + c) = known(r, c);
    }
  }
  return information;
}

struct Fit {
  Normal normal;      // J^T J
  Unknowns gradient;  // J^T of (measured less predicted)
  double cost = 0.0;  // sum of squared normalised residuals
};

class BatchFit {
 public:
  BatchFit(const Arc& arc, const BatchOptions& options) : arc_(arc), options_(options) {
    for (int k = 0; k < arc.count; ++k) {
      planes_.emplace_back(arc.measurements[k].bearing.direction_ECI);
      from_.push_back(position_ECI(arc.measurements[k].observer.mean) +
                      arc.measurements[k].bearing.r_SO_ECI);
    }
  }

  double cost(const Unknowns& x, const Normal& prior) const {
    Follower follower(arc_, x);
    double sum = dot(x - start_, prior * (x - start_));
    for (int k = 0; k < arc_.count; ++k) {
      const Vector<2> r = residual(k, follower.at(k));
      sum += dot(r, r);
    }
    return sum;
  }

  Fit linearise(const Unknowns& x, const Normal& prior) const {
    const int unknowns = 6 + 3 * arc_.burn_count;
    Unknowns moved[kUnknowns];
    for (int j = 0; j < unknowns; ++j) {
      moved[j] = x;
      moved[j][j] += j < 6 ? kStep_m : kStep_mps;
    }
    Follower nominal(arc_, x);
    Follower perturbed[kUnknowns] = {follow(moved[0]), follow(moved[1]),  follow(moved[2]),
                                     follow(moved[3]), follow(moved[4]),  follow(moved[5]),
                                     follow(moved[6]), follow(moved[7]),  follow(moved[8]),
                                     follow(moved[9]), follow(moved[10]), follow(moved[11])};
    Fit fit;
    fit.normal = prior;
    fit.gradient = -1.0 * (prior * (x - start_));
    fit.cost = dot(x - start_, prior * (x - start_));
    for (int k = 0; k < arc_.count; ++k) {
      const Vector<2> r = residual(k, nominal.at(k));
      fit.cost += dot(r, r);
      Matrix<2, kUnknowns> J;
      for (int j = 0; j < unknowns; ++j) {
        const Vector<2> difference = residual(k, perturbed[j].at(k)) - r;
        const double step = j < 6 ? kStep_m : kStep_mps;
        for (int row = 0; row < 2; ++row) J(row, j) = difference[row] / step;
      }
      fit.normal = fit.normal + transpose(J) * J;
      fit.gradient = fit.gradient - transpose(J) * r;
    }
    return fit;
  }

  // Gauss-Newton from a distance along the orbit, which stays.
  Unknowns fit_at_distance(double dl_m, double* cost_there) {
    start_ = Unknowns();
    start_[kDl] = dl_m;
    const Normal held = prior(arc_, options_, false);
    Unknowns x = start_;
    for (int iteration = 0; iteration < 4; ++iteration) {
      const Fit fit = linearise(x, held);
      Unknowns step;
      if (!solve_scaled(fit.normal, fit.gradient, 0.0, &step)) break;
      x = x + step;
    }
    *cost_there = cost(x, held);
    return x;
  }

  // Levenberg-Marquardt of all unknowns. @return false if it does not settle.
  bool fit_all(Unknowns* x, Normal* covariance, double* last_cost) {
    start_ = Unknowns();
    const Normal loose = prior(arc_, options_, true);
    double damping = 1e-3, now = cost(*x, loose);
    for (int iteration = 0; iteration < options_.iterations; ++iteration) {
      const Fit fit = linearise(*x, loose);
      Unknowns step;
      double then = INFINITY;
      while (damping < 1e8) {
        if (solve_scaled(fit.normal, fit.gradient, damping, &step)) {
          then = cost(*x + step, loose);
          if (then < now) break;
        }
        damping *= 10.0;
      }
      const bool settled = !(now - then > 1e-4);
      if (then < now) *x = *x + step, now = then;
      damping = std::fmax(damping / 10.0, 1e-9);
      if (settled) break;
    }
    *last_cost = now;
    return invert(linearise(*x, loose).normal, covariance);
  }

 private:
  Follower follow(const Unknowns& x) const { return Follower(arc_, x); }

  Vector<2> residual(int k, const RelativeElements& a_roe) const {
    const BatchMeasurement& m = arc_.measurements[k];
    const std::size_t at = static_cast<std::size_t>(k);
    const Vec3 towards = target_position_ECI(m.observer.mean, from_[at], a_roe);
    return (1.0 / m.bearing.sigma_rad) * planes_[at].offset(towards);
  }

  // Unknowns of metres and of m/s side by side: scaled to a unit diagonal before elimination.
  static bool solve_scaled(const Normal& normal, const Unknowns& right, double damping,
                           Unknowns* x) {
    Normal scaled;
    Unknowns b, scale;
    for (int k = 0; k < kUnknowns; ++k) scale[k] = 1.0 / std::sqrt(normal(k, k));
    for (int r = 0; r < kUnknowns; ++r) {
      for (int c = 0; c < kUnknowns; ++c) scaled(r, c) = normal(r, c) * scale[r] * scale[c];
      scaled(r, r) += damping;
      b[r] = right[r] * scale[r];
    }
    Unknowns y;
    if (!solve(scaled, b, &y)) return false;
    for (int k = 0; k < kUnknowns; ++k) (*x)[k] = scale[k] * y[k];
    return is_finite(*x);
  }

  static bool invert(const Normal& normal, Normal* inverse) {
    for (int column = 0; column < kUnknowns; ++column) {
      Unknowns unit, x;
      unit[column] = 1.0;
      if (!solve_scaled(normal, unit, 0.0, &x)) return false;
      for (int row = 0; row < kUnknowns; ++row) (*inverse)(row, column) = x[row];
    }
    *inverse = symmetric(*inverse);
    return true;
  }

  Arc arc_;
  BatchOptions options_;
  Unknowns start_;
  std::vector<TangentPlane> planes_;
  std::vector<Vec3> from_;
};

// +1 if the target is ahead of the observer.
double side(const BatchMeasurement& m) {
  const StateEci state = state_from_osculating(osculating_from_mean(m.observer.mean));
  return dot(m.bearing.direction_ECI, state.v_ECI) > 0.0 ? 1.0 : -1.0;
}

// To the end of the arc: what the unknowns at its beginning mean there.
void to_the_end(const Arc& arc, const Unknowns& x, const Normal& covariance, InitialOrbit* result) {
  const auto end_of = [&](const Unknowns& unknowns) {
    Follower follower(arc, unknowns);
    RelativeElements a_roe;
    for (int k = 0; k < arc.count; ++k) a_roe = follower.at(k);
    return a_roe;
  };
  result->a_roe = end_of(x);
  Matrix<6, kUnknowns> J;
  for (int j = 0; j < 6 + 3 * arc.burn_count; ++j) {
    const double step = j < 6 ? kStep_m : kStep_mps;
    Unknowns plus = x, minus = x;
    plus[j] += step;
    minus[j] -= step;
    const RelativeElements difference = end_of(plus) - end_of(minus);
    for (int r = 0; r < 6; ++r) J(r, j) = difference[r] / (2.0 * step);
  }
  result->covariance = symmetric(J * covariance * transpose(J));
}

}  // namespace

bool solve_initial_orbit(const BatchMeasurement* measurements, int count, const ObserverBurn* burns,
                         int burn_count, const BatchOptions& options, InitialOrbit* result) {
  if (count < 6 || burn_count > kMostBatchBurns) return false;
  const Arc arc{measurements, count, burns, burn_count};
  BatchFit batch(arc, options);
  Unknowns best;
  double least = INFINITY;
  for (int k = 0; k < options.samples; ++k) {
    const double share = static_cast<double>(k) / (options.samples - 1);
    const double distance_m =
        options.nearest_m * std::pow(options.farthest_m / options.nearest_m, share);
    double cost = INFINITY;
    const Unknowns x = batch.fit_at_distance(side(measurements[0]) * distance_m, &cost);
    if (cost < least) least = cost, best = x;
  }
  if (!std::isfinite(least)) return false;
  Normal covariance;
  double cost = 0.0;
  if (!batch.fit_all(&best, &covariance, &cost)) return false;
  const double degrees = 2.0 * count - 6.0;
  result->t_ns = measurements[count - 1].bearing.t_ns;
  result->residual = std::sqrt(cost / degrees);
  // Noise that is larger than was said widens the covariance; smaller does not narrow it.
  to_the_end(arc, best, std::fmax(1.0, cost / degrees) * covariance, result);
  return is_finite(result->a_roe) && is_finite(result->covariance);
}

}  // namespace rpo_kit
