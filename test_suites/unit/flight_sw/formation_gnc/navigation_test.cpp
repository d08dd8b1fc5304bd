// Navigation against the truth models: orbits under all forces of Table 1, receivers' bytes, 17 %
// of the companion's epochs lost. ORRERY_SEED
// chooses the first seed, ORRERY_RUNS how many the first test flies.
#include "formation_gnc/navigation/navigation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <numeric>

#include "navigation_scene.hpp"

namespace orrery {
namespace {

namespace fg = formation_gnc;
using fg::Navigation;
using fg::Who;
using Epoch = NavigationScene::Epoch;

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

std::uint64_t first_seed() {
  return number_from("ORRERY_SEED", 1);
}

Vec3 to_vec3(const flight_support::Vec3& v) {
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

void give_own(const Epoch& e, Navigation* navigation) {
  for (const auto& ephemeris : e.ephemerides[0]) navigation->ephemeris(ephemeris);
  if (e.measured[0]) navigation->own_epoch(*e.measured[0], e.q_BI[0]);
}

/// Everything that an estimate can be held against.
struct Errors {
  double r_m = 0, v_mps = 0, absolute_m = 0;  // 3D
  double normalised[6] = {};                  // of relative r and v, per axis
};

Errors errors_of(const fg::FormationEstimate& e, const OrbitState& self, const OrbitState& other) {
  const Vec3 r = to_vec3(e.r_relative_ECI) - (other.r_ECI - self.r_ECI);
  const Vec3 v = to_vec3(e.v_relative_ECI) - (other.v_ECI - self.v_ECI);
  Errors out{norm(r), norm(v), norm(to_vec3(e.r_self_ECI) - self.r_ECI), {}};
  const double x[6] = {r.x, r.y, r.z, v.x, v.y, v.z};
  for (int k = 0; k < 6; ++k) out.normalised[k] = x[k] / std::sqrt(e.covariance(6 + k, 6 + k));
  return out;
}

/// Satellites whose integer is held and is not the true one, up to what all have in common.
int wrong_integers(const NavigationScene& scene, const Epoch& e,
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
void expect_sound(const fg::FormationFilter& filter) {
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

class NavigationTest : public testing::Test {};

// Property (issue 8, figure 23): relative navigation is below 1 cm within 10 min of the start, and
// after 30 min at 5 mm and 0.04 mm/s (3D RMS); no wrong integer; normalised errors and innovations
// are honest. All noise, losses, and the slew with a crosslink blackout of 5 min. Seen over seeds 1
// to 20: first fix 140 to 200 s, 1.0 to 1.7 mm, 0.0015 to 0.0025 mm/s, worst 4.6 mm; normalised
// errors 0.7, innovations 0.97 to 1.01, absolute 0.9 to 2 m.
TEST_F(NavigationTest, IsAccurateAndHonest) {
  double squares[6] = {};
  int n = 0, beyond_four_sigma = 0;
  const std::uint64_t runs = number_from("ORRERY_RUNS", 3);
  for (std::uint64_t seed = first_seed(); seed < first_seed() + runs; ++seed) {
    FlightOptions o{.scene = {.seed = seed, .slew = true}, .duration = 60min};
    o.at_epoch = [](SimTime t, NavigationScene&, Link& link, Navigation&) {
      const Duration since = t - NavigationScene::start();
      link.dark = since >= 2296s && since < 2296s + 5min;
    };
    const Flight flight(o);
    EXPECT_EQ(flight.wrong, 0) << seed;
    EXPECT_TRUE(flight.estimates[60].fixed) << seed;
    EXPECT_LT(flight.worst(&Errors::r_m, 60, static_cast<int>(flight.errors.size())), 0.01) << seed;
    EXPECT_LT(flight.rms(&Errors::r_m, 180), 5e-3) << seed;
    EXPECT_LT(flight.rms(&Errors::v_mps, 180), 4e-5) << seed;
    EXPECT_LT(flight.rms(&Errors::absolute_m, 180), 4) << seed;
    EXPECT_NEAR(flight.chi2 / flight.innovations, 1, 0.1) << seed;
    EXPECT_GT(flight.inside, 0.92 * flight.judged) << seed;  // 95 %, 270 epochs: 2 sigmas below
    EXPECT_LT(flight.rejected, 5) << seed;
    for (std::size_t k = 60; k < flight.errors.size(); ++k) {
      for (int axis = 0; axis < 6; ++axis) {
        const double x = flight.errors[k].normalised[axis];
        squares[axis] += x * x;
        beyond_four_sigma += std::abs(x) > 4;
      }
      ++n;
    }
  }
  for (double sum : squares) {
    EXPECT_GT(std::sqrt(sum / n), runs < 20 ? 0.5 : 0.6);  // an hour of three seeds is few
    EXPECT_LT(std::sqrt(sum / n), 1.4);
  }
  EXPECT_LT(beyond_four_sigma, 0.01 * 6 * n);
}

// Property: a blackout of 5 min costs at most 5 cm and 1 cm is back within 2 min (issue 8). Seen: 3
// mm.
TEST_F(NavigationTest, CoastsThroughABlackout) {
  FlightOptions o{.scene = {.seed = first_seed()}};
  o.at_epoch = [](SimTime t, NavigationScene&, Link& link, Navigation&) {
    const Duration since = t - NavigationScene::start();
    link.dark = since >= 35min && since < 40min;
  };
  const Flight flight(o);
  EXPECT_EQ(flight.estimates[239].last_remote_ns < flight.estimates[239].t_ns - 290'000'000'000,
            true);
  EXPECT_LT(flight.worst(&Errors::r_m, 210, 240), 0.05);
  EXPECT_LT(flight.worst(&Errors::r_m, 252, 270), 0.01);
}

// Property: what a receiver does to phases and clocks is followed: slips in both receivers (3e-4
// 1/s per channel: 12 in the run), any integers, half cycles, clocks that run free and jump by 1
// ms, satellites lost below 27 dB-Hz. Same bounds as above. Seen 1.5 mm.
TEST_F(NavigationTest, FollowsSlipsHalfCyclesAndFreeClocks) {
  FlightOptions o{.scene = {.seed = first_seed() + 100}};
  o.scene.tracking.slips_per_s = 3e-4;
  o.scene.tracking.ambiguity_limit = 1'000'000'000;
  o.scene.tracking.report_unknown_parity = true;
  o.scene.tracking.lose_lock_below_dBHz = 27;
  o.scene.clock = {.steered = false, .initial_bias_s = 4.8e-4, .initial_drift_sps = 1e-7};
  const Flight flight(o);
  EXPECT_EQ(flight.wrong, 0);
  EXPECT_LT(flight.rms(&Errors::r_m, 180), 5e-3);
  EXPECT_LT(flight.rms(&Errors::v_mps, 180), 4e-5);
  EXPECT_EQ(flight.navigation->statistics().restarts, 1u);
}

// Property: a slip that the lock time hides (the receiver says nothing) is found by screening,
// costs that satellite's integer and nothing else.
TEST_F(NavigationTest, FindsASlipThatTheReceiverHides) {
  NavigationScene scene({.seed = first_seed()});
  Navigation navigation;
  int prn = 0;
  double shift_cycles = 0, worst_m = 0;
  for (int k = 0; k < 150; ++k) {
    Epoch e = scene.next();
    if (k == 120) {
      prn = e.measured[1]->observation[0].prn;
      ASSERT_TRUE(navigation.filter().integers().holds(prn));
      shift_cycles = 1;
    }
    for (int o = 0; o < e.measured[1]->count; ++o) {
      fg::Observation& observation = e.measured[1]->observation[o];
      if (observation.prn == prn) observation.phase_cycles += shift_cycles;
    }
    give_own(e, &navigation);
    navigation.remote_epoch(*e.measured[1], e.q_BI[1]);
    if (k == 122) {
      EXPECT_FALSE(navigation.filter().integers().holds(prn));
      EXPECT_GE(navigation.filter().integers().count(), 6);
    }
    const auto estimate = navigation.at(e.t_ns);
    if (k >= 120) worst_m = std::max(worst_m, errors_of(estimate, e.truth[0], e.truth[1]).r_m);
  }
  EXPECT_TRUE(navigation.filter().integers().holds(prn));  // with its new integer
  EXPECT_EQ(navigation.filter().openings(), 0u);
  EXPECT_LT(worst_m, 0.01);
}

// Property: a commanded burn of 3 mm/s with 2 % and half a degree of error costs no integer, and
// the velocity is back at 0.04 mm/s in 3 min. Seen 0.02. At least one message was late, so that
// replays went over the burn too.
TEST_F(NavigationTest, TakesBurnsIn) {
  const Vec3 dv{1e-3, -2e-3, 2e-3};
  FlightOptions o{.scene = {.seed = first_seed() + 4}, .losses = false, .duration = 40min};
  o.at_epoch = [&](SimTime t, NavigationScene& scene, Link&, Navigation& navigation) {
    if (t != NavigationScene::start() + 33min) return;
    scene.apply_impulse(0, t + 3s, 1.02 * dv);
    navigation.maneuver(Who::kSelf, to_ns(t + 3s), flight_support::vec3(dv.x, dv.y, dv.z), 6e-5);
  };
  const Flight flight(o);
  EXPECT_EQ(flight.wrong, 0);
  EXPECT_EQ(flight.navigation->filter().openings(), 0u);
  EXPECT_GE(flight.estimates[200].fixed_ambiguities, 6);
  EXPECT_LT(flight.worst(&Errors::r_m, 198, 240), 0.01);
  EXPECT_LT(flight.worst(&Errors::v_mps, 217, 240), 4e-5);
}

// Property: a burn that nobody told (a nozzle stuck open for 10 s: 22 mm/s) keeps all integers, and
// the estimate is back at 1 cm within 40 s. Its covariance says so all the time but for the epochs
// before it is seen.
TEST_F(NavigationTest, FindsABurnThatNobodyTold) {
  FlightOptions o{.scene = {.seed = first_seed() + 5}, .losses = false, .duration = 40min};
  o.at_epoch = [](SimTime t, NavigationScene& scene, Link&, Navigation&) {
    if (t == NavigationScene::start() + 33min)
      scene.apply_impulse(1, t + 3s, {0.015, 0.007, -0.015});
  };
  const Flight flight(o);
  EXPECT_EQ(flight.wrong, 0);
  EXPECT_GE(flight.navigation->filter().openings(), 1u);
  EXPECT_GE(flight.estimates[200].fixed_ambiguities, 6);
  EXPECT_GT(flight.errors[198].r_m, 0.05);
  EXPECT_LT(flight.worst(&Errors::r_m, 203, 240), 0.01);
  for (int k = 201; k < 240; ++k) {
    for (double x : flight.errors[k].normalised) EXPECT_LT(std::abs(x), 5) << k;
  }
}

// A burn of 0.3 mm/s passes the test of each epoch at first. Property: it is found all the same,
// before it has cost 3 cm. Seen 1.5 cm.
TEST_F(NavigationTest, FindsASmallBurnThatNobodyTold) {
  FlightOptions o{.scene = {.seed = first_seed() + 6}, .losses = false, .duration = 40min};
  o.at_epoch = [](SimTime t, NavigationScene& scene, Link&, Navigation&) {
    if (t == NavigationScene::start() + 33min) scene.apply_impulse(1, t + 3s, {2e-4, 1e-4, -2e-4});
  };
  const Flight flight(o);
  EXPECT_EQ(flight.wrong, 0);
  EXPECT_GE(flight.navigation->filter().openings(), 1u);
  EXPECT_LT(flight.worst(&Errors::r_m, 198, 240), 0.03);
  EXPECT_LT(flight.worst(&Errors::r_m, 220, 240), 0.01);
}

// ---- lateness, by bits

std::vector<Epoch> recorded(int epochs, std::uint64_t seed) {
  NavigationScene scene({.seed = seed});
  std::vector<Epoch> out;
  for (int k = 0; k < epochs; ++k) out.push_back(scene.next());
  return out;
}

const std::vector<Epoch>& recording() {
  static const std::vector<Epoch> epochs = recorded(60, 3);
  return epochs;
}

void give_remote(const Epoch& e, Navigation* navigation) {
  navigation->remote_epoch(*e.measured[1], e.q_BI[1]);
}

fg::Maneuver a_burn(int epoch) {
  fg::Maneuver m;
  m.who = Who::kSelf;
  m.t_ns = recording()[static_cast<std::size_t>(epoch)].t_ns + 4'000'000'000;
  m.duration_s = 1.3;
  m.dv_ECI = flight_support::vec3(1e-3, 0, -1e-3);
  m.sigma_mps = 5e-5;
  return m;
}

std::unique_ptr<Navigation> in_order(const fg::NavigationOptions& options = {}) {
  auto navigation = std::make_unique<Navigation>(options);
  navigation->maneuver(a_burn(30));
  for (const Epoch& e : recording()) {
    give_own(e, navigation.get());
    give_remote(e, navigation.get());
  }
  return navigation;
}

void expect_same_bits(const Navigation& a, const Navigation& b) {
  const fg::FormationFilter &x = a.filter(), &y = b.filter();
  EXPECT_EQ(x.t_ns(), y.t_ns());
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(std::memcmp(&x.orbits().r[k], &y.orbits().r[k], sizeof x.orbits().r[k]), 0);
    EXPECT_EQ(std::memcmp(&x.orbits().v[k], &y.orbits().v[k], sizeof x.orbits().v[k]), 0);
    EXPECT_EQ(x.clock_m(static_cast<Who>(k)), y.clock_m(static_cast<Who>(k)));
  }
  for (int j = 0; j < fg::kStates; ++j) {
    EXPECT_EQ(x.covariance().d(j), y.covariance().d(j));
    for (int i = 0; i < j; ++i) ASSERT_EQ(x.covariance().u(i, j), y.covariance().u(i, j));
  }
  for (int prn = 1; prn <= 32; ++prn) {
    ASSERT_EQ(x.integers().holds(prn), y.integers().holds(prn)) << prn;
    if (!x.integers().holds(prn)) continue;
    EXPECT_EQ(x.integers().value(prn), y.integers().value(prn));
  }
}

// Late by up to 15 epochs, each twice, in an order drawn anew each time; own epochs too.
TEST_F(NavigationTest, LateReorderedAndDoubleEpochsGiveTheBitsOfOrder) {
  const auto expected = in_order();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RandomStream random(seed);
    struct Event {
      double at;
      std::size_t epoch;
      bool own;
    };
    std::vector<Event> events;
    for (std::size_t k = 0; k < recording().size(); ++k) {
      const double at = static_cast<double>(k);
      events.push_back(
          {k < 3 ? at : at + random.uniform(0, 3), k, true});  // the start is the first's
      for (int copy = 0; copy < 2; ++copy) {
        events.push_back({at + random.uniform(0, 15), k, false});
      }
    }
    std::stable_sort(events.begin(), events.end(),
                     [](const Event& a, const Event& b) { return a.at < b.at; });
    Navigation navigation;
    bool told = false;
    for (const Event& event : events) {
      const Epoch& e = recording()[event.epoch];
      if (event.own) give_own(e, &navigation);
      if (!event.own) give_remote(e, &navigation);
      if (event.epoch >= 36 && !told) navigation.maneuver(a_burn(30));  // told a minute late
      told = told || event.epoch >= 36;
    }
    expect_same_bits(navigation, *expected);
    EXPECT_EQ(navigation.statistics().duplicates, recording().size());
    EXPECT_EQ(navigation.statistics().dropped, 0u);
    EXPECT_GT(navigation.statistics().replays, 10u);
  }
}

TEST_F(NavigationTest, AManeuverTakenBackLeavesNothing) {
  Navigation plain, taken_back;
  for (const Epoch& e : recording()) {
    for (Navigation* n : {&plain, &taken_back}) give_own(e, n), give_remote(e, n);
    if (&e == &recording()[40]) {
      fg::Maneuver m = a_burn(30);
      taken_back.maneuver(m);
      m.dv_ECI = {};
      m.sigma_mps = 0;
      taken_back.maneuver(m);
    }
  }
  // The step is still divided at the burn: rounding only.
  EXPECT_LT(
      norm(to_vec3(plain.filter().orbits().r[0]) - to_vec3(taken_back.filter().orbits().r[0])),
      1e-4);
}

TEST_F(NavigationTest, OlderThanTheRingIsDropped) {
  fg::NavigationOptions options;
  options.replay_depth = 5;
  Navigation navigation(options);
  for (int k = 0; k < 10; ++k) give_own(recording()[k], &navigation);
  give_remote(recording()[2], &navigation);
  EXPECT_EQ(navigation.statistics().dropped, 1u);
  EXPECT_FALSE(navigation.filter().other_started());
  // Between the two oldest of a full ring: that would push out the one to start from.
  Epoch between = recording()[5];
  between.measured[1]->t_ns += 5'000'000'000;
  give_remote(between, &navigation);
  EXPECT_EQ(navigation.statistics().dropped, 2u);
  give_remote(recording()[6], &navigation);
  EXPECT_EQ(navigation.statistics().dropped, 2u);
  EXPECT_TRUE(navigation.filter().other_started());
}

TEST_F(NavigationTest, PoliciesDropWhatComesLate) {
  fg::NavigationOptions discard, delay;
  discard.late = fg::LatePolicy::kDiscard;
  delay.late = fg::LatePolicy::kFusionDelay;
  delay.fusion_delay_s = 20;
  Navigation discarding(discard), delaying(delay);
  for (int k = 0; k < 30; ++k) {
    for (Navigation* n : {&discarding, &delaying}) give_own(recording()[k], n);
    // One epoch late: too late to discard none, early enough for a delay of two.
    if (k > 0)
      give_remote(recording()[k - 1], &discarding), give_remote(recording()[k - 1], &delaying);
  }
  EXPECT_EQ(discarding.statistics().dropped, 29u);
  EXPECT_FALSE(discarding.filter().other_started());
  EXPECT_EQ(delaying.statistics().dropped, 0u);
  EXPECT_EQ(delaying.filter().t_ns(), recording()[27].t_ns);
  EXPECT_TRUE(delaying.at(recording()[29].t_ns).valid);
}

// ---- what receivers do when they fail

// Ephemerides reach the receiver's port between the own epoch and the companion's: then differences
// exist of satellites that GRAPHIC has not seen. Property: they wait for an arc, and the start is
// as consistent as any. 12 epochs of some 10 degrees each: chi2 / n within 1 +- 4 sqrt(2 / 120) =
// 0.52, seen 0.9 to 1.1; 2 to 3 with an ambiguity that is none.
TEST_F(NavigationTest, EphemeridesMayComeBetweenTheTwoEpochs) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const std::vector<Epoch> epochs = recorded(14, seed);
    Navigation navigation;
    double chi2 = 0;
    int degrees = 0;
    for (std::size_t k = 0; k < epochs.size(); ++k) {
      const Epoch& e = epochs[k];
      navigation.own_epoch(*e.measured[0], e.q_BI[0]);
      chi2 += navigation.reports().graphic_self.chi2;
      degrees += navigation.reports().graphic_self.degrees;
      for (const auto& ephemeris : e.ephemerides[0]) navigation.ephemeris(ephemeris);
      give_remote(e, &navigation);
    }
    EXPECT_GT(degrees, 90);
    EXPECT_NEAR(chi2 / degrees, 1, 0.52) << seed;
  }
}

// Own outage of 90 s, with the companion's epochs coming: the estimate goes on.
TEST_F(NavigationTest, CoastsThroughAnOwnOutage) {
  Navigation navigation;
  for (int k = 0; k < 60; ++k) {
    const Epoch& e = recording()[k];
    if (k < 40 || k > 49) give_own(e, &navigation);
    give_remote(e, &navigation);
  }
  const Epoch& last = recording()[59];
  EXPECT_LT(errors_of(navigation.at(last.t_ns), last.truth[0], last.truth[1]).r_m, 0.01);
  EXPECT_EQ(navigation.statistics().restarts, 1u);
}

// A week added to the time of some epochs (a rollover) is dropped; a receiver that keeps to it is
// believed.
TEST_F(NavigationTest, TimesThatLeapAreDroppedUntilTheyStay) {
  constexpr std::int64_t kWeek_ns = 604'800'000'000'000;
  Navigation navigation;
  for (int k = 0; k < 30; ++k) {
    Epoch e = recording()[k];
    if (k == 20 || k == 21) e.measured[0]->t_ns += kWeek_ns;
    give_own(e, &navigation);
    give_remote(e, &navigation);
  }
  EXPECT_EQ(navigation.statistics().dropped, 2u);
  EXPECT_EQ(navigation.statistics().restarts, 1u);
  for (int k = 30; k < 40; ++k) {
    Epoch e = recording()[k];
    e.measured[0]->t_ns += kWeek_ns;
    give_own(e, &navigation);
  }
  EXPECT_EQ(navigation.statistics().restarts, 2u);
  EXPECT_EQ(navigation.filter().t_ns(), recording()[39].t_ns + kWeek_ns);
}

TEST_F(NavigationTest, RubbishIsSurvived) {
  RandomStream random(5);
  Navigation navigation;
  for (int k = 0; k < 60; ++k) {
    Epoch e = recording()[k];
    for (int craft = 0; craft < 2; ++craft) {
      fg::GnssEpoch& m = *e.measured[craft];
      for (int o = 0; o < m.count; ++o) {
        if (random.bernoulli(0.05)) m.observation[o].phase_cycles = NAN;
        if (random.bernoulli(0.05)) m.observation[o].code_m = random.uniform(-1e9, 1e9);
        if (random.bernoulli(0.05)) m.observation[o].cn0_dBHz = 1e30f;
        if (random.bernoulli(0.02)) m.observation[o].prn = 200;
        if (random.bernoulli(0.05)) m.observation[o].code_m += 1000;
      }
      if (random.bernoulli(0.05)) m.count = 1000;
      if (random.bernoulli(0.05)) e.q_BI[craft] = {0, 0, 0, 0};
      if (random.bernoulli(0.05)) e.q_BI[craft].y = NAN;
      if (random.bernoulli(0.05)) m.r_ECEF[1] = INFINITY;
      if (random.bernoulli(0.05)) m.t_ns = random.integer(-1'000'000, 2'000'000'000'000'000'000);
    }
    give_own(e, &navigation);
    give_remote(e, &navigation);
    expect_sound(navigation.filter());
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(navigation.statistics().dropped, 3u);
}

// Any order of calls, under any policy and depth: late by minutes, between the epochs, burns in the
// past. Run 60 times as long under address and undefined-behaviour sanitizers by hand: nothing
// found.
TEST_F(NavigationTest, AnyOrderOfCallsIsSurvived) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed);
    fg::NavigationOptions options;
    options.replay_depth = static_cast<int>(random.integer(2, 24));
    options.late = static_cast<fg::LatePolicy>(random.integer(0, 2));
    options.fusion_delay_s = random.uniform(0, 60);
    Navigation navigation(options);
    for (int call = 0; call < 200; ++call) {
      const std::int64_t newest = call / 4;
      Epoch e = recording()[static_cast<std::size_t>(random.integer(
          std::max<std::int64_t>(0, newest - 30), std::min<std::int64_t>(59, newest + 5)))];
      if (random.bernoulli(0.05)) e.measured[1]->t_ns += random.integer(0, 100'000'000'000);
      if (random.bernoulli(0.5)) give_own(e, &navigation);
      if (random.bernoulli(0.5)) give_remote(e, &navigation);
      fg::Maneuver m;
      m.who = static_cast<Who>(random.integer(0, 1));
      m.t_ns = e.t_ns + random.integer(-50'000'000'000, 50'000'000'000);
      m.duration_s = random.uniform(0, 20);
      m.dv_ECI[1] = random.uniform(-0.01, 0.01);
      m.sigma_mps = 1e-4;
      if (random.bernoulli(0.1)) navigation.maneuver(m);
      expect_sound(navigation.filter());
      const auto estimate = navigation.at(m.t_ns);
      for (int k = 0; k < 12 && estimate.valid; ++k) ASSERT_GT(estimate.covariance(k, k), 0) << k;
      if (HasFatalFailure()) return;
    }
  }
}

