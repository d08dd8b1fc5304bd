// Property: a transfer of 20 h with a candidate impulse every 120 s fits into a flight computer's
// heap because the cone program is sparse; the same program with a full matrix of inequalities does
// not (figures 28 to 30 of the paper).
#include <orrery/harness/heap/interposition.hpp>
#include <orrery/orrery.hpp>

#include <cmath>
#include <map>

#include "formation_gnc/control/reconfiguration_planner.hpp"
#include "formation_gnc/control/science_orbit.hpp"
#include "formation_gnc/control/socp_solver.hpp"
#include "formation_gnc/control/sun_direction.hpp"
#include "support/orbit/constants.hpp"

using namespace orrery;
namespace gnc = formation_gnc;
namespace fs = flight_support;

namespace {

constexpr int kCandidates = 600;

// Code of formation_gnc runs as flight code of the chief's process: in its heap.
struct ConeProgramMemoryTest : FormationTest {
  ConeProgramMemoryTest()
      : FormationTest({.flight = {.library = "formation_keeping", .heap_bytes = 50_MB}}) {
    run_for(1s);
  }
};

// Standby to science. The planner's candidates are 120 s apart: 600 of them in 20 h; fewer lie
// further apart.
gnc::TransferPlan plan_transfer(int most = kCandidates) {
  const std::int64_t epoch_ns = (2358LL * 604800 + 4 * 86400) * fs::kSecond_ns;
  gnc::TransferStart start;
  fs::OrbitElements& chief = start.orbit.chief;
  chief.a_m = 6928137.0;
  chief.ex = 0.0006;
  chief.ey = 0.0008;
  chief.i_rad = 97.59 * fs::kPi / 180.0;
  const fs::Vec3 now = gnc::sun_direction_EME2000(epoch_ns);
  chief.raan_rad = fs::wrap_two_pi(std::atan2(now[1], now[0]) - fs::kPi / 4.0);
  start.orbit.t_ns = epoch_ns;
  start.orbit.a_roe[fs::kDey] = start.orbit.a_roe[fs::kDiy] = -200.0;

  gnc::TransferGoal goal;
  const fs::Vec3 sun = gnc::sun_direction_EME2000(epoch_ns + 72000 * fs::kSecond_ns);
  goal.end_ns = gnc::observation_epoch_ns(chief, epoch_ns, sun, epoch_ns + 72000 * fs::kSecond_ns);
  const double dt_s = fs::seconds(goal.end_ns - epoch_ns);
  goal.a_roe = gnc::science_elements(fs::propagate_mean(chief, dt_s), sun, 40.0);
  gnc::TransferOptions options;
  options.max_candidates = most;
  options.limits.spacing_s = 120.0;
  options.last_ns = epoch_ns + 72000 * fs::kSecond_ns + 120 * fs::kSecond_ns;
  return gnc::ReconfigurationPlanner(options).plan(start, goal);
}

// The guide's budget is 2.5 MB for the whole package; the rest of it takes 0.5 MB.
TEST_F(ConeProgramMemoryTest, SixHundredCandidatesFitIntoTwoMegabytes) {
  const std::uint64_t before = heap("chief").resting_bytes();
  gnc::PlanStatus status = gnc::PlanStatus::kBadInput;
  int candidates = 0;
  flight("chief").run([&] {
    const gnc::TransferPlan plan = plan_transfer();
    status = plan.status;
    candidates = plan.candidates;
  });
  EXPECT_EQ(status, gnc::PlanStatus::kPlanned) << gnc::to_string(status);
  EXPECT_EQ(candidates, kCandidates);
  if (!heap_simulation_available()) return;
  EXPECT_EQ(heap("chief").resting_bytes(), before);   // everything is given back
  EXPECT_LT(heap("chief").high_water_bytes(), 2_MB);  // observed 1.50 MB
  EXPECT_GT(heap("chief").high_water_bytes(), 500_kB);
  EXPECT_LT(heap("chief").heap_bytes(), 2500_kB);  // with holes; observed 1.59 MB
  record_metric("high_water_bytes", static_cast<double>(heap("chief").high_water_bytes()));
  record_metric("heap_bytes", static_cast<double>(heap("chief").heap_bytes()));
}

// What it takes grows with the number of candidates, not with its square: from 150 to 600 by 4 and
// a little, where a full matrix grows by 16.
TEST_F(ConeProgramMemoryTest, MemoryGrowsInProportionToTheCandidates) {
  if (!heap_simulation_available()) GTEST_SKIP() << "no simulated heap";
  const double resting = static_cast<double>(heap("chief").resting_bytes());
  std::map<int, double> taken;  // beside what rests
  for (const int most : {150, 300, 450, kCandidates}) {
    flight("chief").run([most] { plan_transfer(most); });
    taken[most] = static_cast<double>(heap("chief").high_water_bytes()) - resting;
    record_metric("planner_bytes_" + std::to_string(most), taken[most]);
  }
  EXPECT_GT(taken[kCandidates], 2 * taken[150]);
  EXPECT_LT(taken[kCandidates], 6 * taken[150]);
}

// 5 N rows and 4 N columns of 8 bytes: 57.6 MB, which the heap has not.
TEST_F(ConeProgramMemoryTest, AFullMatrixEndsTheProcess) {
  if (!heap_simulation_available()) GTEST_SKIP() << "no simulated heap";
  EXPECT_FLIGHT_CRASH(flight("chief").run([] {
    gnc::DenseSocp problem;
    problem.G = Eigen::MatrixXd::Zero(5 * kCandidates, 4 * kCandidates);
    gnc::SocpSolver().solve(problem);
  }),
                      flight("chief"), CrashKindIs(CrashKind::kException));
  EXPECT_FALSE(flight("chief").alive());
  EXPECT_LT(heap("chief").high_water_bytes(), 1_MB);
}

}  // namespace
