#include "formation_gnc/control/fine_alignment.hpp"

#include <orrery/models/actuators/cold_gas_thruster.hpp>
#include <orrery/models/orbit/gravity.hpp>

#include <gtest/gtest.h>

#include "../flight_test_support.hpp"
#include "formation_gnc/control/science_orbit.hpp"
#include "formation_gnc/control/sun_direction.hpp"

namespace formation_gnc {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;

constexpr std::int64_t kMinute_ns = 60 * kSecond_ns;

// The acceleration is the gradient of the potential mu/r (1 - sum J_n (R/r)^n P_n), written down
// here once more: central differences over 100 m, h^2/6 of a third derivative, 1e-10 of g.
TEST(OrbitPredictionTest, ZonalGravityIsTheGradientOfItsPotential) {
  const auto potential = [](const Vec3& r) {
    const double d = norm(r), s = r[2] / d, q = kRadiusEarth_m / d;
    const double J3 = -std::sqrt(7.0) * 9.571739577330e-7, J4 = -3.0 * 5.399853533873e-7;
    const double sum = kJ2 * q * q * (1.5 * s * s - 0.5) +
                       J3 * q * q * q * (2.5 * s * s * s - 1.5 * s) +
                       J4 * q * q * q * q * (35 * s * s * s * s - 30 * s * s + 3) / 8;
    return kMuEarth_m3ps2 / d * (1.0 - sum);
  };
  const Vec3 r = vec3(4.0e6, -3.2e6, 4.6e6);
  const Vec3 a = ZonalGravity().acceleration_ECI(kEpoch_ns, r);
  for (int k = 0; k < 3; ++k) {
    Vec3 h;
    h[k] = 100.0;
    EXPECT_NEAR(a[k], (potential(r + h) - potential(r - h)) / 200.0, 1e-8) << k;
  }
}

TEST(OrbitPredictionTest, RunsBackAsItRanForth) {
  const StateEci s = flight_test::state_of_mean(flight_test::reference_chief());
  const ZonalGravity gravity;
  const StateEci there = propagate(gravity, s, kEpoch_ns, kEpoch_ns + 20 * kMinute_ns);
  const StateEci back = propagate(gravity, there, kEpoch_ns + 20 * kMinute_ns, kEpoch_ns);
  EXPECT_GT(norm(there.r_ECI - s.r_ECI), 5e6);
  EXPECT_LT(norm(back.r_ECI - s.r_ECI), 1e-2);  // RK4 in steps of 10 s: 0.5 m a day
}

// The simulator's field to a degree, with the Earth turning; 0: a point mass.
class HarmonicField : public GravityModel {
 public:
  explicit HarmonicField(int degree) {
    if (degree > 0) gravity_.emplace(orrery::GravityField::ggm05s(), degree);
  }
  Vec3 acceleration_ECI(std::int64_t t_ns, const Vec3& r_ECI) const override {
    if (!gravity_) return (-kMuEarth_m3ps2 / std::pow(norm(r_ECI), 3)) * r_ECI;
    const Mat3 R_IE = ecef_to_eci(t_ns, EarthTime());
    const Vec3 r = transpose(R_IE) * r_ECI;
    const orrery::Vec3 a = gravity_->acceleration_ECEF({r[0], r[1], r[2]});
    return R_IE * vec3(a.x, a.y, a.z);
  }

