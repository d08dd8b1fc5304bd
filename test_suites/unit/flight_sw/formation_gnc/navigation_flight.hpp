/// Flights of the navigation filter through navigation_scene.hpp: epochs lost and late on their
/// way, errors against truth, integers judged. ORRERY_SEED chooses the first seed, ORRERY_RUNS how
/// many the longest test flies.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "formation_gnc/navigation/navigation.hpp"
#include "navigation_scene.hpp"

namespace orrery::navigation_flight {

namespace fg = formation_gnc;
using fg::Navigation;
using fg::Who;
using Epoch = NavigationScene::Epoch;

inline std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

inline std::uint64_t first_seed() {
  return number_from("ORRERY_SEED", 1);
}

inline Vec3 to_vec3(const flight_support::Vec3& v) {
  return {v[0], v[1], v[2]};
}

/// The companion's epochs on their way: lost in bursts and late, as the reference mission's
/// crosslink.
class Link {
 public:
  Link(std::uint64_t seed, bool losses) : random_(seed), losses_(losses) {}

  void send(const Epoch& e) {
    on_ = on_ ? !random_.bernoulli(0.05) : random_.bernoulli(0.25);
    const double delay_s = random_.log_normal(0, 0.767528);
    const bool lost = losses_ && !on_;
    if (lost || dark || !e.measured[1]) return;
    waiting_.push_back({e.t_ns + static_cast<std::int64_t>(1e9 * delay_s), e});
  }
  void deliver(std::int64_t until_ns, Navigation* navigation) {
    const auto earlier = [](const Message& a, const Message& b) { return a.at_ns < b.at_ns; };
    std::sort(waiting_.begin(), waiting_.end(), earlier);
    while (!waiting_.empty() && waiting_.front().at_ns <= until_ns) {
      const Epoch& e = waiting_.front().epoch;
      navigation->remote_epoch(*e.measured[1], e.q_BI[1]);
      waiting_.erase(waiting_.begin());
    }
  }
  bool dark = false;

 private:
  struct Message {
    std::int64_t at_ns;
    Epoch epoch;
  };
  RandomStream random_;
  bool losses_, on_ = true;
  std::vector<Message> waiting_;
};

inline void give_own(const Epoch& e, Navigation* navigation) {
  for (const auto& ephemeris : e.ephemerides[0]) navigation->ephemeris(ephemeris);
  if (e.measured[0]) navigation->own_epoch(*e.measured[0], e.q_BI[0]);
}

/// Everything that an estimate can be held against.
struct Errors {
  double r_m = 0, v_mps = 0, absolute_m = 0;  // 3D
  double normalised[6] = {};                  // of relative r and v, per axis
};

inline Errors errors_of(const fg::FormationEstimate& e, const OrbitState& self,
                        const OrbitState& other) {
  const Vec3 r = to_vec3(e.r_relative_ECI) - (other.r_ECI - self.r_ECI);
  const Vec3 v = to_vec3(e.v_relative_ECI) - (other.v_ECI - self.v_ECI);
  Errors out{norm(r), norm(v), norm(to_vec3(e.r_self_ECI) - self.r_ECI), {}};
  const double x[6] = {r.x, r.y, r.z, v.x, v.y, v.z};
  for (int k = 0; k < 6; ++k) out.normalised[k] = x[k] / std::sqrt(e.covariance(6 + k, 6 + k));
  return out;
}

/// Satellites whose integer is held and is not the true one, up to what all have in common.
inline int wrong_integers(const NavigationScene& scene, const Epoch& e,
                          const fg::FormationFilter& filter) {
  int wrong = 0;
  std::optional<double> common;
  for (int prn = 1; prn <= 32; ++prn) {
    if (!filter.integers().holds(prn)) continue;
    double n[2] = {};
    bool seen = true;
    for (int k = 0; k < 2; ++k) {
      const fg::CarrierArcs& arcs = filter.arcs(k == 0 ? Who::kSelf : Who::kOther);
      const int channel = arcs.find(prn);
      seen = seen && channel >= 0 && arcs[channel].last_ns == e.t_ns;
      if (!seen) break;
      n[k] = -arcs[channel].base_cycles;
      for (const GnssChannel& c : scene.tracker(k).channels()) {
        if (c.prn == prn) n[k] += c.ambiguity_cycles;
      }
    }
    if (!seen) continue;
    const double offset = n[1] - n[0] - filter.integers().value(prn);
    if (!common) common = offset;
    wrong += offset != *common;
  }
  return wrong;
}

/// Positive definite as a factor says, symmetric by construction; the nominal state finite.
inline void expect_sound(const fg::FormationFilter& filter) {
  for (int j = 0; j < fg::kStates; ++j) {
    ASSERT_GT(filter.covariance().d(j), 0) << j;
    ASSERT_TRUE(std::isfinite(filter.covariance().d(j))) << j;
  }
  for (int k = 0; k < 2; ++k) ASSERT_TRUE(flight_support::is_finite(filter.orbits().r[k]));
}

struct FlightOptions {
  SceneOptions scene = {};
  fg::NavigationOptions navigation = {};
  bool losses = true;
  Duration duration = 45min;
  /// Called when the receivers have measured, before anybody is told.
  std::function<void(SimTime, NavigationScene&, Link&, Navigation&)> at_epoch = {};
};

/// A run of one spacecraft's navigation; every estimate is asked for 9 s after the epoch, just
/// before the next.
struct Flight {
  std::vector<Errors> errors;  // by epoch; before the start zeros
  std::vector<fg::FormationEstimate> estimates;
  int wrong = 0;
  std::unique_ptr<Navigation> navigation;
  double chi2 = 0;
  int innovations = 0, rejected = 0;
  int judged = 0, inside = 0;  // epochs whose chi-square was judged, and lay within 95 % bounds

