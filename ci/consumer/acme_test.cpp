// Flies acme's own beacon, with a sensor and a force of acme's own.
#include <orrery/orrery.hpp>

#include <cmath>
#include <span>
#include <string_view>

// Not Orrery's headers of these names, which are below <orrery/>.
#include "harness/kernel/time.hpp"
#include "models/orbit/gravity.hpp"

using namespace orrery;

static_assert(acme::kOwnTimeHeader && acme::kOwnGravityHeader);

namespace {

/// Distance from the Earth's centre with white noise, once a second.
class Altimeter final : public Device {
 public:
  static constexpr double kSigma_m = 2;

  std::string_view name() const override { return "altimeter"; }
  void start(DeviceContext& io) override {
    io.every(1s, [&io] {
      const double noise_m = io.random("noise").normal(0, kSigma_m);
      const double r_m = norm(io.truth().r_ECI) + noise_m;
      io.record("r_m", r_m);
      io.to_flight(std::as_bytes(std::span(&r_m, 1)));
    });
  }
};

/// A constant push along ECI x.
class Outgassing final : public ForceModel {
 public:
  explicit Outgassing(double force_N) : force_N_(force_N) {}
  std::string_view name() const override { return "outgassing"; }
  Vec3 acceleration_ECI(const OrbitState& s, const Surroundings&) const override {
    return {force_N_ / s.mass_kg, 0, 0};
  }

 private:
  double force_N_;
};

std::uint32_t u32_at(Bytes message, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i)
    value |= std::to_integer<std::uint32_t>(message[offset + i]) << (8 * i);
  return value;
}

struct AcmeBeaconTest : FormationTest {
  AcmeBeaconTest() : FormationTest({.flight = {.library = "acme_beacon"}}) {}
};

TEST_F(AcmeBeaconTest, SendsEveryTenSeconds) {
  run_for(10min);
  EXPECT_EQ(crosslink("chief", "deputy").from("chief").sent(), 61);  // both ends included
  EXPECT_EQ(flight("chief").crashes(), 0);
  EXPECT_EQ(flight("chief").rejected(), 0);
}

// With -fvisibility=hidden the allocator's hooks are lost unless they are exported on purpose.
TEST_F(AcmeBeaconTest, AllocatesFromItsOwnSimulatedHeap) {
  run_for(1min);
  for (const char* name : {"chief", "deputy"}) {
    EXPECT_GE(heap(name).resting_bytes(), 1000) << name;  // SCRATCH_BYTES
    EXPECT_LT(heap(name).resting_bytes(), 2000) << name;
  }
}

struct AltimeterTest : FormationTest {
  AltimeterTest() : FormationTest({.flight = {.library = "vendor::beacon"}}) {
    spacecraft("chief").add<Altimeter>();
    spacecraft("chief").connect("altimeter", "altitude");
  }
};

TEST_F(AltimeterTest, FlightSoftwareGetsEachSample) {
  std::uint32_t altitudes = 0;
  flight("chief").on_output("crosslink",
                            [&](SimTime, Bytes message) { altitudes = u32_at(message, 4); });
  run_for(1min);
  EXPECT_EQ(altitudes, 61);  // at 0 s, 1 s ... 60 s, each before the tick of its instant
}

TEST_F(AltimeterTest, MeasuresTheTruth) {
  run_for(1min);
  const double error_m =
      channel("chief/altimeter/r_m").last().value - norm(spacecraft("chief").truth().r_ECI);
  EXPECT_LT(std::abs(error_m), 6 * Altimeter::kSigma_m);  // missed once in 5e8 seeds
  EXPECT_NE(error_m, 0);
}

// Bound: a t^2 / 2 = 0.18 m; the tide of the gravity gradient changes it by (n t)^2 / 6 = 7e-4 of
// that at most (n = 1.1e-3 rad/s, t = 60 s).
TEST(OutgassingTest, MovesTheSpacecraftByHalfATSquared) {
  const FormationOptions options{.mass_kg = 10};
  FormationWorld quiet(options), pushed(options);
  pushed.spacecraft("deputy").add_force<Outgassing>(1e-3);
  quiet.run_for(60s);
  pushed.run_for(60s);
  const Vec3 moved =
      pushed.spacecraft("deputy").truth().r_ECI - quiet.spacecraft("deputy").truth().r_ECI;
  EXPECT_NEAR(moved.x, 0.5 * 1e-4 * 60 * 60, 2e-4);
  EXPECT_NEAR(moved.y, 0, 2e-4);
  EXPECT_NEAR(moved.z, 0, 2e-4);
}

TEST(AcmeCampaign, AHeavierDeputyIsHeardAsWell) {
  const Campaign campaign = fly_campaign(Runs{4}, [](RunId run) {
    FormationWorld world({.flight = {.library = "acme_beacon"}, .run = run});
    world.spacecraft("deputy").disperse("mass_kg", Uniform{11, 12});
    world.run_for(1min);
    world.record_metric("mass_kg", world.spacecraft("deputy").truth().mass_kg);
    EXPECT_GT(world.crosslink("chief", "deputy").from("deputy").sent(), 0);
  });
  EXPECT_EQ(campaign.passed().passed, campaign.passed().runs);
  EXPECT_THAT(campaign.metric("mass_kg"), PercentileBelow(100, 12.001));
  EXPECT_GE(campaign.metric("mass_kg").percentile(1), 11);
}

}  // namespace
