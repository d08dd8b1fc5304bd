// Three spacecraft: a target that says nothing, a chaser that does not burn, and a second observer
// that tells it over the crosslink where it sees the target, and from where. Two lines of sight
// that cross show the range at once.
#include <orrery/fixtures/missions/reference_mission.hpp>
#include <orrery/models/orbit/mean_elements.hpp>

#include <cstdio>

#include "rendezvous_world.hpp"

using namespace orrery;
using namespace orrery::rendezvous;

namespace {

/// What the observer says instead of what it saw, by the fault "wrong" of its radio. All but the
/// first have a CRC that is right.
enum Wrong { kNothing = 0, kNoise = 1, kSky = 2, kOtherTarget = 3, kOtherPlace = 4, kTomorrow = 5 };

/// Device "observation" at both ends of the link.
class ObservationRadio final : public Device {
 public:
  std::string_view name() const override { return "observation"; }
  void start(DeviceContext&) override {}
  void from_flight(DeviceContext& io, Bytes bytes) override {
    ++sent;
    io.transmit("chaser", said(io, bytes));
  }
  void from_air(DeviceContext& io, std::string_view, Bytes frame) override {
    ++received;
    io.to_flight(frame);
  }
  int sent = 0, received = 0;

 private:
  ByteBuffer said(DeviceContext& io, Bytes bytes) {
    ByteBuffer message(bytes.begin(), bytes.end());
    const int wrong = static_cast<int>(io.fault("wrong", kNothing));
    if (wrong == kNothing) return message;
    RandomStream& random = io.random("wrong");
    if (wrong == kNoise) {
      for (std::byte& b : message) b = static_cast<std::byte>(random.integer(0, 255));
      return message;
    }
    rpo_kit_observation o;
    EXPECT_EQ(
        rpo_kit_get_observation(data_of(message), static_cast<std::uint32_t>(message.size()), &o),
        1);
    Vec3 d{o.direction_ECI[0], o.direction_ECI[1], o.direction_ECI[2]};
    if (wrong == kSky) d = unit(normal3(random, 1));
    // 5 mrad off: 150 m beside the target.
    if (wrong == kOtherTarget) d = unit(d + across({0.003, 0.003, 0.003}, d));
    if (wrong == kOtherPlace) o.r_ECI[random.integer(0, 2)] += 20e3;
    if (wrong == kTomorrow) o.exposure_ns += 86'400'000'000'000;
    o.direction_ECI[0] = d.x, o.direction_ECI[1] = d.y, o.direction_ECI[2] = d.z;
    rpo_kit_put_observation(reinterpret_cast<unsigned char*>(message.data()), &o);
    return message;
  }
};

RendezvousOptions coasting(RunId run, bool second) {
  RendezvousOptions options;
  options.roe_m = {.da = 0, .dl = -30e3, .dex = 80, .dey = 290, .dix = 80, .diy = 290};
  options.config = second ? "second_observer = 1\n" : "";
  options.cooperative = options.keypoints = false;
  options.run = run;
  return options;
}

struct ThreeSpacecraft : RendezvousWorld {
  explicit ThreeSpacecraft(RunId run, bool second = true) : RendezvousWorld(coasting(run, second)) {
    // 4 km before the chaser, on a spiral of 3 km: the base line is that and more, across.
    const RelativeElements roe_m = {
        .da = 0, .dl = -26e3, .dex = 800, .dey = 2900, .dix = 800, .diy = 2900};
    const QuasiNonsingularElements chief =
        to_quasi_nonsingular(missions::reference_chief_orbit(now()));
    const InertialState state =
        to_inertial(mean_to_osculating(deputy_elements(chief, 1 / chief.a_m * roe_m)));
    SpacecraftOptions observer;
    observer.name = "observer";
    observer.initial.r_ECI = state.r_ECI, observer.initial.v_ECI = state.v_ECI;
    observer.initial.mass_kg = 11;
    observer.flight.library = "rpo_kit";
    observer.flight.config = "role = observer\n";
    add_spacecraft(observer);
    set_crosslink("observer", "chaser", FormationOptions{}.crosslink);
    spacecraft("observer")
        .add<DirectionSensor>([this] { return spacecraft("target").truth(); }, DirectionOptions{});
    from = &spacecraft("observer").add<ObservationRadio>();
    to = &spacecraft("chaser").add<ObservationRadio>();
  }
  /// Of the estimate that is the last one by then, in percent of the range.
  const Belief& believed() const { return beliefs.back(); }
  double error_percent() const { return 100 * believed().range_error_m() / norm(believed().r_m); }
  double sigma_percent() const { return 100 * believed().range_sigma_m() / norm(believed().r_m); }
  ObservationRadio* from = nullptr;
  ObservationRadio* to = nullptr;
};

constexpr std::array<int, 4> kJudged_h = {2, 4, 6, 8};

std::string at_hour(const char* what, int hour) {
  return what + std::string("_at_") + std::to_string(hour) + "h";
}

void coast(RunId run, bool second) {
  ThreeSpacecraft world(run, second);
  const auto known = [&] { return !world.beliefs.empty(); };
  ASSERT_TRUE(world.run_until(known, 8h));
  world.record_metric("first_h", world.hours());
  world.record_metric("first_error_percent", world.error_percent());
  double chi2 = 0;
  for (const int hour : kJudged_h) {
    if (at(std::chrono::hours(hour)).instant() < world.elapsed()) continue;
    world.run_for(std::chrono::hours(hour) - world.elapsed());
    const double error = world.error_percent(), sigma = world.sigma_percent();
    world.record_metric(at_hour("error_percent", hour), error);
    world.record_metric(at_hour("sigma_percent", hour), sigma);
    chi2 += error * error / (sigma * sigma) / kJudged_h.size();
  }
  world.record_metric("normalised_rms", std::sqrt(chi2));
  world.record_metric("used_second", world.telemetry.used_second);
  EXPECT_EQ(world.delta_v_mps("chaser"), 0);
  EXPECT_EQ(world.telemetry.restarts, 0u);
  EXPECT_EQ(world.flight("observer").rejected(), 0u);
  EXPECT_EQ(world.flight("observer").crashes(), 0u);
  EXPECT_EQ(world.flight("chaser").crashes(), 0u);
  if (!second) return;
  world.expect_sound();
  EXPECT_GT(world.crosslink("observer", "chaser").lost(), 5u);
  EXPECT_GT(world.telemetry.used_second, 80u);
}

double rms_of(const CampaignMetric& metric) {
  double sum = 0;
  for (const CampaignMetric::Value& v : metric.values()) sum += v.value * v.value;
  return std::sqrt(sum / static_cast<double>(metric.values().size()));
}

void endure(RunId run) {
  ThreeSpacecraft world(run);
  const LinkHandle link = world.crosslink("observer", "chaser").from("observer");
  link.duplicate(with_probability(0.3), 2s);
  link.duplicate(with_probability(0.1), 200s);
  link.corrupt(with_probability(0.1), 3);
  link.delay(with_probability(0.2), 15s);
  link.delay(with_probability(0.1), 90s);
  const SpacecraftHandle observer = world.spacecraft("observer");
  // 10 min of each, right ones between; the first 40 before there is an estimate.
  const std::array<Wrong, 5> wrongs = {kSky, kOtherTarget, kOtherPlace, kTomorrow, kNoise};
  for (int k = 0; k < 30; ++k) {
    const Duration begin = k * 15min + 1min;
    observer.fault("observation", "wrong", between(begin, begin + 10min), wrongs[k % 5]);
  }
  world.run_for(8h);
  ASSERT_GT(world.beliefs.size(), 500u);
  double worst_percent = 0, worst_sigma = 0;
  for (const RendezvousWorld::Belief& b : world.beliefs) {
    worst_percent = std::max(worst_percent, 100 * std::abs(b.range_error_m()) / norm(b.r_m));
    worst_sigma = std::max(worst_sigma, std::abs(b.range_error_m()) / b.range_sigma_m());
  }
  std::printf(
      "first at %.2f h; worst %.2f %%, %.1f sigma; at the end %.3f %%, sigma %.3f %%; %d sent, %d "
      "arrived, %u rejected, %u outliers, %u used\n",
      std::chrono::duration<double>(world.beliefs.front().t).count() / 3600, worst_percent,
      worst_sigma, world.error_percent(), world.sigma_percent(), world.from->sent,
      world.to->received, static_cast<unsigned>(world.flight("chaser").rejected()),
      world.telemetry.outliers, world.telemetry.used_second);
  world.record_metric("worst_percent", worst_percent);
  world.record_metric("worst_sigma", worst_sigma);
  EXPECT_LT(worst_percent, 3.0);
  EXPECT_LT(worst_sigma, 4.5);
  EXPECT_LT(std::abs(world.error_percent()), 0.5);
  // Noise, tomorrow's, and damaged ones are rejected at once, wrong ones at the gate. Of 54 right
  // ones a sixth is lost, a tenth damaged, a tenth too late: 36 +- 3.4, four sigma below that.
  EXPECT_GT(world.flight("chaser").rejected(), 30u);
  EXPECT_GT(world.telemetry.outliers, 20u);
  EXPECT_GT(world.telemetry.used_second, 22u);
  EXPECT_EQ(world.telemetry.restarts, 0u);
  EXPECT_EQ(world.flight("chaser").crashes(), 0u);
  EXPECT_EQ(world.delta_v_mps("chaser"), 0);
}

}  // namespace

