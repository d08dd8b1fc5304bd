#include <algorithm>
#include <cmath>

#include "formation_gnc/control/impulse_split.hpp"
#include "support/orbit/constants.hpp"

namespace formation_gnc {

using namespace flight_support;

namespace {

// Changes below this have no phase worth flying to [m].
constexpr double kNoChange_m = 0.02;
// Of the largest impulse, when parts are counted: the correction afterwards needs the rest, and
// where that is not enough, parts are made smaller.
constexpr double kFills[] = {0.85, 0.7, 0.55, 0.4};
// Phases of e and i vector that differ by less are flown as one, that of the latter; radial parts
// do what is missing of a*de.
constexpr double kJoint_rad = 0.26;
constexpr int kCorrections = 3;
constexpr int kT = 1, kN = 2;  // axes

// Candidates whose effect on the vector (x, y), by `axis`, is nearest to the direction `phase_rad`
// or opposite to it: nearer than that of both neighbours. The effect is that at the end, so that
// what J2 makes of it on the way is in it.
std::vector<int> passages(const std::vector<Candidate>& candidates, int x, int y, int axis,
                          double phase_rad) {
  std::vector<double> off(candidates.size());
  for (std::size_t k = 0; k < off.size(); ++k) {
    const Matrix<6, 3>& E = candidates[k].effect;
    off[k] = std::fabs(wrap_pi(2.0 * (std::atan2(E(y, axis), E(x, axis)) - phase_rad))) / 2.0;
  }
  std::vector<int> found;
  for (std::size_t k = 1; k + 1 < off.size(); ++k) {
    if (off[k] <= off[k - 1] && off[k] < off[k + 1]) found.push_back(static_cast<int>(k));
  }
  return found;
}

// Passages of both phases, in pairs that are close in time; evenly thinned out, and each half turn
// as often as the other, if there are more than the closed form takes.
BurnChoice choose_burns(const std::vector<Candidate>& candidates, const RelativeElements& miss) {
  const bool de = std::hypot(miss[kDex], miss[kDey]) > kNoChange_m;
  const bool di = std::hypot(miss[kDix], miss[kDiy]) > kNoChange_m;
  BurnChoice choice{};
  const double de_phase = std::atan2(miss[kDey], miss[kDex]);
  const double di_phase = std::atan2(miss[kDiy], miss[kDix]);
  choice.in_plane_phase_rad = de ? de_phase : (di ? di_phase : 0.0);
  choice.normal_phase_rad = di ? di_phase : choice.in_plane_phase_rad;
  const std::vector<int> normal = passages(candidates, kDix, kDiy, kN, choice.normal_phase_rad);
  const double apart_rad = std::fabs(wrap_pi(2.0 * (de_phase - di_phase))) / 2.0;
  const bool joint = de && di && apart_rad < kJoint_rad;
  if (joint) choice.in_plane_phase_rad = di_phase;
  const std::vector<int> in_plane =
      joint ? normal : passages(candidates, kDex, kDey, kT, choice.in_plane_phase_rad);
  const int count = static_cast<int>(std::min(in_plane.size(), normal.size()));
  choice.count = std::min(count, kMaxOpportunities);
  for (int k = 0; k < choice.count; ++k) {
    const std::size_t from = static_cast<std::size_t>(k * count / choice.count);
    choice.in_plane[k] = &candidates[static_cast<std::size_t>(in_plane[from])];
    choice.normal[k] = &candidates[static_cast<std::size_t>(normal[from])];
  }
  return choice;
}

// Puts `dv` on the candidates around `middle`, in equal parts. Parts off the phase by up to half
// the arc D do sinc(D/2) of what they would do together, and get that much more.
void split_around(const Candidate* middle, const Vec3& dv, double part_mps,
                  const TransferStart& start, const std::vector<Candidate>& candidates,
                  std::vector<Vec3>* dv_RTN) {
  const int last = static_cast<int>(candidates.size()) - 1;
  const int parts = std::max(1, static_cast<int>(std::ceil(norm(dv) / part_mps)));
  const int index = static_cast<int>(middle - candidates.data());
  const int from = std::max(0, std::min(index - (parts - 1) / 2, last + 1 - parts));
  const int to = std::min(last, from + parts - 1);
  const double arc_rad = mean_motion_radps(start.orbit.chief.a_m) *
                         seconds(candidates[static_cast<std::size_t>(to)].t_ns -
                                 candidates[static_cast<std::size_t>(from)].t_ns);
  const double efficiency = arc_rad > 1e-6 ? std::sin(arc_rad / 2.0) / (arc_rad / 2.0) : 1.0;
  for (int k = from; k <= to; ++k) {
    Vec3& part = (*dv_RTN)[static_cast<std::size_t>(k)];
    part = part + (1.0 / (efficiency * (to - from + 1))) * dv;
  }
}

// The least change, in the sense of least squares over the impulses that are there, that makes up
// `left`: dv_k += E_k' (sum E_k E_k')^-1 left.
bool correct(const std::vector<Candidate>& candidates, bool along_track_free,
             const RelativeElements& left, std::vector<Vec3>* dv_RTN) {
  Matrix6 gram;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (!(norm((*dv_RTN)[k]) > 0.0)) continue;
    const Matrix<6, 3>& E = candidates[k].effect;
    gram = gram + E * transpose(E);
  }
  // Each row in its own size: a*dl is a hundred times the others.
  Vector<6> scale, right, weights;
  for (int r = 0; r < 6; ++r) {
    scale[r] = r == kDl && along_track_free ? 0.0 : 1.0 / std::sqrt(gram(r, r));
    if (!std::isfinite(scale[r])) return false;
    right[r] = scale[r] * left[r];
  }
  Matrix6 scaled = diagonal(scale) * gram * diagonal(scale);
  if (along_track_free) scaled(kDl, kDl) = 1.0;
  if (!solve(scaled, right, &weights)) return false;
  for (int r = 0; r < 6; ++r) weights[r] *= scale[r];
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    Vec3& dv = (*dv_RTN)[k];
    if (norm(dv) > 0.0) dv = dv + transpose(candidates[k].effect) * weights;
  }
  return true;
}

