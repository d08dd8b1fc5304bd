#include "rpo_kit/guidance/transfer.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/closed_form_impulses.hpp"
#include "support/orbit/constants.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;

struct OpportunityList {
  Opportunity at[kMaxOpportunities];
  int count = 0;
};

// The chaser's argument of latitude leads the target's by a*dl / a.
OrbitElements chaser_orbit(const RelativeOrbit& now, std::int64_t t_ns) {
  OrbitElements orbit = propagate_mean(now.chief, seconds(t_ns - now.t_ns));
  orbit.u_rad = wrap_two_pi(orbit.u_rad + now.a_roe[kDl] / orbit.a_m);
  return orbit;
}

// All instants between `from` and `end` at which the chaser is at `phase` or opposite.
OpportunityList opportunities(const RelativeOrbit& now, double phase_rad, std::int64_t from_ns,
                              std::int64_t end_ns) {
  OpportunityList list;
  const double rate = secular_rates(now.chief).u_radps;
  const OrbitElements first = chaser_orbit(now, from_ns);
  const double wait = std::fmod(wrap_two_pi(phase_rad - first.u_rad), kPi);
  for (int k = 0; list.count < kMaxOpportunities; ++k) {
    const std::int64_t t_ns = from_ns + nanoseconds((wait + k * kPi) / rate);
    if (t_ns >= end_ns) break;
    const OrbitElements chief = propagate_mean(now.chief, seconds(t_ns - now.t_ns));
    list.at[list.count].t_ns = t_ns;
    list.at[list.count].effect =
        state_transition(chief, seconds(end_ns - t_ns)) * control_input(chaser_orbit(now, t_ns));
    ++list.count;
  }
  return list;
}

const Opportunity* nearest(const OpportunityList& list, std::int64_t t_ns) {
  const Opportunity* best = &list.at[0];
  for (int k = 1; k < list.count; ++k) {
    if (std::llabs(list.at[k].t_ns - t_ns) < std::llabs(best->t_ns - t_ns)) best = &list.at[k];
  }
  return best;
}

void add_burn(std::int64_t t_ns, const Vec3& dv_RTN, Transfer* transfer) {
  for (int k = 0; k < transfer->count; ++k) {
    if (transfer->burns[k].t_ns != t_ns) continue;
    transfer->burns[k].dv_RTN = transfer->burns[k].dv_RTN + dv_RTN;
    return;
  }
  int at = transfer->count++;
  for (; at > 0 && transfer->burns[at - 1].t_ns > t_ns; --at) {
    transfer->burns[at] = transfer->burns[at - 1];
  }
  transfer->burns[at] = {t_ns, dv_RTN};
}

Transfer as_burns(const BurnChoice& choice, const Impulses& impulses, std::int64_t end_ns,
                  double least_mps) {
  Transfer all, kept;
  for (int k = 0; k < choice.count; ++k) {
    add_burn(choice.in_plane[k]->t_ns, vec3(impulses.radial[k], impulses.tangential[k], 0.0), &all);
    add_burn(choice.normal[k]->t_ns, vec3(0.0, 0.0, impulses.normal[k]), &all);
  }
  for (int k = 0; k < all.count; ++k) {
    if (norm(all.burns[k].dv_RTN) < least_mps) continue;
    kept.burns[kept.count++] = all.burns[k];
    kept.delta_v_mps += norm(all.burns[k].dv_RTN);
  }
  kept.end_ns = end_ns;
  return kept;
}

// Angles of lines, not of vectors: modulo pi.
double between_lines_rad(double a_rad, double b_rad) {
  const double d = std::fabs(std::fmod(a_rad - b_rad, kPi));
  return std::min(d, kPi - d);
}

}  // namespace

bool plan_transfer(const RelativeOrbit& now, const RelativeElements& goal, std::int64_t end_ns,
                   const TransferOptions& options, Transfer* transfer) {
  const RelativeElements miss =
      goal - state_transition(now.chief, seconds(end_ns - now.t_ns)) * now.a_roe;
  const double phase = std::atan2(miss[kDey], miss[kDex]);
  double normal_phase = std::atan2(miss[kDiy], miss[kDix]);
  const std::int64_t from_ns = now.t_ns + nanoseconds(options.lead_s);
  const OpportunityList in_plane = opportunities(now, phase, from_ns, end_ns);
  // Nearly one phase is made one: a vector burn is cheaper than two.
  const bool together = between_lines_rad(phase, normal_phase) < 0.02;
  if (together) normal_phase = phase;
  const OpportunityList normal =
      together ? in_plane : opportunities(now, normal_phase, from_ns, end_ns);
  if (in_plane.count < 3 || normal.count < 1) return false;
  bool found = false;
  for (int i = 0; i < in_plane.count; ++i) {
    for (int j = i + 1; j < in_plane.count; ++j) {
      for (int k = j + 1; k < in_plane.count; ++k) {
        BurnChoice choice{};
        const int triple[3] = {i, j, k};
        for (int b = 0; b < 3; ++b) {
          choice.in_plane[b] = &in_plane.at[triple[b]];
          choice.normal[b] =
              together ? choice.in_plane[b] : nearest(normal, choice.in_plane[b]->t_ns);
        }
        choice.count = 3;
        choice.in_plane_phase_rad = phase;
        choice.normal_phase_rad = normal_phase;
        Impulses impulses;
        if (!solve_impulses(choice, miss, &impulses)) continue;
        Transfer plan = as_burns(choice, impulses, end_ns, options.least_burn_mps);
        if (found && plan.delta_v_mps >= transfer->delta_v_mps) continue;
        plan.safe_m = plan_safe_distance_m(now, plan.burns, plan.count);
        if (!(plan.safe_m >= options.keep_out_m)) continue;
        *transfer = plan;
        found = true;
      }
    }
  }
  return found;
}

double least_delta_v_mps(const RelativeOrbit& now, const RelativeElements& goal,
                         std::int64_t end_ns) {
  const double time_s = seconds(end_ns - now.t_ns);
  const RelativeElements miss = goal - state_transition(now.chief, time_s) * now.a_roe;
  const double n = mean_motion_radps(now.chief.a_m);
  const double in_plane =
      0.5 * n * std::max(std::hypot(miss[kDex], miss[kDey]), std::fabs(miss[kDa]));
  return std::max(in_plane, std::fabs(miss[kDl]) / (3.0 * time_s)) +
         n * std::hypot(miss[kDix], miss[kDiy]);
}

double uncertain_safe_m(const RelativeOrbit& now, const Matrix6& covariance, double sigmas) {
  constexpr int kSamples = 240;  // of two revolutions
  const double rate = secular_rates(now.chief).u_radps;
  double least = INFINITY;
  for (int k = 0; k < kSamples; ++k) {
    const double dt_s = 2.0 * kTwoPi * k / (kSamples * rate);
    const OrbitElements chief = propagate_mean(now.chief, dt_s);
    const Matrix6 map =
        rtn_from_relative_elements(chief.u_rad, rate) * state_transition(now.chief, dt_s);
    const Vector<6> r = map * now.a_roe;
    const Matrix6 P = map * covariance * transpose(map);
    // The larger eigenvalue of the 2x2 block of R and N.
    const double mean = 0.5 * (P(0, 0) + P(2, 2)), half = 0.5 * (P(0, 0) - P(2, 2));
    const double largest = mean + std::hypot(half, P(0, 2));
    least = std::min(least, std::hypot(r[0], r[2]) - sigmas * std::sqrt(largest));
  }
  return std::max(least, 0.0);
}

}  // namespace rpo_kit