 private:
  std::optional<orrery::HarmonicGravity> gravity_;
};

// What a field leaves out of the relative motion at 40 m, against 60x60: the guide has 12 mm after
// 5 min for a point mass, 1.0 mm after 10 min for J2, 0.12 mm after 10 min for 20x20. It depends on
// where in the orbit: worst of six places, a factor of two. Observed 10.8, 0.69 and 0.11
// mm.
TEST(OrbitPredictionTest, RelativeMotionAsksForAField) {
  const HarmonicField truth(60);
  const auto error_mm = [&](const GravityModel& gravity, int minutes) {
    double worst = 0.0;
    for (int place = 0; place < 6; ++place) {
      OrbitElements chief = flight_test::reference_chief();
      chief.u_rad = kPi / 3.0 * place;
      const StateEci c = flight_test::state_of_mean(chief);
      const StateEci d{c.r_ECI + transpose(eci_to_rtn(c)) * vec3(0.0, 28.0, 28.6), c.v_ECI};
      const std::int64_t end_ns = kEpoch_ns + minutes * kMinute_ns;
      const auto relative = [&](const GravityModel& g) {
        return propagate(g, d, kEpoch_ns, end_ns).r_ECI - propagate(g, c, kEpoch_ns, end_ns).r_ECI;
      };
      worst = std::fmax(worst, 1e3 * norm(relative(gravity) - relative(truth)));
    }
    return worst;
  };
  const double point = error_mm(HarmonicField(0), 5), j2 = error_mm(HarmonicField(2), 10);
  const double twenty = error_mm(HarmonicField(20), 10);
  RecordProperty("point_mass_mm", std::to_string(point));
  RecordProperty("j2_mm", std::to_string(j2));
  RecordProperty("twenty_mm", std::to_string(twenty));
  EXPECT_NEAR(std::log2(point / 12.0), 0.0, 1.0) << point;
  EXPECT_NEAR(std::log2(j2 / 1.0), 0.0, 1.0) << j2;
  EXPECT_NEAR(std::log2(twenty / 0.12), 0.0, 1.0) << twenty;
}

// Six nozzles as the models of thrusters have them: constant scale and misalignment of each, shots.
struct TrueNozzles {
  explicit TrueNozzles(Noise& noise) {
    const ThrusterErrors errors;
    for (int nozzle = 0; nozzle < ThrusterScale::kNozzles; ++nozzle) {
      scale[nozzle] = 1.0 + errors.scale * noise.normal();
      tilt[nozzle] = noise.normal3(errors.misalignment_rad);
      tilt[nozzle][nozzle / 2] = 0.0;
    }
  }
  Vec3 fire(const Vec3& dv, Noise& noise) const {
    Vec3 done;
    for (int axis = 0; axis < 3; ++axis) {
      const int nozzle = 2 * axis + (dv[axis] < 0.0 ? 1 : 0);
      const double pushed = scale[nozzle] * (1.0 + 0.01 * noise.normal()) * std::abs(dv[axis]);
      done[axis] += nozzle % 2 == 0 ? pushed : -pushed;
      done = done + pushed * tilt[nozzle];
    }
    return done;
  }
  double scale[ThrusterScale::kNozzles];
  Vec3 tilt[ThrusterScale::kNozzles];  // what each pushes across, per m/s
};

// The covariance against burns by other thrusters and other shots. 20000 samples tell a variance to
// 1 %; 6 sigma.
TEST(ThrusterScaleTest, CovarianceIsThatOfExecutedBurns) {
  const Vec3 dv = vec3(1.2e-3, -0.4e-3, 0.7e-3);
  Noise noise(5);
  Mat3 sum;
  const int samples = 20000;
  for (int k = 0; k < samples; ++k) {
    const Vec3 done = TrueNozzles(noise).fire(dv, noise);
    sum = sum + (done - dv) * transpose(done - dv);
  }
  const Mat3 said = ThrusterScale().covariance(dv);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(sum(r, c) / samples, said(r, c), 0.06 * std::sqrt(said(r, r) * said(c, c)));
    }
  }
}

// Against the thruster's model: impulses in the flight computer's units and in on-times.
TEST(ThrusterScaleTest, OnTimesAreRoundedAsTheThrusterDoes) {
  Noise noise(5);
  const orrery::ColdGasThrusterOptions model;
  const double mass_kg = 11.0;
  for (int k = 0; k < 1000; ++k) {
    const Vec3 dv = noise.normal3(k % 2 == 0 ? 0.8e-3 : 2e-5);
    if (norm(dv) > 2.99e-3) continue;
    const auto on =
        orrery::ColdGasThruster::on_times(mass_kg * orrery::Vec3{dv[0], dv[1], dv[2]}, model);
    const Vec3 rounded = in_whole_on_times(dv, ImpulseLimits(), ThrusterErrors());
    for (int axis = 0; axis < 3; ++axis) {
      const auto along = static_cast<std::size_t>(2 * axis);
      const double on_s = orrery::to_seconds(on[along]) - orrery::to_seconds(on[along + 1]);
      EXPECT_NEAR(rounded[axis], model.force_N * on_s / mass_kg, 1e-12);
    }
  }
}

