#include <orrery/models/ground/pass_tracker.hpp>
#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/elements.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kHorizon_s = 1200, kStep_s = 20;
constexpr double kJ2 = 1.0826e-3;           // of the Earth; a bound needs no more digits
constexpr double kOtherForces_mps2 = 1e-3;  // radiation, drag, third bodies, forces of the user's
constexpr double kCulminated_s = 1e-3;

// Largest acceleration besides the point mass: J2's at the pole, 3 J2 mu Re^2 / r^4, doubled for
// the rest of the field.
double perturbation_mps2(const QuasiNonsingularElements& e) {
  const double perigee_m = e.a_m * (1 - std::sqrt(e.ex * e.ex + e.ey * e.ey));
  const double ratio = kRadiusEarth_m / perigee_m;
  return 6 * kJ2 * kMuEarth_m3ps2 / (perigee_m * perigee_m) * (ratio * ratio) + kOtherForces_mps2;
}

// Where `value` first reaches zero from below in (a, b), to within half a nanosecond, on the safe
// side.
double first_root(const std::function<double(double)>& value, double a, double b) {
  while (b - a > 4e-10) {
    const double middle = 0.5 * (a + b);
    if (middle <= a || middle >= b) break;
    (value(middle) >= 0 ? b : a) = middle;
  }
  return a;
}

// The top of a hump between a and b, as far as one step tells: golden section.
double top(const std::function<double(double)>& value, double a, double b) {
  constexpr double kGolden = 0.6180339887498949;
  while (b - a > 1e-3) {
    const double left = b - kGolden * (b - a), right = a + kGolden * (b - a);
    (value(left) < value(right) ? a : b) = value(left) < value(right) ? left : right;
  }
  return 0.5 * (a + b);
}

// The first instant in (0, horizon] at which `value` is not below zero; it is below at 0.
std::optional<double> first_reach(const std::function<double(double)>& value) {
  double before = -2, last = value(0);  // a sine's difference is above -2
  for (double dt = kStep_s; dt <= kHorizon_s; dt += kStep_s) {
    const double now = value(dt);
    if (now >= 0) return first_root(value, dt - kStep_s, dt);
    // A hump between samples that all lie below.
    if (last > before && last > now) {
      const double begin = std::max(0.0, dt - 2 * kStep_s);
      const double at = top(value, begin, dt);
      if (value(at) >= 0) return first_root(value, begin, at);
    }
    before = last;
    last = now;
  }
  return {};
}

}  // namespace

// Kepler's orbit through a state, seen from the station.
class PassTracker::Ahead {
 public:
  Ahead(const PassTracker& tracker, const OrbitState& truth, double thrust_mps2)
      : station_(tracker.station_),
        environment_(*tracker.environment_),
        t_(truth.t),
        elements_(to_quasi_nonsingular(inertial_state(truth))),
        mean_motion_radps_(std::sqrt(kMuEarth_m3ps2 / elements_.a_m) / elements_.a_m),
        perturbation_mps2_(perturbation_mps2(elements_) + thrust_mps2) {}

  SimTime time(double dt_s) const { return t_ + from_seconds(dt_s); }

  OrbitState state(double dt_s) const {
    QuasiNonsingularElements e = elements_;
    e.u_rad += mean_motion_radps_ * dt_s;
    const InertialState s = to_inertial(e);
    return {time(dt_s), s.r_ECI, s.v_ECI, 1};
  }
  GroundStation::View view(double dt_s) const {
    const OrbitState s = state(dt_s);
    return station_.view(s, environment_.surroundings(s.t));
  }
  double elevation_rad(double dt_s) const {
    const OrbitState s = state(dt_s);
    return station_.elevation_rad(s, environment_.surroundings(s.t));
  }
  /// Of the sine of the elevation: a displacement turns the line of sight by at most its length
  /// over the range.
  double room(double dt_s, double range_m) const {
    const double room_m = 2 * perturbation_mps2_ * dt_s * dt_s;
    return room_m < range_m ? room_m / (range_m - room_m) : 2;
  }
  /// Not below zero where the truth may stand above the mask, or below it.
  double may_be_above(double dt_s) const {
    const GroundStation::View v = view(dt_s);
    return v.sin_elevation - station_.sin_mask() + room(dt_s, v.range_m);
  }
  double may_be_below(double dt_s) const {
    const GroundStation::View v = view(dt_s);
    return station_.sin_mask() - v.sin_elevation + room(dt_s, v.range_m);
  }

 private:
  const GroundStation& station_;
  const SpaceEnvironment& environment_;
  SimTime t_;
  QuasiNonsingularElements elements_;
  double mean_motion_radps_, perturbation_mps2_;
};

PassTracker::PassTracker(const GroundStation& station,
                         std::shared_ptr<const SpaceEnvironment> environment)
    : station_(station), environment_(std::move(environment)) {
  if (environment_ == nullptr) throw std::invalid_argument("PassTracker: no environment");
}

void PassTracker::cross(const OrbitState& truth, double elevation_rad) {
  in_view_ = !in_view_;
  if (in_view_) {
    passes_.push_back({.rise = truth.t, .highest_rad = elevation_rad});
    return;
  }
  Pass& pass = passes_.back();
  pass.set = truth.t;
  if (!pass.culmination) pass.culmination = pass.rise;
}

// At the culmination the elevation's rate falls through zero. Near it the orbit ahead is as good as
// the truth, and so it is a moment back.
std::optional<SimTime> PassTracker::find_culmination(const Ahead& ahead) {
  Pass& pass = passes_.back();
  const auto falls = [&ahead](double dt_s) { return -ahead.view(dt_s).sin_elevation_rate; };
  std::optional<double> dt_s = 0;
  if (falls(0) < 0) {
    dt_s = first_reach(falls);
    if (!dt_s) return {};
    if (*dt_s > kCulminated_s) return ahead.time(*dt_s);
  } else if (falls(-kStep_s) < 0) {
    dt_s = first_root(falls, -kStep_s, 0);
  }
  pass.culmination = std::max(pass.rise, ahead.time(*dt_s));
  pass.highest_rad = std::max(pass.highest_rad, ahead.elevation_rad(*dt_s));
  return {};
}

SimTime PassTracker::look(const OrbitState& truth, double thrust_mps2) {
  if (last_ && truth.t < *last_) {
    throw std::logic_error("PassTracker::look: t = " + to_string(truth.t) +
                           " is before the last look, " + to_string(*last_));
  }
  last_ = truth.t;
  const Surroundings around = environment_->surroundings(truth.t);
  const bool above = station_.view(truth, around).sin_elevation >= station_.sin_mask();
  if (above != in_view_) cross(truth, station_.elevation_rad(truth, around));
  const Ahead ahead(*this, truth, thrust_mps2);
  const std::optional<double> crossing_s = first_reach(
      [&](double dt_s) { return in_view_ ? ahead.may_be_below(dt_s) : ahead.may_be_above(dt_s); });
  SimTime next = ahead.time(crossing_s.value_or(kHorizon_s));
  if (in_view_ && !passes_.back().culmination) {
    if (const std::optional<SimTime> culmination = find_culmination(ahead)) {
      next = std::min(next, *culmination);
    }
  }
  return std::max(next, truth.t + 1ns);
}

}  // namespace orrery