  explicit Flight(const FlightOptions& o) : navigation(std::make_unique<Navigation>(o.navigation)) {
    NavigationScene scene(o.scene);
    Link link(o.scene.seed + 77, o.losses);
    for (SimTime t = scene.now(); t <= NavigationScene::start() + o.duration; t += o.scene.period) {
      const Epoch e = scene.next();
      if (o.at_epoch) o.at_epoch(t, scene, link, *navigation);
      link.deliver(e.t_ns, navigation.get());
      give_own(e, navigation.get());
      link.send(e);
      const SimTime asked = t + o.scene.period - 1s;
      link.deliver(to_ns(asked), navigation.get());
      expect_sound(navigation->filter());
      if (testing::Test::HasFatalFailure()) return;
      wrong += wrong_integers(scene, e, navigation->filter());
      note(scene, asked);
    }
  }

  /// Root mean square from an epoch on.
  double rms(double Errors::*what, int from) const {
    double sum = 0;
    for (std::size_t k = from; k < errors.size(); ++k) sum += errors[k].*what * (errors[k].*what);
    return std::sqrt(sum / static_cast<double>(errors.size() - from));
  }
  double worst(double Errors::*what, int from, int until) const {
    double worst = 0;
    for (int k = from; k < until; ++k) worst = std::max(worst, errors[k].*what);
    return worst;
  }

 private:
  void note(NavigationScene& scene, SimTime asked) {
    const fg::FormationEstimate e = navigation->at(to_ns(asked));
    estimates.push_back(e);
    errors.push_back(e.valid ? errors_of(e, scene.truth(0, asked), scene.truth(1, asked))
                             : Errors{});
    const fg::UpdateReport& sdcp = navigation->reports().sdcp;
    chi2 += sdcp.chi2;
    innovations += sdcp.used;
    rejected += sdcp.rejected;
    // Wilson & Hilferty (1931): the cube root of chi2 / n is normal.
    if (sdcp.used < 6) return;
    const double w = 2.0 / (9 * sdcp.used);
    ++judged;
    inside += std::abs(std::cbrt(sdcp.chi2 / sdcp.used) - (1 - w)) < 1.96 * std::sqrt(w);
  }
};

inline std::vector<Epoch> recorded(int epochs, std::uint64_t seed) {
  NavigationScene scene({.seed = seed});
  std::vector<Epoch> out;
  for (int k = 0; k < epochs; ++k) out.push_back(scene.next());
  return out;
}

}  // namespace orrery::navigation_flight
