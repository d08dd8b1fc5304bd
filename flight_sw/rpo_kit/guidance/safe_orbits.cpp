#include "rpo_kit/guidance/safe_orbits.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/closed_form_impulses.hpp"
#include "support/orbit/constants.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;

// A burn of the chaser at an instant, with its effect on a_roe at the end.
Opportunity opportunity(const RelativeOrbit& now, std::int64_t t_ns, std::int64_t end_ns) {
  const OrbitElements chief = propagate_mean(now.chief, seconds(t_ns - now.t_ns));
  OrbitElements chaser = chief;
  chaser.u_rad = wrap_two_pi(chaser.u_rad + now.a_roe[kDl] / chaser.a_m);
  return {t_ns, state_transition(chief, seconds(end_ns - t_ns)) * control_input(chaser)};
}

// Two burns, of which the first is at the earliest instant of the phase that the change asks for.
bool abort_to(const RelativeOrbit& now, const RelativeElements& goal, double lead_s,
              Transfer* transfer) {
  const double rate = secular_rates(now.chief).u_radps;
  const std::int64_t from_ns = now.t_ns + nanoseconds(lead_s);
  const std::int64_t end_ns = from_ns + nanoseconds(1.3 * kTwoPi / rate);
  const RelativeElements miss =
      goal - state_transition(now.chief, seconds(end_ns - now.t_ns)) * now.a_roe;
  const double phase = std::atan2(miss[kDey], miss[kDex]);
  const double normal_phase = std::atan2(miss[kDiy], miss[kDix]);
  const double u = propagate_mean(now.chief, lead_s).u_rad + now.a_roe[kDl] / now.chief.a_m;
  const auto first_at = [&](double at_rad) {
    return from_ns + nanoseconds(std::fmod(wrap_two_pi(at_rad - u), kPi) / rate);
  };
  const std::int64_t half_ns = nanoseconds(kPi / rate);
  const std::int64_t in_ns = first_at(phase), normal_ns = first_at(normal_phase);
  const Opportunity first = opportunity(now, in_ns, end_ns);
  const Opportunity second = opportunity(now, in_ns + half_ns, end_ns);
  // One normal burn does all of it, as early as it can be.
  const Opportunity across = opportunity(now, normal_ns, end_ns);
  BurnChoice choice{};
  choice.in_plane[0] = &first, choice.in_plane[1] = &second;
  choice.normal[0] = choice.normal[1] = &across;
  choice.count = 2;
  choice.in_plane_phase_rad = phase;
  choice.normal_phase_rad = normal_phase;
  Impulses impulses;
  if (!solve_impulses(choice, miss, &impulses)) return false;
  Transfer plan;
  plan.end_ns = end_ns;
  const Burn burns[3] = {{first.t_ns, vec3(impulses.radial[0], impulses.tangential[0], 0.0)},
                         {second.t_ns, vec3(impulses.radial[1], impulses.tangential[1], 0.0)},
                         {across.t_ns, vec3(0.0, 0.0, impulses.normal[0] + impulses.normal[1])}};
  for (const Burn& burn : burns) {
    if (!(norm(burn.dv_RTN) > 1e-6)) continue;
    plan.burns[plan.count++] = burn;
    plan.delta_v_mps += norm(burn.dv_RTN);
  }
  std::stable_sort(plan.burns, plan.burns + plan.count,
                   [](const Burn& a, const Burn& b) { return a.t_ns < b.t_ns; });
  plan.safe_m = plan_safe_distance_m(now, plan.burns, plan.count);
  *transfer = plan;
  return true;
}

}  // namespace

RelativeElements safe_orbit(double along_track_m, double radius_m, double phase_rad) {
  RelativeElements a_roe;
  a_roe[kDl] = along_track_m;
  a_roe[kDex] = a_roe[kDix] = radius_m * std::cos(phase_rad);
  a_roe[kDey] = a_roe[kDiy] = radius_m * std::sin(phase_rad);
  return a_roe;
}

double common_phase_rad(const RelativeElements& a_roe) {
  const double e = std::hypot(a_roe[kDex], a_roe[kDey]), i = std::hypot(a_roe[kDix], a_roe[kDiy]);
  return e > i ? std::atan2(a_roe[kDey], a_roe[kDex]) : std::atan2(a_roe[kDiy], a_roe[kDix]);
}

bool plan_abort(const RelativeOrbit& now, double safe_m, double drift_m, double lead_s,
                Transfer* transfer) {
  constexpr int kPhases = 36;
  bool found = false;
  for (int k = 0; k < 2 * kPhases; ++k) {
    const double phase = kTwoPi * (k % kPhases) / kPhases;
    RelativeElements goal = safe_orbit(0.0, safe_m, phase);
    // Anti-parallel vectors are as safe as parallel ones.
    if (k >= kPhases) goal[kDix] = -goal[kDix], goal[kDiy] = -goal[kDiy];
    // a*dl' = -1.5 n a*da: behind the target a higher orbit falls back further.
    goal[kDa] = now.a_roe[kDl] < 0.0 ? drift_m : -drift_m;
    Transfer plan;
    if (!abort_to(now, goal, lead_s, &plan)) continue;
    const double gained = std::min(plan.safe_m, 0.5 * safe_m);
    const double best = found ? std::min(transfer->safe_m, 0.5 * safe_m) : -1.0;
    if (gained > best + 1e-6 ||
        (gained > best - 1e-6 && plan.delta_v_mps < transfer->delta_v_mps)) {
      *transfer = plan;
      found = true;
    }
  }
  return found;
}

}  // namespace rpo_kit
