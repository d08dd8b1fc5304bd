#include <orrery/models/reference/reference_propagator.hpp>

#include <algorithm>
#include <arkode/arkode_arkstep.h>
#include <cmath>
#include <exception>
#include <nvector/nvector_serial.h>
#include <stdexcept>
#include <string>
#include <utility>

namespace orrery {
namespace {

constexpr std::size_t kNumbersEach = 6;

Vec3 vector_at(const double* y) {
  return {y[0], y[1], y[2]};
}

void put(double* y, const Vec3& v) {
  y[0] = v.x, y[1] = v.y, y[2] = v.z;
}

Vec3 acceleration_ECI(const OrbitDynamics::Forces& forces, const OrbitState& state,
                      const Surroundings& around) {
  const double r = norm(state.r_ECI);
  Vec3 a_ECI = -kMuEarth_m3ps2 / (r * r * r) * state.r_ECI;
  for (const auto& force : forces) a_ECI += force->acceleration_ECI(state, around);
  return a_ECI;
}

std::optional<SimTime> next_discontinuity(const OrbitDynamics::Forces& forces, SimTime t) {
  std::optional<SimTime> first;
  for (const auto& force : forces) {
    const std::optional<SimTime> next = force->next_discontinuity(t);
    if (next && (!first || *next < *first)) first = next;
  }
  return first;
}

void require_usable(const ReferenceOptions& options) {
  if (!(options.tolerance >= 1e-15 && options.tolerance <= 1e-3))
    throw std::invalid_argument("ReferencePropagator: tolerance = " +
                                std::to_string(options.tolerance) + "; accepted: 1e-15 to 1e-3");
  if (options.longest_step <= Duration::zero())
    throw std::invalid_argument("ReferencePropagator: longest_step = " +
                                to_string(options.longest_step) + "; accepted: above 0");
  if (options.fixed_step && *options.fixed_step <= Duration::zero())
    throw std::invalid_argument("ReferencePropagator: fixed_step = " +
                                to_string(*options.fixed_step) + "; accepted: above 0");
}

}  // namespace

/// The C interface of ARKODE, kept in one place. Its time is in seconds along the way from the
/// begin of a segment, in which no force jumps: positive backwards, too, since ReInit of 6.4 keeps
/// the direction. What a callback throws is carried past the C code.
class ReferencePropagator::Solver {
 public:
  Solver(std::vector<ReferenceSpacecraft> spacecraft,
         std::shared_ptr<const SpaceEnvironment> environment, const ReferenceOptions& options)
      : environment_(std::move(environment)), options_(options) {
    require_usable(options_);
    if (spacecraft.empty()) throw std::invalid_argument("ReferencePropagator: no spacecraft");
    for (ReferenceSpacecraft& s : spacecraft) {
      // Checks state, forces and environment.
      OrbitDynamics(environment_, s.forces, {}, OrbitVariables::kCartesian).start(s.initial);
      if (s.initial.t != spacecraft.front().initial.t)
        throw std::invalid_argument("ReferencePropagator: one spacecraft starts at " +
                                    to_string(spacecraft.front().initial.t) + ", another at " +
                                    to_string(s.initial.t));
      states_.push_back(s.initial);
      laws_.push_back({std::move(s.forces), std::move(s.attitude), {}});
    }
    create();
  }