bool within_limits(const std::vector<Vec3>& dv_RTN, const ImpulseLimits& limits) {
  for (const Vec3& dv : dv_RTN) {
    // To rounding; written so that a NaN is not within.
    if (!(norm(dv) <= limits.max_mps * (1.0 + 1e-9))) return false;
  }
  return true;
}

// The closed-form burns in parts of at most `part_mps`, corrected.
ImpulseSplit split_in_parts(const TransferStart& start, const TransferGoal& goal,
                            const TransferOptions& options,
                            const std::vector<Candidate>& candidates, const BurnChoice& choice,
                            const Impulses& impulses, double part_mps) {
  ImpulseSplit split;
  split.dv_RTN.assign(candidates.size(), Vec3());
  const auto split_at = [&](const Candidate* middle, const Vec3& dv, double size_mps) {
    split_around(middle, dv, size_mps, start, candidates, &split.dv_RTN);
  };
  for (int k = 0; k < choice.count; ++k) {
    const Vec3 in_plane = vec3(impulses.radial[k], impulses.tangential[k], 0.0);
    const Vec3 normal = vec3(0.0, 0.0, impulses.normal[k]);
    if (choice.in_plane[k] == choice.normal[k]) {
      split_at(choice.in_plane[k], in_plane + normal, part_mps);
    } else {  // at right angles, where their parts meet
      split_at(choice.in_plane[k], in_plane, part_mps / std::sqrt(2.0));
      split_at(choice.normal[k], normal, part_mps / std::sqrt(2.0));
    }
  }
  const RelativeElements miss = transfer_miss(start, goal);
  for (int round = 0; round < kCorrections; ++round) {
    RelativeElements left = miss - total_effect(candidates, split.dv_RTN);
    if (goal.along_track_free) left[kDl] = 0.0;
    if (!correct(candidates, goal.along_track_free, left, &split.dv_RTN)) return split;
    for (Vec3& dv : split.dv_RTN) {
      if (norm(dv) < options.limits.min_mps) dv = Vec3();
    }
  }
  split.found = within_limits(split.dv_RTN, options.limits);
  return split;
}

}  // namespace

ImpulseSplit split_closed_form(const TransferStart& start, const TransferGoal& goal,
                               const TransferOptions& options,
                               const std::vector<Candidate>& candidates) {
  ImpulseSplit split;
  const RelativeElements miss = transfer_miss(start, goal);
  const BurnChoice choice = choose_burns(candidates, miss);
  Impulses impulses;
  if (choice.count < 2 || !solve_impulses(choice, miss, &impulses)) return split;
  for (const double fill : kFills) {
    split = split_in_parts(start, goal, options, candidates, choice, impulses,
                           fill * options.limits.max_mps);
    if (split.found) break;
  }
  return split;
}

}  // namespace formation_gnc
