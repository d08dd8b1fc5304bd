#include "rpo_kit/far_range/relative_orbit_filter.hpp"

#include <gtest/gtest.h>

#include "../flight_test_support.hpp"
#include "rpo_kit/far_range/initial_orbit.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;
using flight_test::roe;

constexpr double kBearing_rad = 20.0 / 3600.0 * kPi / 180.0;  // 20 arcsec per axis
constexpr double kBurnFraction = 0.01, kBurnDirection_rad = 0.0087;
constexpr double kRevolution_s = 5740.0;
constexpr double kCadence_s = 180.0;

// A burn of the observer, revolutions after the start.
struct PlannedBurn {
  double rev;
  Vec3 dv_RTN;
};

// Two orbits of an oblate Earth, numerically, and what the observer knows of them.
class FarRangeScene {
 public:
  FarRangeScene(const RelativeElements& a_roe, std::uint64_t seed, double drag_mps2 = 0.0)
      : noise_(seed), drag_mps2_(drag_mps2) {
    const OrbitElements observer = flight_test::reference_chief();
    observer_ = flight_test::state_of_mean(observer);
    target_ = flight_test::state_of_mean(apply_relative_elements(observer, a_roe));
  }

  void run_to(double t_s) {
    observer_ = flight_test::propagate_oblate(observer_, t_s - t_s_);
    target_ = flight_test::propagate_oblate(target_, t_s - t_s_);
    const Vec3 along = (1.0 / norm(target_.v_ECI)) * target_.v_ECI;
    target_.v_ECI = target_.v_ECI - drag_mps2_ * (t_s - t_s_) * along;
    t_s_ = t_s;
  }
  std::int64_t now_ns() const { return kEpoch_ns + nanoseconds(t_s_); }
  double t_s() const { return t_s_; }

  // The observer's own orbit out of a GNSS filter: 1.5 m and 3 mm/s per axis.
  Observer observer() {
    StateEci known = observer_;
    known.r_ECI = known.r_ECI + noise_.normal3(1.5);
    known.v_ECI = known.v_ECI + noise_.normal3(0.003);
    return observer_from_state(now_ns(), known);
  }
  Bearing bearing() {
    const Vec3 d = target_.r_ECI - observer_.r_ECI;
    const Vec3 seen = (1.0 / norm(d)) * d + noise_.normal3(kBearing_rad);
    return {now_ns(), (1.0 / norm(seen)) * seen, kBearing_rad};
  }
  // Executed with 1 % and 0.5 deg of error, told as commanded.
  ObserverBurn burn(const Vec3& dv_RTN) {
    const double size = 1.0 + kBurnFraction * noise_.normal();
    const Vec3 aside = noise_.normal3(kBurnDirection_rad * norm(dv_RTN));
    const Vec3 along = (1.0 / norm(dv_RTN)) * dv_RTN;
    const Vec3 executed = size * dv_RTN + aside - dot(aside, along) * along;
    observer_.v_ECI = observer_.v_ECI + transpose(eci_to_rtn(observer_)) * executed;
    return {now_ns(), dv_RTN, burn_covariance(dv_RTN, kBurnFraction, kBurnDirection_rad)};
  }
  // The sunlit part of the orbit, in which the target shines.
  bool visible() const { return std::fmod(t_s_, kRevolution_s) < 0.62 * kRevolution_s; }

  double range_m() const { return norm(target_.r_ECI - observer_.r_ECI); }
  RelativeElements a_roe() const {
    return relative_elements(flight_test::mean_of_state(observer_),
                             flight_test::mean_of_state(target_));
  }

 private:
  Noise noise_;
  double drag_mps2_;
  StateEci observer_, target_;
  double t_s_ = 0.0;
};

struct Checkpoint {
  double rev, range_m, range_error, range_sigma, nees;  // errors as parts of the range
};

double estimated_range_m(const RelativeOrbitFilter& filter) {
  const OrbitElements& mean = filter.observer().mean;
  return norm(target_position_ECI(mean, position_ECI(mean), filter.a_roe()));
}

Checkpoint check(const FarRangeScene& scene, const RelativeOrbitFilter& filter) {
  Checkpoint at;
  at.rev = scene.t_s() / kRevolution_s;
  at.range_m = scene.range_m();
  at.range_error = estimated_range_m(filter) / at.range_m - 1.0;
  // Along the line of sight, which is nearly the direction of dl: the range's own gradient.
  RelativeElements gradient;
  const OrbitElements& mean = filter.observer().mean;
  for (int k = 0; k < 6; ++k) {
    RelativeElements moved = filter.a_roe();
    moved[k] += 1.0;
    gradient[k] =
        norm(target_position_ECI(mean, position_ECI(mean), moved)) - estimated_range_m(filter);
  }
  at.range_sigma = std::sqrt(dot(gradient, filter.covariance() * gradient)) / at.range_m;
  at.nees = squared_mahalanobis(filter.covariance(), filter.a_roe() - scene.a_roe());
  return at;
}