  ~Solver() {
    ARKStepFree(&memory_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  SimTime time() const { return states_.front().t; }
  const OrbitState& state(std::size_t spacecraft) const {
    require_spacecraft("state", spacecraft);
    return states_[spacecraft];
  }

  std::vector<OrbitEvent> advance_to(SimTime t, const std::vector<EventFunction>& functions) {
    functions_ = &functions;
    std::vector<OrbitEvent> events;
    for (const SimTime end : segment_ends(t)) run_segment(end, events);
    functions_ = nullptr;
    return events;
  }

  void apply_impulse(std::size_t spacecraft, const Vec3& dv_ECI) {
    require_spacecraft("apply_impulse", spacecraft);
    if (!is_finite(dv_ECI))
      throw std::domain_error("ReferencePropagator::apply_impulse: dv_ECI is not finite");
    states_[spacecraft].v_ECI += dv_ECI;
  }

  void set_thrust(std::size_t spacecraft, const Thrust& thrust) {
    require_spacecraft("set_thrust", spacecraft);
    Law& law = laws_[spacecraft];
    OrbitDynamics(environment_, law.forces, law.attitude).check_thrust(thrust);
    law.thrust = thrust;
  }

  std::uint64_t steps() const { return steps_; }
  std::uint64_t evaluations() const { return evaluations_; }

 private:
  /// What moves one spacecraft.
  struct Law {
    OrbitDynamics::Forces forces;
    std::shared_ptr<const AttitudeLaw> attitude;
    Thrust thrust;

    Vec3 acceleration(const OrbitState& state, const Surroundings& around) const {
      Vec3 force_ECI = thrust.force_ECI;
      if (thrust.force_B != Vec3{})
        force_ECI += transpose(attitude->R_BI(state.t, inertial_state(state))) * thrust.force_B;
      return acceleration_ECI(forces, state, around) + force_ECI / state.mass_kg;
    }
    std::optional<SimTime> next_jump(SimTime t) const {
      const std::optional<SimTime> jump = next_discontinuity(forces, t);
      if (thrust.force_B == Vec3{}) return jump;
      const std::optional<SimTime> turn = attitude->next_discontinuity(t);
      return jump && turn ? std::min(*jump, *turn) : jump ? jump : turn;
    }
  };

  void require_spacecraft(const char* function, std::size_t i) const {
    if (i >= states_.size())
      throw std::out_of_range("ReferencePropagator::" + std::string(function) + ": spacecraft " +
                              std::to_string(i) + "; accepted: below " +
                              std::to_string(states_.size()));
  }

  void create() {
    SUNContext_Create(nullptr, &context_);
    y_ = N_VNew_Serial(static_cast<sunindextype>(kNumbersEach * states_.size()), context_);
    write_states();
    memory_ = ARKStepCreate(&derivative, nullptr, 0, y_, context_);
    if (y_ == nullptr || memory_ == nullptr)
      throw std::runtime_error("ReferencePropagator: SUNDIALS gave no memory");
    check(ARKStepSetUserData(memory_, this), "SetUserData");
    check(ARKStepSetErrHandlerFn(memory_, &keep_message, this), "SetErrHandlerFn");
    check(ARKStepSetTableNum(memory_, ARKODE_DIRK_NONE, ARKODE_FEHLBERG_13_7_8), "SetTableNum");
    check(ARKStepSetMaxNumSteps(memory_, -1), "SetMaxNumSteps");
    // For roots between steps: quintic through values and slopes, 1e-6 m at 60 s.
    check(ARKStepSetInterpolantDegree(memory_, 5), "SetInterpolantDegree");
    check(ARKStepWFtolerances(memory_, &error_weights), "WFtolerances");
    if (options_.fixed_step) {
      check(ARKStepSetFixedStep(memory_, to_seconds(*options_.fixed_step)), "SetFixedStep");
    } else {
      check(ARKStepSetMaxStep(memory_, to_seconds(options_.longest_step)), "SetMaxStep");
    }
  }

  void check(int status, const char* what) const {
    if (status >= 0) return;
    throw std::runtime_error("ReferencePropagator: SUNDIALS' ARKStep" + std::string(what) +
                             " failed with " + std::to_string(status) + ": " + message_);
  }

  // ---- segments

  /// The jumps of the forces on the way, in the order in which they are met, and `t`.
  std::vector<SimTime> segment_ends(SimTime t) const {
    const SimTime first = std::min(time(), t), last = std::max(time(), t);
    std::vector<SimTime> ends;
    for (const Law& law : laws_)
      for (auto jump = law.next_jump(first); jump && *jump < last; jump = law.next_jump(*jump))
        ends.push_back(*jump);
    std::sort(ends.begin(), ends.end());
    if (t < time()) std::reverse(ends.begin(), ends.end());
    ends.push_back(t);
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    return ends;
  }

  void run_segment(SimTime end, std::vector<OrbitEvent>& events) {
    if (end == time()) return;
    begin_ = time();
    end_ = end;
    restart();
    const double span_s = direction() * to_seconds(end - begin_);
    check(ARKStepSetStopTime(memory_, span_s), "SetStopTime");
    for (double t_s = 0;;) {
      const int status = ARKStepEvolve(memory_, span_s, y_, &t_s, ARK_NORMAL);
      require_success(status);
      if (status != ARK_ROOT_RETURN) break;
      add_events(t_s, events);
    }
    count();
    read_states(end);
  }

  void restart() {
    write_states();
    check(ARKStepReInit(memory_, &derivative, nullptr, 0, y_), "ReInit");
    const int roots = static_cast<int>(functions_->size());
    check(ARKStepRootInit(memory_, roots, roots > 0 ? &event_values : nullptr), "RootInit");
    // A function that is zero at the begin, e.g. after a stop at its root, is no event.
    check(ARKStepSetNoInactiveRootWarn(memory_), "SetNoInactiveRootWarn");
  }

  void require_success(int status) {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    if (status < 0)
      throw PropagationError("SUNDIALS gave up with " + std::to_string(status) + ": " + message_,
                             states_.front());
  }

  void add_events(double t_s, std::vector<OrbitEvent>& events) {
    std::vector<int> crossed(functions_->size());
    check(ARKStepGetRootInfo(memory_, crossed.data()), "GetRootInfo");
    for (std::size_t i = 0; i < crossed.size(); ++i) {
      if (crossed[i] == 0) continue;
      events.push_back({instant(t_s), (*functions_)[i].name, (crossed[i] > 0) == (end_ > begin_)});
    }
  }

  void count() {
    long steps = 0, explicit_evaluations = 0, implicit_evaluations = 0;
    ARKStepGetNumSteps(memory_, &steps);
    ARKStepGetNumRhsEvals(memory_, &explicit_evaluations, &implicit_evaluations);
    steps_ += static_cast<std::uint64_t>(steps);
    evaluations_ += static_cast<std::uint64_t>(explicit_evaluations);
  }

  // ---- states

  void write_states() {
    double* y = N_VGetArrayPointer(y_);
    for (const OrbitState& s : states_) {
      put(y, s.r_ECI);
      put(y + 3, s.v_ECI);
      y += kNumbersEach;
    }
  }

  void read_states(SimTime t) { states_ = states_from(y_, t, to_seconds(t - begin_)); }

  /// `since_s` from the begin of the segment on, for the masses; negative backwards.
  std::vector<OrbitState> states_from(N_Vector numbers, SimTime t, double since_s) const {
    const double* y = N_VGetArrayPointer(numbers);
    std::vector<OrbitState> states = states_;
    for (std::size_t i = 0; i < states.size(); ++i, y += kNumbersEach) {
      OrbitState& s = states[i];
      s = {t, vector_at(y), vector_at(y + 3), s.mass_kg - laws_[i].thrust.mass_flow_kgps * since_s};
      if (!(s.mass_kg > 0)) throw PropagationError("a thrust used up all mass", states_[i]);
    }
    return states;
  }

  double direction() const { return end_ > begin_ ? 1 : -1; }
  SimTime instant(double t_s) const { return begin_ + from_seconds(direction() * t_s); }

  /// A force that is switched at the later end has its old value up to it.
  SimTime instant_for_forces(double t_s) const {
    const SimTime later = std::max(begin_, end_), earlier = std::min(begin_, end_);
    return std::clamp(instant(t_s), earlier, std::max(earlier, later - 1ns));
  }

  // ---- callbacks

  /// Runs `body`, and turns what it throws into the status by which a callback gives up.
  template <class Body>
  int guarded(Body&& body) {
    try {
      body();
      return 0;
    } catch (...) {
      error_ = std::current_exception();
      return -1;
    }
  }

  static int derivative(double t_s, N_Vector y, N_Vector rate, void* self) {
    auto& solver = *static_cast<Solver*>(self);
    return solver.guarded([&] { solver.put_derivative(t_s, y, N_VGetArrayPointer(rate)); });
  }

  void put_derivative(double t_s, N_Vector y, double* rate) const {
    const SimTime t = instant_for_forces(t_s);
    const Surroundings around = environment_->surroundings(t);
    const std::vector<OrbitState> states = states_from(y, t, direction() * t_s);
    for (std::size_t i = 0; i < states.size(); ++i, rate += kNumbersEach) {
      if (!(norm(states[i].r_ECI) >= kRadiusEarth_m))
        throw PropagationError("the orbit went below the ground", states_[i]);
      put(rate, direction() * states[i].v_ECI);
      put(rate + 3, direction() * laws_[i].acceleration(states[i], around));
    }
  }

  static int event_values(double t_s, N_Vector y, double* values, void* self) {
    auto& solver = *static_cast<Solver*>(self);
    return solver.guarded([&] {
      const SimTime t = solver.instant(t_s);
      const std::vector<OrbitState> states = solver.states_from(y, t, solver.direction() * t_s);
      const Surroundings around = solver.environment_->surroundings(t);
      for (const EventFunction& f : *solver.functions_) *values++ = f.value(states, around);
    });
  }

  static int error_weights(N_Vector y, N_Vector weights, void* self) {
    const double tolerance = static_cast<Solver*>(self)->options_.tolerance;
    const double* const numbers = N_VGetArrayPointer(y);
    double* const w = N_VGetArrayPointer(weights);
    for (sunindextype i = 0; i < N_VGetLength(y); i += 3) {
      const double weight = 1 / (tolerance * norm(vector_at(numbers + i)));
      put(w + i, {weight, weight, weight});
    }
    return 0;
  }

  static void keep_message(int, const char*, const char*, char* message, void* self) {
    static_cast<Solver*>(self)->message_ = message;
  }

  std::shared_ptr<const SpaceEnvironment> environment_;
  ReferenceOptions options_;
  std::vector<OrbitState> states_;  // at the begin of the segment, or where it stopped
  std::vector<Law> laws_;
  const std::vector<EventFunction>* functions_ = nullptr;  // of the advance_to that runs
  SimTime begin_, end_;                                    // of the segment that runs
  SUNContext context_ = nullptr;
  N_Vector y_ = nullptr;
  void* memory_ = nullptr;
  std::exception_ptr error_;
  std::string message_;
  std::uint64_t steps_ = 0, evaluations_ = 0;
};

ReferencePropagator::ReferencePropagator(std::vector<ReferenceSpacecraft> spacecraft,
                                         std::shared_ptr<const SpaceEnvironment> environment,
                                         const ReferenceOptions& options)
    : solver_(std::make_unique<Solver>(std::move(spacecraft), std::move(environment), options)) {}

ReferencePropagator::~ReferencePropagator() = default;

SimTime ReferencePropagator::time() const {
  return solver_->time();
}

const OrbitState& ReferencePropagator::state(std::size_t spacecraft) const {
  return solver_->state(spacecraft);
}

void ReferencePropagator::advance_to(SimTime t) {
  solver_->advance_to(t, {});
}

std::vector<OrbitEvent> ReferencePropagator::advance_to(
    SimTime t, const std::vector<EventFunction>& functions) {
  return solver_->advance_to(t, functions);
}

void ReferencePropagator::apply_impulse(std::size_t spacecraft, const Vec3& dv_ECI) {
  solver_->apply_impulse(spacecraft, dv_ECI);
}

void ReferencePropagator::set_thrust(std::size_t spacecraft, const Thrust& thrust) {
  solver_->set_thrust(spacecraft, thrust);
}

std::uint64_t ReferencePropagator::steps() const {
  return solver_->steps();
}

std::uint64_t ReferencePropagator::evaluations() const {
  return solver_->evaluations();
}

}  // namespace orrery