// A nozzle that gives less is commanded more: what is asked for is then cut, not refused.
TEST(ThrusterScaleTest, WholeOnTimesStayBelowTheLargestBurn) {
  Noise noise(6);
  const ImpulseLimits limits;
  const ThrusterErrors errors;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 direction = noise.normal3(1.0);
    const double size_mps = limits.max_mps * (0.98 + 0.0001 * k);
    const Vec3 rounded =
        in_whole_on_times((size_mps / norm(direction)) * direction, limits, errors);
    EXPECT_LE(norm(rounded), limits.max_mps);
    EXPECT_GE(norm(rounded), std::min(size_mps, limits.max_mps) - 3 * errors.quantum_mps);
    for (int axis = 0; axis < 3; ++axis) {
      const double quanta = rounded[axis] / errors.quantum_mps;
      EXPECT_NEAR(quanta, std::round(quanta), 1e-9);
      if (std::abs(direction[axis]) < 0.05 * norm(direction)) continue;
      EXPECT_NEAR(rounded[axis] / norm(rounded) * norm(direction) / direction[axis], 1, 0.02);
    }
  }
}

// Over 200 thrusters: thirty burns of 2 mm/s, seen to 10 um/s. Each nozzle does half of a component
// of some 1 mm/s. Fifteen shots of 1 % and as much noise make 0.4 %; the estimator knows how well
// it knows, and that of what a burn will do.
TEST(ThrusterScaleTest, LearnsEachNozzleAndKnowsHowWell) {
  double squares = 0.0, normalised = 0.0, said = 0.0, of_burn = 0.0;
  const int thrusters = 200;
  for (int k = 0; k < thrusters; ++k) {
    Noise noise(100 + static_cast<std::uint64_t>(k));
    const TrueNozzles truth(noise);
    ThrusterScale scale;
    for (int burn = 0; burn < 30; ++burn) {
      const Vec3 dv = noise.normal3(1.2e-3);
      scale.observe(dv, truth.fire(dv, noise) + noise.normal3(10e-6), vec3(10e-6, 10e-6, 10e-6));
    }
    for (int nozzle = 0; nozzle < ThrusterScale::kNozzles; ++nozzle) {
      const double error = scale.scale(nozzle) - truth.scale[nozzle], sigma = scale.sigma(nozzle);
      squares += error * error;
      normalised += error * error / (sigma * sigma);
      said += sigma;
    }
    const Vec3 dv = noise.normal3(1.2e-3);
    const Vec3 missed = truth.fire(dv, noise) - scale.delivered(dv);
    const Mat3 P = scale.covariance(dv);
    for (int axis = 0; axis < 3; ++axis) of_burn += missed[axis] * missed[axis] / P(axis, axis);
  }
  const int nozzles = thrusters * ThrusterScale::kNozzles;
  printf("seen %.4f, said %.4f, normalised %.3f, of a burn %.3f\n", std::sqrt(squares / nozzles),
         said / nozzles, std::sqrt(normalised / nozzles), std::sqrt(of_burn / (3 * thrusters)));
  EXPECT_LT(std::sqrt(squares / nozzles), 0.006);
  EXPECT_GT(std::sqrt(squares / nozzles), 0.002);  // shots of 1 % say no more
  // 5 sigma of 1200 and 600 samples.
  EXPECT_NEAR(std::sqrt(normalised / nozzles), 1.0, 0.1);
  EXPECT_NEAR(std::sqrt(of_burn / (3 * thrusters)), 1.0, 0.15);
}