// ---- estimates

TEST_F(NavigationTest, EstimateSeenFromTheCompanionIsItsOwn) {
  const auto navigation = in_order();
  const std::int64_t t_ns = recording()[59].t_ns + 5'000'000'000;
  const fg::FormationEstimate e = navigation->at(t_ns), back = seen_from_other(seen_from_other(e));
  const fg::FormationEstimate other = seen_from_other(e);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(other.r_relative_ECI[k], -e.r_relative_ECI[k]);
    EXPECT_EQ(other.r_self_ECI[k], e.r_other_ECI[k]);
    // Frames of the two are 40 m of 6928 km apart.
    EXPECT_NEAR(other.r_relative_RTN[k], -e.r_relative_RTN[k], 40 * 40 / 6.9e6 * 2);
  }
  for (int i = 0; i < 12; ++i) {
    // P of self is 1 m^2; that of the difference 1e-6 is what remains of it.
    for (int j = 0; j < 12; ++j) EXPECT_NEAR(back.covariance(i, j), e.covariance(i, j), 1e-13);
  }
}

// The velocity in RTN is the derivative of the position in RTN: from estimates a second apart.
TEST_F(NavigationTest, VelocityInRtnIsTheDerivativeOfThePosition) {
  const auto navigation = in_order();
  const std::int64_t t_ns = recording()[59].t_ns + 5'000'000'000;
  const auto before = navigation->at(t_ns - 500'000'000),
             after = navigation->at(t_ns + 500'000'000);
  const auto now = navigation->at(t_ns);
  for (int k = 0; k < 3; ++k) {
    // The rate of RTN is that of the osculating orbit, as everywhere in the project: J2's pull
    // along the normal, up to 1e-2 m/s^2, also turns it about R, by 1.3e-6 rad/s. Seen: 1e-5.
    EXPECT_NEAR(now.v_relative_RTN[k], after.r_relative_RTN[k] - before.r_relative_RTN[k], 5e-5);
  }
}

