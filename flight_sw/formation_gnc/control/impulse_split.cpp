#include "formation_gnc/control/impulse_split.hpp"

#include <cmath>

#include "formation_gnc/control/socp_solver.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

// Of the program: metres, and mm/s, so that numbers are neither large nor small.
constexpr double kUnit_mps = 1e-3;
constexpr int kMaxRounds = 6;
constexpr int kVectorElements = 4;  // a*dex, a*dey, a*dix, a*diy

struct Waypoint {
  std::int64_t t_ns;
  RelativeElements miss;  // what impulses up to then add up to, there
};

// Start and goal drift to the waypoint, one forward and one back, and it lies between them.
std::vector<Waypoint> make_waypoints(const TransferStart& start, const TransferGoal& goal,
                                     const Window& window, int count) {
  std::vector<Waypoint> waypoints;
  for (int k = 1; k <= count; ++k) {
    const double share = static_cast<double>(k) / (count + 1);
    const std::int64_t t_ns =
        window.first_ns + nanoseconds(share * seconds(window.last_ns - window.first_ns));
    const Matrix6 back =
        state_transition(chief_at(start, goal.end_ns), seconds(t_ns - goal.end_ns));
    waypoints.push_back({t_ns, share * (back * goal.a_roe - coast(start, t_ns))});
  }
  return waypoints;
}

class SplittingProgram {
 public:
  SplittingProgram(const TransferStart& start, const TransferGoal& goal,
                   const TransferOptions& options, std::vector<Waypoint> waypoints,
                   const std::vector<Candidate>& candidates)
      : start_(start),
        options_(options),
        waypoints_(std::move(waypoints)),
        candidates_(candidates),
        miss_(transfer_miss(start, goal)) {
    for (int k = 0; k < 6; ++k) {
      if (k != kDl || !goal.along_track_free) elements_.push_back(k);
    }
  }

  // With the candidates whose indices are in `used`.
  SocpSolution solve(const std::vector<int>& used) const {
    const int N = static_cast<int>(used.size());
    SparseSocp problem;
    problem.c = Eigen::VectorXd::Zero(4 * N);
    for (int k = 0; k < N; ++k) problem.c[4 * k + 3] = 1.0;
    fill_b(&problem);
    fill_A(used, &problem);
    fill_G(N, &problem);
    return SocpSolver().solve(problem);
  }

 private:
  int goal_rows() const { return static_cast<int>(elements_.size()); }
  int rows() const { return goal_rows() + kVectorElements * static_cast<int>(waypoints_.size()); }

  void fill_b(SparseSocp* problem) const {
    problem->b.resize(rows());
    int row = 0;
    for (const int element : elements_) problem->b[row++] = miss_[element];
    for (const Waypoint& waypoint : waypoints_) {
      for (int k = kDex; k <= kDiy; ++k) problem->b[row++] = waypoint.miss[k];
    }
  }

  // Column by column: triplets would take twice the room.
  void fill_A(const std::vector<int>& used, SparseSocp* problem) const {
    problem->A.resize(rows(), 4 * static_cast<int>(used.size()));
    problem->A.reserve(3 * rows() * static_cast<int>(used.size()));
    int column = 0;
    for (const int index : used) {
      const Candidate& candidate = candidates_[static_cast<std::size_t>(index)];
      const OrbitElements at = chief_at(start_, candidate.t_ns);
      const Matrix<6, 3> B = control_input(at);
      for (int axis = 0; axis < 3; ++axis, ++column) {
        problem->A.startVec(column);
        int row = 0;
        for (const int element : elements_) {
          problem->A.insertBack(row++, column) = kUnit_mps * candidate.effect(element, axis);
        }
        for (const Waypoint& waypoint : waypoints_) {
          if (candidate.t_ns > waypoint.t_ns) {
            row += kVectorElements;
            continue;
          }
          const Matrix<6, 3> effect =
              state_transition(at, seconds(waypoint.t_ns - candidate.t_ns)) * B;
          for (int k = kDex; k <= kDiy; ++k) {
            problem->A.insertBack(row++, column) = kUnit_mps * effect(k, axis);
          }
        }
      }
      problem->A.startVec(column++);
    }
    problem->A.finalize();
  }