// A nozzle that leans is made up for by the others.
TEST(ThrusterScaleTest, CommandsWhatTakesTheMisalignmentBack) {
  Noise noise(9);
  const TrueNozzles truth(noise);
  ThrusterScale scale;
  for (int burn = 0; burn < 200; ++burn) {
    const Vec3 dv = noise.normal3(1.2e-3);
    scale.observe(dv, truth.fire(dv, noise), vec3(1e-6, 1e-6, 1e-6));
  }
  const Vec3 wanted = vec3(-2e-3, 0, 0), command = scale.command_for(wanted);
  EXPECT_LT(norm(scale.delivered(command) - wanted), 1e-8);
  const Vec3 plain = truth.fire(wanted, noise), done = truth.fire(command, noise);
  EXPECT_LT(std::hypot(done[1], done[2]), 0.3 * std::hypot(plain[1], plain[2]));
}

TEST(ThrusterScaleTest, RefusesWhatTeachesNothing) {
  ThrusterScale scale;
  const Vec3 dv = vec3(1e-3, 0, 0), fair = vec3(1e-5, 1e-5, 1e-5);
  EXPECT_FALSE(scale.observe(Vec3(), dv, fair));
  EXPECT_FALSE(scale.observe(dv, vec3(NAN, 0, 0), fair));
  EXPECT_FALSE(scale.observe(dv, dv, Vec3()));
  EXPECT_FALSE(scale.observe(dv, Vec3(), fair));  // did not happen: 40 sigma
  for (int nozzle = 0; nozzle < ThrusterScale::kNozzles; ++nozzle) {
    EXPECT_EQ(scale.scale(nozzle), 1.0);
  }
  EXPECT_TRUE(scale.observe(dv, 1.03 * dv, 0.1 * fair));
  EXPECT_NEAR(scale.scale(0), 1.024, 1e-3);  // 0.02^2 / (0.02^2 + 0.01^2) of 0.03
  for (int other = 1; other < ThrusterScale::kNozzles; ++other) EXPECT_EQ(scale.scale(other), 1.0);
  EXPECT_NEAR(scale.command_for(dv)[0] * scale.scale(0), 1e-3, 1e-12);
  EXPECT_EQ(scale.command_for(-1.0 * dv)[0], -1e-3);  // another nozzle
}

// Both spacecraft on the way to an observation, `before_s` ahead of it; the optics spacecraft off
// by a position and a velocity.
struct FineAlignmentTest : testing::Test {
  FineAlignmentTest() {
    OrbitElements chief = flight_test::reference_chief();
    const Vec3 sun_now = sun_direction_EME2000(kEpoch_ns);
    chief.raan_rad = wrap_two_pi(std::atan2(sun_now[1], sun_now[0]) - kPi / 4.0);
    observation_ns = observation_epoch_ns(chief, kEpoch_ns, sun_now, kEpoch_ns);
    sun = sun_direction_EME2000(observation_ns);
    detector_then =
        flight_test::state_of_mean(propagate_mean(chief, seconds(observation_ns - kEpoch_ns)));
    optics_then = {detector_then.r_ECI + 40.0 * sun, detector_then.v_ECI};
  }
  AlignmentState off_by(double before_s, const Vec3& dr, const Vec3& dv) const {
    const std::int64_t t_ns = observation_ns - nanoseconds(before_s);
    AlignmentState state{t_ns, propagate(gravity, detector_then, observation_ns, t_ns),
                         propagate(gravity, optics_then, observation_ns, t_ns)};
    state.optics.r_ECI = state.optics.r_ECI + dr;
    state.optics.v_ECI = state.optics.v_ECI + dv;
    return state;
  }
  TrimPlan plan(const AlignmentState& state, bool optics_burns = true) const {
    return FineAlignment(gravity, options)
        .plan(state, state.t_ns + 30 * kSecond_ns, observation_ns, sun, optics_burns);
  }

  ZonalGravity gravity;
  AlignmentOptions options;
  std::int64_t observation_ns = 0;
  Vec3 sun;
  StateEci detector_then, optics_then;
};

TEST_F(FineAlignmentTest, NothingIsDoneWhereNothingIsWrong) {
  const TrimPlan trims = plan(off_by(2400.0, Vec3(), Vec3()));
  EXPECT_EQ(trims.count, 0);
  EXPECT_LT(trims.before.lateral_m, 1e-3);
  EXPECT_NEAR(trims.before.longitudinal_m, 0.0, 1e-3);
}