TEST_F(NavigationTest, StateAloneIsTheSameState) {
  const auto navigation = in_order();
  for (std::int64_t after_s : {-95, 0, 7, 100}) {
    const std::int64_t t_ns = recording()[59].t_ns + after_s * 1'000'000'000;
    const auto all = navigation->at(t_ns), state = navigation->state_at(t_ns);
    ASSERT_TRUE(all.valid && state.valid);
    EXPECT_EQ(all.t_ns, state.t_ns);
    EXPECT_EQ(std::memcmp(&all.r_relative_RTN, &state.r_relative_RTN, sizeof all.r_relative_RTN),
              0);
    EXPECT_EQ(std::memcmp(&all.v_other_ECI, &state.v_other_ECI, sizeof all.v_other_ECI), 0);
  }
}

TEST_F(NavigationTest, ThereIsNoEstimateBeforeTheStartOrFarFromIt) {
  Navigation navigation;
  EXPECT_FALSE(navigation.at(recording()[0].t_ns).valid);
  give_own(recording()[0], &navigation);
  EXPECT_FALSE(navigation.at(recording()[0].t_ns).valid);  // the companion is unknown
  give_remote(recording()[0], &navigation);
  EXPECT_TRUE(navigation.at(recording()[0].t_ns).valid);
  EXPECT_FALSE(navigation.at(recording()[0].t_ns - 1).valid);
  EXPECT_TRUE(navigation.at(recording()[0].t_ns + 7'200'000'000'000).valid);
  EXPECT_FALSE(navigation.at(recording()[0].t_ns + 11'000'000'000'000).valid);
}