// Bearings of the first revolutions for the batch, then the filter; checkpoints once a revolution.
std::vector<Checkpoint> fly(const RelativeElements& start, const std::vector<PlannedBurn>& burns,
                            double batch_rev, double end_rev, std::uint64_t seed,
                            double drag_mps2) {
  FarRangeScene scene(start, seed, drag_mps2);
  std::vector<BatchMeasurement> batch;
  std::vector<ObserverBurn> batch_burns;
  RelativeOrbitFilter filter;
  std::vector<Checkpoint> checkpoints;
  std::size_t next = 0;
  for (double t = kCadence_s; t <= end_rev * kRevolution_s; t += kCadence_s) {
    while (next < burns.size() && burns[next].rev * kRevolution_s < t) {
      scene.run_to(burns[next].rev * kRevolution_s);
      const Observer before = scene.observer();
      const ObserverBurn burn = scene.burn(burns[next].dv_RTN);
      filter.started() ? filter.burn(before, burn) : batch_burns.push_back(burn);
      ++next;
    }
    scene.run_to(t);
    if (scene.visible()) {
      const Observer observer = scene.observer();
      const Bearing bearing = scene.bearing();
      if (filter.started()) {
        EXPECT_TRUE(filter.update(bearing, observer) || filter.outliers() < 5);
      } else {
        batch.push_back({bearing, observer});
      }
    }
    if (!filter.started() && t > batch_rev * kRevolution_s) {
      InitialOrbit initial;
      const bool solved =
          solve_initial_orbit(batch.data(), static_cast<int>(batch.size()), batch_burns.data(),
                              static_cast<int>(batch_burns.size()), BatchOptions(), &initial);
      EXPECT_TRUE(solved) << seed;
      EXPECT_NEAR(initial.residual, 1.0, 0.35) << seed;
      filter.start(batch.back().observer, initial.a_roe, initial.covariance);
      filter.predict(scene.observer());
    }
    const double rev = t / kRevolution_s;
    if (filter.started() && std::floor(rev) > std::floor((t - kCadence_s) / kRevolution_s)) {
      checkpoints.push_back(check(scene, filter));
    }
  }
  EXPECT_TRUE(filter.healthy());
  return checkpoints;
}

// From 30 km to 2 km: spirals of shrinking a*de and a*di, drifting by a*da, with a small burn each
// time the drift is to change. [m/s]
const std::vector<PlannedBurn> kApproach = {
    {1.0, vec3(0.0, -0.06, 0.03)}, {1.5, vec3(0.0, -0.06, -0.03)}, {4.0, vec3(0.02, 0.03, 0.05)},
    {4.5, vec3(0.0, -0.04, 0.0)},  {7.0, vec3(0.0, 0.03, -0.04)},  {9.5, vec3(-0.02, 0.01, 0.0)},
    {12.0, vec3(0.0, 0.02, 0.02)}, {14.5, vec3(0.0, 0.03, 0.0)}};
const RelativeElements kStart = roe(10, 30000, 100, 500, 0, 400);

struct Statistics {
  double error_rms = 0.0, sigma_mean = 0.0, normalised_rms = 0.0, nees = 0.0, range_m = 0.0;
};

// Per checkpoint, over the seeds.
std::vector<Statistics> over_seeds(int seeds, const RelativeElements& start,
                                   const std::vector<PlannedBurn>& burns, double end_rev,
                                   double drag_mps2 = 0.0) {
  std::vector<Statistics> all;
  for (int seed = 1; seed <= seeds; ++seed) {
    const std::vector<Checkpoint> run =
        fly(start, burns, 2.5, end_rev, static_cast<std::uint64_t>(seed), drag_mps2);
    all.resize(run.size());
    for (std::size_t k = 0; k < run.size(); ++k) {
      const double normalised = run[k].range_error / run[k].range_sigma;
      all[k].error_rms += run[k].range_error * run[k].range_error / seeds;
      all[k].normalised_rms += normalised * normalised / seeds;
      all[k].sigma_mean += run[k].range_sigma / seeds;
      all[k].nees += run[k].nees / seeds;
      all[k].range_m += run[k].range_m / seeds;
    }
  }
  for (Statistics& s : all) {
    s.error_rms = std::sqrt(s.error_rms);
    s.normalised_rms = std::sqrt(s.normalised_rms);
  }
  return all;
}

void report(const char* what, const Statistics& s) {
  testing::Test::RecordProperty(
      what, std::to_string(s.range_m) + " m: error " + std::to_string(100 * s.error_rms) +
                " %, sigma " + std::to_string(100 * s.sigma_mean) + " %, normalised " +
                std::to_string(s.normalised_rms) + ", NEES " + std::to_string(s.nees));
}