// Two metres and 1 mm/s off: the pair meets the target but for what the price of fuel and of the
// execution error leaves, 12 % of the tolerances at most; whichever of the two burns.
TEST_F(FineAlignmentTest, APairOfTrimsMeetsTheTarget) {
  const AlignmentState state = off_by(2400.0, vec3(1.2, -1.0, 1.1), vec3(4e-4, 7e-4, -5e-4));
  TrimPlan trims[2];
  for (const bool optics_burns : {true, false}) {
    TrimPlan& t = trims[optics_burns ? 0 : 1];
    t = plan(state, optics_burns);
    ASSERT_EQ(t.count, 2);
    EXPECT_EQ(t.impulse[0].t_ns, observation_ns - 1800 * kSecond_ns);
    EXPECT_EQ(t.impulse[1].t_ns, observation_ns - 420 * kSecond_ns);
    EXPECT_TRUE(t.within_limits);
    EXPECT_GT(t.before.lateral_m + std::fabs(t.before.longitudinal_m), 1.0);
    EXPECT_LT(t.after.lateral_m, 0.15 * options.lateral_m);
    EXPECT_LT(std::fabs(t.after.longitudinal_m), 0.15 * options.longitudinal_m);
    EXPECT_LT(t.after.lateral_mps, 0.15 * options.lateral_mps);
  }
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(norm(trims[0].impulse[k].dv_ECI + trims[1].impulse[k].dv_ECI), 1e-6);
  }
}

TEST_F(FineAlignmentTest, LateTrimsAreOneOrNone) {
  const Vec3 dr = vec3(0.01, -0.01, 0.02), dv = vec3(5e-5, 3e-5, 6e-5);
  const TrimPlan last = plan(off_by(400.0, dr, dv));
  ASSERT_EQ(last.count, 1);
  EXPECT_EQ(last.impulse[0].t_ns, observation_ns - 180 * kSecond_ns);
  EXPECT_LT(last.after.lateral_m, last.before.lateral_m);
  EXPECT_LT(last.after.lateral_mps, options.lateral_mps);
  EXPECT_EQ(plan(off_by(190.0, dr, dv)).count, 0);
}

TEST_F(FineAlignmentTest, ImpulsesKeepTheirLimits) {
  const TrimPlan far = plan(off_by(2400.0, vec3(20.0, 0, 0), Vec3()));
  EXPECT_FALSE(far.within_limits);
  for (int k = 0; k < far.count; ++k) {
    EXPECT_LE(norm(far.impulse[k].dv_ECI), options.limits.max_mps * (1 + 1e-12));
  }
  options.limits.min_mps = 1e-4;
  const TrimPlan near = plan(off_by(2400.0, vec3(0.05, 0, 0), Vec3()));
  for (int k = 0; k < near.count; ++k) {
    EXPECT_GE(norm(near.impulse[k].dv_ECI), options.limits.min_mps);
  }
}

// What decides good observations: errors of navigation (per axis) and of the thruster.
struct Errors {
  double position_m = 2e-3, velocity_mps = 25e-6;
  ThrusterErrors thruster = {};
  double min_mps = 0.25e-3 / 11.0;
  double last_trim_before_s = 180.0;
};

struct FineAlignmentMonteCarlo : FineAlignmentTest {
  Vec3 execute(const Vec3& dv, const Errors& errors, double scale, const Vec3& tilt,
               Noise* noise) const {
    const double size = norm(dv);
    if (size < errors.min_mps) return Vec3();
    const double shot = 1.0 + errors.thruster.shot_to_shot * noise->normal();
    return (scale * shot) * (dv + cross(tilt, dv));
  }