// Required: without any burn 3 % of the range within two hours, and a covariance that says so. Four
// numbers a seed that repeat each other in part: over 20 seeds 1 +- 0.15 at most.
TEST(RendezvousSecondObserverCampaign, TwoLinesOfSightShowTheRangeWithoutABurn) {
  const int runs = flags().runs.value_or(2);
  const Campaign campaign = fly_campaign(Runs{runs}, [](RunId run) { coast(run, true); });
  EXPECT_EQ(campaign.passed().passed, campaign.passed().runs);
  std::printf("first estimate at %.2f h, error %.2f %%\n", campaign.metric("first_h").mean(),
              rms_of(campaign.metric("first_error_percent")));
  EXPECT_LT(campaign.metric("first_h").mean(), 1.0);
  for (const int hour : kJudged_h) {
    const double error = rms_of(campaign.metric(at_hour("error_percent", hour)));
    std::printf("%d h: range error %.3f %%, sigma %.3f %%\n", hour, error,
                campaign.metric(at_hour("sigma_percent", hour)).mean());
    EXPECT_LT(error, 3.0) << hour;
  }
  const double normalised = rms_of(campaign.metric("normalised_rms"));
  std::printf("normalised range error %.2f; %.0f of the second observer used\n", normalised,
              campaign.metric("used_second").mean());
  EXPECT_LT(normalised, runs > 4 ? 1.4 : 3.0);
  EXPECT_GT(normalised, runs > 4 ? 0.6 : 0.0);
}

// A link that doubles, damages, delays and reorders beside its losses, and an observer that in turn
// says noise, other directions, another target, another place and tomorrow's time, from before
// there is an estimate: none of it is believed, and what is right among it still shows the range.
TEST(RendezvousSecondObserverDamageCampaign, WhatIsWrongDamagedLateOrDoubledDoesNoHarm) {
  const Campaign campaign = fly_campaign(Runs{flags().runs.value_or(1)}, endure);
  EXPECT_EQ(campaign.passed().passed, campaign.passed().runs);
}