// ---- ManeuverList

TEST(ManeuverListTest, SharesOfAnIntervalAddUpToOne) {
  fg::ManeuverList list;
  fg::Maneuver m;
  m.t_ns = 100'000'000'000;
  m.duration_s = 3;
  ASSERT_TRUE(list.add(m));
  const std::int64_t edges[] = {0, 98'500'000'000, 99'000'000'000, 100'700'000'000,
                                200'000'000'000};
  double sum = 0;
  for (int k = 0; k < 4; ++k) sum += list.share(0, edges[k], edges[k + 1]);
  EXPECT_DOUBLE_EQ(sum, 1);
  EXPECT_DOUBLE_EQ(list.share(0, edges[1], edges[2]), 0.5 / 3);
  EXPECT_EQ(list.middle_of_share(0, edges[1], edges[2]), 98'750'000'000);
  EXPECT_EQ(list.share(0, edges[0], edges[1]), 0);
}

TEST(ManeuverListTest, KeepsTheLatestInOrderAndRefusesNonsense) {
  fg::ManeuverList list;
  RandomStream random(1);
  for (int k = 0; k < 100; ++k) {
    fg::Maneuver m;
    m.t_ns = 1 + (k * 37) % 100;
    EXPECT_EQ(list.add(m), list.count() < fg::ManeuverList::kCapacity || m.t_ns > list[0].t_ns ||
                               list[0].t_ns == m.t_ns);
    for (int j = 1; j < list.count(); ++j) EXPECT_LT(list[j - 1].t_ns, list[j].t_ns);
  }
  EXPECT_EQ(list.count(), fg::ManeuverList::kCapacity);
  EXPECT_EQ(list[list.count() - 1].t_ns, 100);
  fg::Maneuver bad;
  bad.t_ns = 500;
  bad.dv_ECI[1] = NAN;
  EXPECT_FALSE(list.add(bad));
  bad.dv_ECI = {};
  bad.sigma_mps = -1;
  EXPECT_FALSE(list.add(bad));
  bad.sigma_mps = 0;
  bad.duration_s = 1e9;
  EXPECT_FALSE(list.add(bad));
}

}  // namespace
}  // namespace orrery