  // All eleven samples over t_o +- 5 s.
  bool is_good(const AlignmentState& at) const {
    for (int s = -5; s <= 5; ++s) {
      const std::int64_t t_ns = observation_ns + s * kSecond_ns;
      const Vec3 dr = propagate(gravity, at.optics, at.t_ns, t_ns).r_ECI -
                      propagate(gravity, at.detector, at.t_ns, t_ns).r_ECI;
      const Vec3 dv = propagate(gravity, at.optics, at.t_ns, t_ns).v_ECI -
                      propagate(gravity, at.detector, at.t_ns, t_ns).v_ECI;
      const Vec3 across = dr - dot(dr, sun) * sun, v_across = dv - dot(dv, sun) * sun;
      if (!(std::fabs(dot(dr, sun) - 40.0) <= 0.015 && norm(across) <= 0.018 &&
            norm(v_across) <= 2e-4)) {
        return false;
      }
    }
    return true;
  }

  double good_share(const Errors& errors) {
    const int runs = 200;
    options.last_trim_before_s = errors.last_trim_before_s;
    options.limits.min_mps = errors.min_mps;
    options.errors = errors.thruster;
    int good = 0;
    for (int run = 0; run < runs; ++run) {
      Noise noise(static_cast<std::uint64_t>(run) + 1);
      AlignmentState truth = off_by(2400.0, noise.normal3(0.5), noise.normal3(3e-4));
      const double scale = 1.0 + errors.thruster.scale * noise.normal();
      const Vec3 tilt = noise.normal3(errors.thruster.misalignment_rad);
      const auto coast_to = [&](std::int64_t t_ns) {
        truth.detector = propagate(gravity, truth.detector, truth.t_ns, t_ns);
        truth.optics = propagate(gravity, truth.optics, truth.t_ns, t_ns);
        truth.t_ns = t_ns;
      };
      for (const double before_s : {options.first_trim_before_s, options.middle_trim_before_s,
                                    options.last_trim_before_s}) {
        const std::int64_t slot_ns = observation_ns - nanoseconds(before_s);
        coast_to(slot_ns);
        AlignmentState seen = truth;
        seen.optics.r_ECI = seen.optics.r_ECI + noise.normal3(errors.position_m);
        seen.optics.v_ECI = seen.optics.v_ECI + noise.normal3(errors.velocity_mps);
        const TrimPlan trims =
            FineAlignment(gravity, options).plan(seen, seen.t_ns, observation_ns, sun, true);
        if (trims.count == 0 || trims.impulse[0].t_ns != slot_ns) continue;
        truth.optics.v_ECI =
            truth.optics.v_ECI + execute(trims.impulse[0].dv_ECI, errors, scale, tilt, &noise);
      }
      if (is_good(truth)) ++good;
    }
    return static_cast<double>(good) / runs;
  }
};

// The guide's table is of a two-impulse law, planned with what is known at the trim itself. Where
// navigation decides, three trims do as well: it says 91 % at 25 um/s, 66 % at 50 um/s, 78 % at 1
// cm (3D), 2.5 % at 0.3 mm/s, and no change for a smallest impulse of 90 um/s. Where execution or
// the time of the last trim decides, they do better: it says 54 % at 5 % and 1 deg, 57 % with the
// last trim at 5 min. Two hundred runs tell a share to 0.035 (1 sigma). Observed 0.92, 0.65, 0.84,
// 0.00, 0.92, 0.85, 0.78 in 400 runs.
TEST_F(FineAlignmentMonteCarlo, SharesOfGoodObservationsAreThoseOfTheGuide) {
  const double base = good_share({});
  EXPECT_NEAR(base, 0.91, 0.07);
  EXPECT_NEAR(good_share({.velocity_mps = 50e-6}), 0.66, 0.10);
  EXPECT_NEAR(good_share({.position_m = 0.01 / std::sqrt(3.0)}), 0.80, 0.10);
  EXPECT_LT(good_share({.velocity_mps = 3e-4}), 0.05);
  EXPECT_NEAR(good_share({.min_mps = 90e-6}), base, 0.05);
  EXPECT_GT(good_share({.thruster = {.scale = 0.05, .misalignment_rad = 0.01745}}), 0.65);
  EXPECT_GT(good_share({.last_trim_before_s = 300.0}), 0.57);
}

}  // namespace
}  // namespace formation_gnc