  // s_k <= max in the orthant, then (s_k, v_k) in a cone each.
  void fill_G(int N, SparseSocp* problem) const {
    problem->G.resize(5 * N, 4 * N);
    problem->G.reserve(5 * N);
    for (int k = 0; k < N; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        problem->G.startVec(4 * k + axis);
        problem->G.insertBack(N + 4 * k + 1 + axis, 4 * k + axis) = -1.0;
      }
      problem->G.startVec(4 * k + 3);
      problem->G.insertBack(k, 4 * k + 3) = 1.0;
      problem->G.insertBack(N + 4 * k, 4 * k + 3) = -1.0;
    }
    problem->G.finalize();
    problem->h = Eigen::VectorXd::Zero(5 * N);
    problem->h.head(N).setConstant(options_.limits.max_mps / kUnit_mps);
    problem->orthant = N;
    problem->cones.assign(static_cast<std::size_t>(N), 4);
  }

  const TransferStart& start_;
  const TransferOptions& options_;
  std::vector<Waypoint> waypoints_;
  const std::vector<Candidate>& candidates_;
  RelativeElements miss_;
  std::vector<int> elements_;
};

Vec3 impulse_of(const SocpSolution& solution, int k) {
  return kUnit_mps * vec3(solution.x[4 * k], solution.x[4 * k + 1], solution.x[4 * k + 2]);
}

}  // namespace

ImpulseSplit split_by_cone_program(const TransferStart& start, const TransferGoal& goal,
                                   const TransferOptions& options, int waypoints,
                                   const std::vector<Candidate>& candidates) {
  const Window window = burn_window(start, goal, options);
  const SplittingProgram program(start, goal, options,
                                 make_waypoints(start, goal, window, waypoints), candidates);
  ImpulseSplit split;
  std::vector<int> used(candidates.size());
  for (std::size_t k = 0; k < used.size(); ++k) used[k] = static_cast<int>(k);
  // Those too small for the thruster go; the last rounds let what is still too small go at once.
  for (int round = 0; round < kMaxRounds && !used.empty(); ++round) {
    const SocpSolution solution = program.solve(used);
    split.iterations += solution.iterations;
    if (!solution.solved()) break;
    std::vector<int> kept;
    split.dv_RTN.assign(candidates.size(), Vec3());
    for (std::size_t k = 0; k < used.size(); ++k) {
      const Vec3 dv = impulse_of(solution, static_cast<int>(k));
      if (norm(dv) < options.limits.min_mps) continue;
      split.dv_RTN[static_cast<std::size_t>(used[k])] = dv;
      kept.push_back(used[k]);
    }
    split.found = true;
    if (kept.size() == used.size()) break;
    used = std::move(kept);
  }
  return split;
}

double joint_bound_mps(const TransferGoal& goal, const RelativeElements& miss,
                       const std::vector<Candidate>& candidates) {
  const int N = static_cast<int>(candidates.size());
  SparseSocp problem;
  problem.c.resize(6);
  for (int k = 0; k < 6; ++k) problem.c[k] = -miss[k];
  problem.G.resize(4 * N, 6);
  problem.G.reserve(18 * N);
  for (int element = 0; element < 6; ++element) {
    problem.G.startVec(element);
    const bool free = element == kDl && goal.along_track_free;
    for (int k = 0; k < N && !free; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const double effect = candidates[static_cast<std::size_t>(k)].effect(element, axis);
        problem.G.insertBack(4 * k + 1 + axis, element) = effect;
      }
    }
  }
  problem.G.finalize();
  problem.h = Eigen::VectorXd::Zero(4 * N);
  for (int k = 0; k < N; ++k) problem.h[4 * k] = 1.0;
  problem.cones.assign(static_cast<std::size_t>(N), 4);
  if (goal.along_track_free) {  // lambda of a free element is zero
    problem.A.resize(1, 6);
    problem.A.insert(0, kDl) = 1.0;
    problem.b = Eigen::VectorXd::Zero(1);
  }
  const SocpSolution solution = SocpSolver().solve(problem);
  return solution.solved() ? -solution.primal_objective : -1.0;
}

}  // namespace formation_gnc
