#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace orrery {
namespace {

constexpr Duration kMostRecent = 10min;

}  // namespace

SpacecraftOrbit::SpacecraftOrbit(const OrbitState& initial, SpacecraftOrbitOptions options)
    : options_(std::move(options)), initial_(initial) {
  if (options_.step <= Duration::zero()) {
    throw std::invalid_argument("SpacecraftOrbit: step = " + to_string(options_.step) +
                                "; accepted: above 0");
  }
  // Everything that could be wrong shows here rather than at the first look.
  left_ = OrbitDynamics(options_.environment, options_.forces).start(initial_);
}

void SpacecraftOrbit::add_force(std::shared_ptr<const ForceModel> force) {
  if (dynamics_ != nullptr)
    throw std::logic_error("SpacecraftOrbit::add_force: the orbit has started");
  if (force == nullptr) throw std::invalid_argument("SpacecraftOrbit::add_force: null");
  options_.forces.push_back(std::move(force));
}

void SpacecraftOrbit::start() {
  if (dynamics_ != nullptr) return;
  dynamics_ = std::make_unique<OrbitDynamics>(options_.environment, options_.forces);
  left_ = dynamics_->start(initial_);
}

SimTime SpacecraftOrbit::next_grid_point() const {
  const SimTime now = left_.orbit.t;
  const Duration since_start = now - initial_.t;
  SimTime next = now + (options_.step - since_start % options_.step);
  if (const auto jump = dynamics_->next_discontinuity(now); jump && *jump < next) next = *jump;
  return next;
}

// Afterwards left_.t <= t, and t < right_.t if there is a right_.
void SpacecraftOrbit::move_to(SimTime t) {
  start();
  if (t < left_.orbit.t) {
    throw std::invalid_argument("SpacecraftOrbit: t = " + to_string(t) +
                                " has passed; accepted: from " + to_string(left_.orbit.t) + " on");
  }
  while (t >= next_grid_point()) {
    if (!right_) {
      right_ = dynamics_->step(left_, next_grid_point());
      ++steps_;
    }
    left_ = *right_;
    right_.reset();
  }
}

OrbitState SpacecraftOrbit::at(SimTime t) {
  move_to(t);
  if (t == left_.orbit.t) return left_.orbit;
  if (!right_) {
    right_ = dynamics_->step(left_, next_grid_point());
    ++steps_;
  }
  ++interpolations_;
  return OrbitDynamics::interpolate(left_, *right_, t);
}

OrbitState SpacecraftOrbit::recent(SimTime t) {
  start();
  if (t >= left_.orbit.t) return at(t);
  if (left_.orbit.t - t > kMostRecent) {
    throw std::invalid_argument("SpacecraftOrbit::recent: t = " + to_string(t) +
                                "; accepted: from " + to_string(left_.orbit.t - kMostRecent) +
                                " on");
  }
  OrbitDynamics::State back = left_;
  while (back.orbit.t > t) {
    back = dynamics_->step(back, std::max(t, back.orbit.t - options_.step));
  }
  return back.orbit;
}

void SpacecraftOrbit::apply_impulse(SimTime t, const Vec3& dv_ECI) {
  move_to(t);
  if (t > left_.orbit.t) {
    left_ = dynamics_->step(left_, t);
    ++steps_;
  }
  left_ = dynamics_->after_impulse(left_, dv_ECI);
  right_.reset();
}

}  // namespace orrery
