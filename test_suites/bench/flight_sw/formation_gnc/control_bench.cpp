// Control of formation_gnc: cone programs, plans, trims and forecasts, on the host.
#include <benchmark/benchmark.h>

#include <cmath>

#include "formation_gnc/control/fine_alignment.hpp"
#include "formation_gnc/control/reconfiguration_planner.hpp"
#include "formation_gnc/control/science_orbit.hpp"
#include "formation_gnc/control/separation_monitor.hpp"
#include "formation_gnc/control/socp_solver.hpp"
#include "formation_gnc/control/sun_direction.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {
namespace {

using namespace flight_support;

constexpr std::int64_t kEpoch_ns = (2358LL * 604800 + 4 * 86400) * kSecond_ns;

// d(a ROE) = (0, 0, 150, 80, 100, 120) m by N impulses of at most 9 mm/s (270 mm/s in all at N =
// 30) over six revolutions, Keplerian.
SparseSocp splitting(int N) {
  const double n = 1.0948e-3, T = 6.0 * kTwoPi / n, goal[6] = {0, 0, 150, 80, 100, 120};
  SparseSocp p;
  p.A.resize(6, 4 * N);
  p.G.resize(5 * N, 4 * N);
  for (int k = 0; k < N; ++k) {
    const double t = T * (k + 0.5) / N, s = std::sin(n * t), c = std::cos(n * t), m = 1e-3 / n;
    const double B[6][3] = {{0, 2 * m, 0},         {-2 * m, -3.0 * n * (T - t) * m, 0},
                            {s * m, 2 * c * m, 0}, {-c * m, 2 * s * m, 0},
                            {0, 0, c * m},         {0, 0, s * m}};
    for (int axis = 0; axis < 3; ++axis) {
      for (int r = 0; r < 6; ++r) {
        if (B[r][axis] != 0.0) p.A.insert(r, 4 * k + axis) = B[r][axis];
      }
      p.G.insert(N + 4 * k + 1 + axis, 4 * k + axis) = -1.0;
    }
    p.G.insert(k, 4 * k + 3) = 1.0;
    p.G.insert(N + 4 * k, 4 * k + 3) = -1.0;
  }
  p.b = Eigen::Map<const Eigen::VectorXd>(goal, 6);
  p.h = Eigen::VectorXd::Zero(5 * N);
  p.h.head(N).setConstant(std::max(3.0, 450.0 / N));
  p.c = Eigen::VectorXd::Zero(4 * N);
  for (int k = 0; k < N; ++k) p.c[4 * k + 3] = 1.0;
  p.orthant = N;
  p.cones.assign(static_cast<std::size_t>(N), 4);
  return p;
}

void BM_SocpSolver_Sparse(benchmark::State& state) {
  const SparseSocp problem = splitting(static_cast<int>(state.range(0)));
  int iterations = 0;
  for (auto _ : state) {
    const SocpSolution solution = SocpSolver().solve(problem);
    if (!solution.solved()) state.SkipWithError(to_string(solution.status));
    iterations = solution.iterations;
  }
  state.counters["iterations"] = iterations;
}
BENCHMARK(BM_SocpSolver_Sparse)->Arg(30)->Arg(150)->Arg(600)->Unit(benchmark::kMillisecond);

// One block of all variables, as a full G has it.
void BM_SocpSolver_OneBlock(benchmark::State& state) {
  SparseSocp problem = splitting(static_cast<int>(state.range(0)));
  const Eigen::MatrixXd G = problem.G;
  problem.G.setZero();
  problem.G.reserve(Eigen::VectorXi::Constant(G.cols(), static_cast<int>(G.rows())));
  for (int c = 0; c < G.cols(); ++c) {
    for (int r = 0; r < G.rows(); ++r) problem.G.insert(r, c) = G(r, c);
  }
  for (auto _ : state) {
    const SocpSolution solution = SocpSolver().solve(problem);
    if (!solution.solved()) state.SkipWithError(to_string(solution.status));
  }
}
BENCHMARK(BM_SocpSolver_OneBlock)->Arg(30)->Unit(benchmark::kMillisecond);

OrbitElements visors_chief() {
  OrbitElements chief;
  chief.a_m = 6928137.0;
  chief.ex = 0.0006;
  chief.ey = 0.0008;
  chief.i_rad = 97.59 * kPi / 180.0;
  chief.u_rad = 0.7;
  const Vec3 sun = sun_direction_EME2000(kEpoch_ns);
  chief.raan_rad = wrap_two_pi(std::atan2(sun[1], sun[0]) - kPi / 4.0);
  return chief;
}

struct Transfer {
  TransferStart start;
  TransferGoal goal;
  TransferOptions options;
};
// Standby to science in 20 h.
Transfer transfer() {
  Transfer t;
  const OrbitElements chief = visors_chief();
  t.start.orbit = {kEpoch_ns, chief, {{{0}, {0}, {0}, {-200}, {0}, {-200}}}};
  const Vec3 sun = sun_direction_EME2000(kEpoch_ns + 72000 * kSecond_ns);
  t.goal.end_ns = observation_epoch_ns(chief, kEpoch_ns, sun, kEpoch_ns + 72000 * kSecond_ns);
  t.goal.a_roe =
      science_elements(propagate_mean(chief, seconds(t.goal.end_ns - kEpoch_ns)), sun, 40.0);
  t.options.last_ns = t.goal.end_ns - 2400 * kSecond_ns;
  return t;
}

void BM_ReconfigurationPlanner_StandbyToScience(benchmark::State& state) {
  Transfer t = transfer();
  t.options.use_cone_program = state.range(0) != 0;
  for (auto _ : state) {
    const TransferPlan plan = ReconfigurationPlanner(t.options).plan(t.start, t.goal);
    if (!plan.usable()) state.SkipWithError(to_string(plan.status));
    state.counters["delta_v_mps"] = plan.delta_v_mps;
    state.counters["candidates"] = plan.candidates;
  }
}
BENCHMARK(BM_ReconfigurationPlanner_StandbyToScience)
    ->ArgName("cone_program")
    ->Arg(1)
    ->Arg(0)
    ->Unit(benchmark::kMillisecond);

SeparationState formation() {
  const Transfer t = transfer();
  SeparationState now;
  now.t_ns = kEpoch_ns;
  now.chief = state_from_osculating(osculating_from_mean(t.start.orbit.chief));
  now.deputy = state_from_osculating(
      osculating_from_mean(apply_relative_elements(t.start.orbit.chief, t.start.orbit.a_roe)));
  for (int k = 0; k < 3; ++k) {
    now.relative_covariance_RTN(k, k) = 1e-4;
    now.relative_covariance_RTN(k + 3, k + 3) = 1e-9;
  }
  return now;
}

void BM_SeparationMonitor_Forecast(benchmark::State& state) {
  const SeparationState now = formation();
  for (auto _ : state) {
    SeparationForecast forecast = SeparationMonitor().forecast(now);
    benchmark::DoNotOptimize(forecast);
  }
}
BENCHMARK(BM_SeparationMonitor_Forecast)->Unit(benchmark::kMicrosecond);

// 40 min ahead, with J2 to J4.
void BM_FineAlignment_Plan(benchmark::State& state) {
  const SeparationState f = formation();
  const ZonalGravity gravity;
  const FineAlignment alignment(gravity);
  const Vec3 sun = sun_direction_EME2000(kEpoch_ns);
  for (auto _ : state) {
    TrimPlan plan =
        alignment.plan({f.t_ns, f.chief, f.deputy}, f.t_ns, f.t_ns + 2400 * kSecond_ns, sun, true);
    benchmark::DoNotOptimize(plan);
  }
}
BENCHMARK(BM_FineAlignment_Plan)->Unit(benchmark::kMicrosecond);

void BM_SunDirection(benchmark::State& state) {
  std::int64_t t_ns = kEpoch_ns;
  for (auto _ : state) {
    Vec3 sun = sun_direction_EME2000(t_ns);
    benchmark::DoNotOptimize(sun);
    t_ns += kSecond_ns;
  }
}
BENCHMARK(BM_SunDirection)->Unit(benchmark::kNanosecond);

}  // namespace
}  // namespace formation_gnc