// Required: 3 % (1 sigma) over 20 seeds all the way. Consistency: the squared normalised error of
// six elements is 6 on average; over 20 seeds 1 sigma of that is 0.77, and its mean over the 15
// checkpoints, which repeat each other in part, is between 0.2 and 0.77: limits at 6 +- 2.
TEST(FarRangeTest, RangeFromDirectionsAndBurnsBelowThreePercentAndConsistent) {
  const std::vector<Statistics> all = over_seeds(20, kStart, kApproach, 18.0);
  ASSERT_GE(all.size(), 15u);
  double nees = 0.0, normalised = 0.0, worst = 0.0;
  for (const Statistics& s : all) {
    worst = std::max(worst, s.error_rms);
    nees += s.nees / static_cast<double>(all.size());
    normalised += s.normalised_rms / static_cast<double>(all.size());
    EXPECT_LT(s.nees, 6.0 + 4 * 0.77) << s.range_m;
    EXPECT_GT(s.nees, 6.0 - 4 * 0.77) << s.range_m;
  }
  EXPECT_LT(worst, 0.03);
  EXPECT_NEAR(nees, 6.0, 2.0);
  // Root mean square of 20 normal numbers: 1 +- 0.16.
  EXPECT_NEAR(normalised, 1.0, 0.4);
  EXPECT_NEAR(all.back().range_m, 2000.0, 600.0);
  report("first", all.front());
  report("last", all.back());
  RecordProperty("nees", std::to_string(nees));
  RecordProperty("worst_percent", std::to_string(100 * worst));
}

// The same without burns: the range is what it takes from the curvature of the orbit alone.
TEST(FarRangeTest, BurnsImproveTheRange) {
  const std::vector<PlannedBurn> none;
  const std::vector<Statistics> coasting = over_seeds(5, kStart, none, 6.0);
  const std::vector<Statistics> burning = over_seeds(5, kStart, kApproach, 6.0);
  EXPECT_GT(coasting.back().sigma_mean, 1.5 * burning.back().sigma_mean);
  EXPECT_GT(coasting.back().error_rms, burning.back().error_rms);
  // And what it does not know it says: 5 numbers, 1 +- 0.32; 3 sigma.
  EXPECT_LT(coasting.back().normalised_rms, 2.0);
  report("coasting", coasting.back());
  report("burning", burning.back());
}

// 1e-7 m/s^2 of differential drag that the filter does not model, some 20 times that of two like
// spacecraft at 550 km: the noise along the track grows to cover it.
TEST(FarRangeTest, NoiseAdaptsToDragThatIsNotModelled) {
  const std::vector<Statistics> all = over_seeds(6, kStart, kApproach, 10.0, 1e-7);
  for (const Statistics& s : all) EXPECT_LT(s.error_rms, 0.03) << s.range_m;
  // 6 seeds, 1 sigma 1.4 of 6; a bias is no white noise, so twice that many sigma.
  EXPECT_LT(all.back().nees, 18.0);
  report("drag", all.back());
}

TEST(RelativeOrbitFilterTest, FarOffDirectionIsAnOutlierAndChangesNothing) {
  FarRangeScene scene(kStart, 3);
  RelativeOrbitFilter filter;
  EXPECT_FALSE(filter.update(scene.bearing(), scene.observer()));  // not started
  Matrix6 P = 100.0 * identity<6>();
  P(kDl, kDl) = 1e6;
  filter.start(scene.observer(), kStart, P);
  scene.run_to(60.0);
  Bearing wrong = scene.bearing();
  wrong.direction_ECI = -1.0 * wrong.direction_ECI;
  EXPECT_FALSE(filter.update(wrong, scene.observer()));
  EXPECT_EQ(filter.outliers(), 1);
  const RelativeElements before = filter.a_roe();
  EXPECT_TRUE(filter.update(scene.bearing(), scene.observer()));
  EXPECT_GT(norm(filter.a_roe() - before), 0.0);
  // An older one is refused.
  const Bearing late = scene.bearing();
  scene.run_to(120.0);
  EXPECT_TRUE(filter.update(scene.bearing(), scene.observer()));
  const Observer past{late.t_ns, filter.observer().mean};
  EXPECT_FALSE(filter.update(late, past));
}

TEST(RelativeOrbitFilterTest, CovarianceThatIsNoneIsNoticed) {
  FarRangeScene scene(kStart, 3);
  RelativeOrbitFilter filter;
  Matrix6 P = identity<6>();
  P(0, 1) = P(1, 0) = 2.0;
  filter.start(scene.observer(), kStart, P);
  scene.run_to(60.0);
  EXPECT_FALSE(filter.update(scene.bearing(), scene.observer()));
  EXPECT_FALSE(filter.healthy());
}

TEST(InitialOrbitTest, TooLittleIsRefused) {
  FarRangeScene scene(kStart, 3);
  std::vector<BatchMeasurement> batch;
  InitialOrbit initial;
  for (int k = 0; k < 5; ++k) batch.push_back({scene.bearing(), scene.observer()});
  EXPECT_FALSE(solve_initial_orbit(batch.data(), 5, nullptr, 0, BatchOptions(), &initial));
  batch.push_back({scene.bearing(), scene.observer()});
  EXPECT_FALSE(
      solve_initial_orbit(batch.data(), 6, nullptr, kMostBatchBurns + 1, BatchOptions(), &initial));
}

}  // namespace
}  // namespace rpo_kit
