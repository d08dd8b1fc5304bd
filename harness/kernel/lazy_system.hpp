/// A continuous system that is propagated only when somebody looks, on a grid that does not depend
/// on who looks.
///
/// Grid    start + k * step, cut at discontinuities: those the model announces, those that happen
///         (an impulse, a thruster that opens), and those the state itself runs into (the edge of
///         a shadow). After a cut the next point is on the fixed grid again. The states at these
///         points are the truth: each follows from the one before by one call of Model::step,
///         whatever was looked at.
/// Looks   Between two points a look is interpolated, towards the next point as it will be if
///         nothing happens. That point is kept, and becomes truth when its time has come, or is
///         dropped when a discontinuity comes first. Hence a look costs at most one step ahead, and
///         looking more often changes no bit of the truth, nor of what another look sees.
/// Time    Looks and discontinuities come in the order of time, at the event loop's now(): what is
///         asked for is final. Looking ahead would commit what an event may still change.
/// Checked by  test_suites/unit/harness/kernel/lazy_system_test.cpp
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <concepts>
#include <cstdint>
#include <optional>
#include <utility>

namespace orrery {

/// What LazySystem propagates. All three are functions of their arguments and of what was set in
/// the model; that may change only within LazySystem::discontinuity().
///
///   step                the state at `to`, from the state at `from`. No discontinuity lies between
///                       them; one at `to` has not happened yet.
///   interpolate         the state at t, t_a < t < t_b, from the states a and b.
///   next_discontinuity  the first announced one after t (not at t), if there is one.
template <class M>
concept ContinuousModel = requires(M& model, const typename M::State& x, SimTime t) {
  { model.step(x, t, t) } -> std::convertible_to<typename M::State>;
  { model.interpolate(x, t, x, t, t) } -> std::convertible_to<typename M::State>;
  { model.next_discontinuity(t) } -> std::convertible_to<std::optional<SimTime>>;
};

/// A model whose state may meet edges. After a trial step from a to b:
///
///   has_edges whether there are any; without, no step is made for their sake.
///   crossing  the first edge met in (t_a, t_b], if there is one; `.t` is its instant. The point
///             is put there, by a step of its own.
///   beyond    the state at that point as the next step starts from it. A look before the point is
///             interpolated towards it, so nothing that interpolate() uses of its end may change.
template <class M>
concept ModelWithEdges = ContinuousModel<M> &&
    requires(M& model, const typename M::State& x, SimTime t) {
  { model.crossing(x, t, x, t)->t } -> std::convertible_to<SimTime>;
  { model.beyond(x, *model.crossing(x, t, x, t)) } -> std::convertible_to<typename M::State>;
};

namespace internal {

/// What does not depend on the model: the grid, and the messages.
class LazyGrid {
 public:
  /// @throws std::invalid_argument  step <= 0.
  LazyGrid(SimTime start, Duration step);
  /// First point of the fixed grid after t >= start.
  SimTime next(SimTime t) const;
  /// The same, cut at an announced discontinuity. @throws std::logic_error  it is not after t.
  SimTime next(SimTime t, std::optional<SimTime> discontinuity) const;
  /// @throws std::logic_error  t before `committed`; gives both.
  static void require_not_past(const char* function, SimTime t, SimTime committed);
  /// `edge`. @throws std::logic_error  it is not in (from, to].
  static SimTime require_within(SimTime from, SimTime edge, SimTime to);

 private:
  SimTime start_;
  Duration step_;
};

}  // namespace internal

template <ContinuousModel Model>
class LazySystem {
 public:
  using State = typename Model::State;

  /// @throws std::invalid_argument  step <= 0.
  LazySystem(Model model, State initial, SimTime start, Duration step)
      : model_(std::move(model)), grid_(start, step), t_(start), x_(std::move(initial)) {}

  /// The state at `t`. On a point at which something happened: the state after it.
  /// @throws std::logic_error  t before the last point that was committed.
  State at(SimTime t) {
    internal::LazyGrid::require_not_past("at", t, t_);
    commit_until(t);
    if (t == t_) return x_;
    const State& next = ahead();
    ++interpolations_;
    return model_.interpolate(x_, t_, next, next_time(), t);
  }

  /// Something happens at `t`: the system is propagated to t exactly, and change(State&) applied.
  /// The model may be changed in `change` as well; if that is all, it leaves the state alone. When
  /// it throws, the state is that before the change.
  /// @throws std::logic_error  t before the last point that was committed.
  template <std::invocable<State&> Change>
  void discontinuity(SimTime t, Change&& change) {
    internal::LazyGrid::require_not_past("discontinuity", t, t_);
    commit_until(t);
    if (t != t_) commit(propagate(t), t);
    forget_ahead();
    State changed = x_;
    std::forward<Change>(change)(changed);
    x_ = std::move(changed);
  }

  /// The last point that is final, and the state there.
  SimTime committed_time() const { return t_; }
  const State& committed() const { return x_; }

  const Model& model() const { return model_; }
  /// To be changed within discontinuity() only.
  Model& model() { return model_; }

  /// Calls of Model::step so far; those that a discontinuity or an edge made useless are counted.
  std::uint64_t steps() const { return steps_; }
  std::uint64_t interpolations() const { return interpolations_; }

 private:
  void commit_until(SimTime t) {
    while (t_ < t) {  // nothing is asked of the model for t itself
      // Where the next edge is shows only when the whole step has been tried; that step must not
      // depend on who looks, so it is the one to the grid point.
      if (!has_edges() && next_time() > t) return;
      ahead();
      if (next_time() > t) return;
      commit(std::move(*ahead_), *next_t_);
    }
  }

  SimTime next_time() {
    if (!next_t_) next_t_ = grid_.next(t_, model_.next_discontinuity(t_));
    return *next_t_;
  }

  const State& ahead() {
    if (ahead_) return *ahead_;
    ahead_ = propagate(next_time());
    if constexpr (ModelWithEdges<Model>) {
      if (has_edges()) cut_at_edge();
    }
    return *ahead_;
  }

  bool has_edges() const {
    if constexpr (ModelWithEdges<Model>) return model_.has_edges();
    return false;
  }

  void cut_at_edge() {
    const auto edge = model_.crossing(x_, t_, *ahead_, *next_t_);
    if (!edge) return;
    next_t_ = internal::LazyGrid::require_within(t_, edge->t, *next_t_);
    ahead_ = model_.beyond(propagate(*next_t_), *edge);
  }

  State propagate(SimTime to) {
    ++steps_;
    return model_.step(x_, t_, to);
  }

  void commit(State&& x, SimTime t) {
    x_ = std::move(x);
    t_ = t;
    forget_ahead();
  }

  void forget_ahead() {
    next_t_.reset();
    ahead_.reset();
  }

  Model model_;
  internal::LazyGrid grid_;
  SimTime t_;
  State x_;
  std::optional<SimTime> next_t_;  // of the point after t_, once it was asked for
  std::optional<State> ahead_;     // the state there
  std::uint64_t steps_ = 0;
  std::uint64_t interpolations_ = 0;
};

}  // namespace orrery
