#include "rpo_kit/imaging/star_identification.hpp"

#include <gtest/gtest.h>

#include "rpo_kit/imaging/target_tracker.hpp"
#include "star_scene.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::Noise;

const Vec3 kVelocity = vec3(-22000.0, 18000.0, 9000.0);  // Earth's and the spacecraft's [m/s]

// Exact aberration, to first order of which flight code keeps itself.
Vec3 apparent(const Vec3& direction) {
  const Vec3 beta = (1.0 / 299792458.0) * kVelocity;
  const double gamma = 1.0 / std::sqrt(1.0 - dot(beta, beta));
  const double along = dot(direction, beta);
  const Vec3 shifted = (1.0 / gamma) * direction + (1.0 + along / (1.0 + 1.0 / gamma)) * beta;
  return (1.0 / norm(shifted)) * shifted;
}

TEST(AttitudeTest, NoiseFreeDirectionsGiveTheRotationAtAnyAngle) {
  Noise noise(5);
  for (int k = 0; k < 200; ++k) {
    const Vec3 axis = flight_test::random_direction(&noise);
    // Every fourth turn is of 180 deg, where QUEST's Gibbs vector has its pole.
    const double angle = k % 4 == 0 ? kPi : kTwoPi * noise.uniform();
    const Mat3 R_CI = flight_test::axis_rotation(axis, angle);
    std::vector<DirectionPair> pairs;
    for (int j = 0; j < 2 + k % 5; ++j) {
      Vec3 d = vec3(0, 0, 1.0) + noise.normal3(0.08);
      d = (1.0 / norm(d)) * d;
      pairs.push_back({d, transpose(R_CI) * d, 1e-5});
    }
    Attitude attitude;
    ASSERT_TRUE(solve_attitude(pairs.data(), static_cast<int>(pairs.size()), &attitude));
    // 1e-16 over the spread of directions across the field, squared, down to 1e-4: 1e-11 typically.
    EXPECT_LT(norm(flight_test::small_turn(attitude.R_CI, R_CI)), 1e-9);
  }
}

// Normalised errors squared are chi-square of 3 degrees of freedom; of 400 their mean is 3 +-
// sqrt(6/400) = 0.12 (1 sigma).
TEST(AttitudeTest, CovarianceIsHonest) {
  Noise noise(6);
  double sum = 0.0;
  for (int k = 0; k < 400; ++k) {
    const Mat3 R_CI =
        flight_test::axis_rotation(flight_test::random_direction(&noise), kTwoPi * noise.uniform());
    std::vector<DirectionPair> pairs;
    for (int j = 0; j < 12; ++j) {
      Vec3 d = vec3(0, 0, 1.0) + noise.normal3(0.08);
      d = (1.0 / norm(d)) * d;
      const double sigma = j < 6 ? 2e-5 : 6e-5;
      Vec3 seen = d + noise.normal3(sigma);
      seen = (1.0 / norm(seen)) * seen;
      pairs.push_back({seen, transpose(R_CI) * d, sigma});
    }
    Attitude attitude;
    ASSERT_TRUE(solve_attitude(pairs.data(), 12, &attitude));
    sum += squared_mahalanobis(attitude.covariance_C, flight_test::small_turn(attitude.R_CI, R_CI));
  }
  EXPECT_NEAR(sum / 400.0, 3.0, 0.4);
}

TEST(AttitudeTest, OneDirectionIsNotEnough) {
  const Vec3 d = vec3(0, 0, 1.0);
  const DirectionPair same[2] = {{d, d, 1e-5}, {d, d, 1e-5}};
  Attitude attitude;
  EXPECT_FALSE(solve_attitude(same, 1, &attitude));
  EXPECT_FALSE(solve_attitude(same, 2, &attitude));
}

// The k-vector against going through all stars.
TEST(StarCatalogueTest, PairsAreThoseOfTheNaiveSearch) {
  const StarCatalogue catalogue(flight_test::random_sky(600, 5.0, 11), 4.6, 0.5);
  for (double low : {0.0, 0.05, 0.21, 0.499}) {
    const double high = low + 0.003;
    std::size_t expected = 0;
    for (std::size_t a = 0; a < catalogue.stars().size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        const Star &p = catalogue.stars()[a], &q = catalogue.stars()[b];
        const double angle = std::acos(dot(p.direction_ECI, q.direction_ECI));
        if (std::max(p.magnitude, q.magnitude) <= 4.6 && angle >= low && angle <= high &&
            angle <= 0.5) {
          ++expected;
        }
      }
    }
    const StarPairRange range = catalogue.pairs_between(low, high);
    EXPECT_EQ(static_cast<std::size_t>(range.end - range.begin), expected) << low;
  }
  const StarPairRange beyond = catalogue.pairs_between(0.51, 0.6);
  EXPECT_EQ(beyond.begin, beyond.end);
}

struct View {
  std::vector<SeenSource> seen;
  std::vector<int> star;  // truth; -1: false
};

// The brightest 30 stars of the field with 0.15 px of noise, and false sources among the brightest.
View look(const StarCatalogue& catalogue, const Camera& camera, const Mat3& R_CI, double limit,
          int false_sources, Noise* noise) {
  View view;
  const double sigma = 0.15 / camera.fx;
  const auto add = [&](const Vec3& direction_C, int star) {
    Vec3 d = direction_C + noise->normal3(sigma);
    view.seen.push_back({(1.0 / norm(d)) * d, sigma});
    view.star.push_back(star);
  };
  for (std::size_t k = 0; k < catalogue.stars().size() && view.seen.size() < 30; ++k) {
    double u = 0.0, v = 0.0;
    const Vec3 d = R_CI * apparent(catalogue.stars()[k].direction_ECI);
    if (catalogue.stars()[k].magnitude > limit) break;
    if (!flight_test::pinhole(camera, d, &u, &v)) continue;
    if (view.seen.size() % 4 == 2 && false_sources-- > 0) {
      const double x = 0.3 * (noise->uniform() - 0.5);
      const double y = 0.3 * (noise->uniform() - 0.5);
      add(vec3(x, y, 1.0), -1);
    }
    add(d, static_cast<int>(k));
  }
  return view;
}

// Random attitudes: how many are found, and that none is wrong. Missed views are those with fewer
// than five stars in the field.
void expect_found(const StarCatalogue& catalogue, double limit, int at_least) {
  const Camera camera = flight_test::wide_camera();
  StarIdentifier identifier(catalogue);
  Noise noise(21);
  int found = 0;
  double cross_boresight = 0.0;
  for (int k = 0; k < 60; ++k) {
    const Vec3 boresight = flight_test::random_direction(&noise);
    const Mat3 R_CI = flight_test::looking_along(boresight, kTwoPi * noise.uniform());
    const View view = look(catalogue, camera, R_CI, limit, 3, &noise);
    Identification result;
    if (!identifier.lost_in_space(view.seen, kVelocity, &result)) continue;
    ++found;
    const Vec3 turn = flight_test::small_turn(result.attitude.R_CI, R_CI);
    // 0.15 px of 30 stars: 0.03 px or 1e-5 rad across, ten times that about the boresight; 5 sigma.
    EXPECT_LT(std::hypot(turn[0], turn[1]), 8e-5) << k;
    EXPECT_LT(std::fabs(turn[2]), 1e-3) << k;
    EXPECT_LT(squared_mahalanobis(result.attitude.covariance_C, turn), 25.0) << k;
    cross_boresight += 0.5 * (turn[0] * turn[0] + turn[1] * turn[1]) / 60.0;
    for (std::size_t j = 0; j < view.star.size(); ++j) {
      EXPECT_TRUE(result.star[j] < 0 || result.star[j] == view.star[j]) << k << ' ' << j;
    }
    // And from a prediction that is 0.1 deg off.
    Identification tracked;
    const Mat3 predicted = flight_test::axis_rotation(vec3(0.6, 0, 0.8), 0.0017) * R_CI;
    ASSERT_TRUE(identifier.track(view.seen, kVelocity, predicted, 0.002, &tracked)) << k;
    EXPECT_LT(norm(flight_test::small_turn(tracked.attitude.R_CI, result.attitude.R_CI)), 1e-4);
  }
  EXPECT_GE(found, at_least);
  testing::Test::RecordProperty("found_of_60", found);
  testing::Test::RecordProperty("cross_boresight_urad",
                                std::to_string(1e6 * std::sqrt(cross_boresight)));
}

TEST(StarIdentificationTest, FindsAnyAttitudeUnderARandomSky) {
  const StarCatalogue catalogue(flight_test::random_sky(5000, 6.0, 12), 5.4, 0.45);
  expect_found(catalogue, 5.4, 60);
}

TEST(StarIdentificationTest, FindsAnyAttitudeUnderTheRealSky) {
  const std::vector<Star> sky = flight_test::bright_stars(ORRERY_REFERENCE_DATA "/stars/bsc5.csv");
  if (sky.empty()) GTEST_SKIP() << "no stars/bsc5.csv in " << ORRERY_REFERENCE_DATA;
  const StarCatalogue catalogue(sky, 5.3, 0.45);
  // Towards the galactic poles a field of 20 deg holds 15 stars, less false ones still enough.
  expect_found(catalogue, 5.3, 58);
}

// A sky that is not the camera's: 60 views of another must not be taken for known.
TEST(StarIdentificationTest, ForeignStarsAreNotRecognised) {
  const StarCatalogue catalogue(flight_test::random_sky(5000, 6.0, 12), 5.4, 0.45);
  const StarCatalogue foreign(flight_test::random_sky(5000, 6.0, 13), 5.4, 0.45);
  StarIdentifier identifier(catalogue);
  Noise noise(22);
  for (int k = 0; k < 10; ++k) {
    const Mat3 R_CI = flight_test::looking_along(flight_test::random_direction(&noise), 1.0);
    const View view = look(foreign, flight_test::wide_camera(), R_CI, 5.4, 0, &noise);
    Identification result;
    EXPECT_FALSE(identifier.lost_in_space(view.seen, kVelocity, &result)) << k;
  }
}

TEST(StarIdentificationTest, ThreeSourcesAreNotEnough) {
  const StarCatalogue catalogue(flight_test::random_sky(2000, 6.0, 12), 5.4, 0.45);
  StarIdentifier identifier(catalogue);
  std::vector<SeenSource> seen;
  Identification result;
  EXPECT_FALSE(identifier.lost_in_space(seen, kVelocity, &result));
  for (int k = 0; k < 3; ++k) seen.push_back({catalogue.stars()[0].direction_ECI, 1e-5});
  EXPECT_FALSE(identifier.lost_in_space(seen, kVelocity, &result));
}

// The chain from pixels to a bearing: a dim target 3 deg off the boresight that drifts in RTN,
// among catalogue stars, fainter ones that no catalogue knows, and hot pixels of one and two
// pixels. The camera is fixed in RTN, so stars stream through the field and hot pixels do not.
TEST(TargetTrackerTest, FindsTheTargetInRenderedFramesAndItsBearing) {
  const std::vector<Star> all = flight_test::random_sky(9000, 6.6, 31);
  std::vector<Star> known;
  for (const Star& star : all) {
    if (star.magnitude < 6.0) known.push_back(star);
  }
  const StarCatalogue catalogue(known, 5.4, 0.45);
  Camera camera = flight_test::wide_camera();
  const double n = 1.1e-3;
  StarIdentifier identifier(catalogue);
  DetectionOptions options;
  options.electrons_per_dn = 2.0;
  PointSourceDetector detector(camera.width, camera.height, options);
  TargetTracker tracker(TrackerOptions(), detector.hot_sharpness());
  Noise noise(32);
  const Mat3 R_CH = flight_test::looking_along(vec3(0.0, 1.0, 0.0), 0.3);
  Identification fix;
  double squares = 0.0;
  int bearings = 0;
  for (int k = 0; k < 10; ++k) {
    const double t_s = 60.0 * k;
    // Orbit normal along ECI z; 2e-5 rad of pointing jitter does not fool the hot-pixel test.
    const Mat3 R_HI = flight_test::axis_rotation(vec3(0, 0, 1), n * t_s);
    const Mat3 R_CI = R_CH * R_HI;
    const Vec3 target_H = (1.0 / norm(vec3(0.05 + 2e-5 * t_s, 1.0, -0.03 + 3e-5 * t_s))) *
                          vec3(0.05 + 2e-5 * t_s, 1.0, -0.03 + 3e-5 * t_s);
    flight_test::Exposure exposure(camera.width, camera.height, 60.0);
    double u = 0.0, v = 0.0;
    for (const Star& star : all) {
      if (!flight_test::pinhole(camera, R_CI * apparent(star.direction_ECI), &u, &v)) continue;
      exposure.add_source(u, v, 6e5 * std::pow(10.0, -0.4 * star.magnitude), 0.8);
    }
    ASSERT_TRUE(flight_test::pinhole(camera, R_CH * target_H, &u, &v));
    exposure.add_source(u, v, 2400.0, 0.8);
    exposure.add(700, 300, 3000.0);
    exposure.add(200, 600, 2000.0);
    exposure.add(201, 600, 2000.0);
    exposure.read_out(2.0, 10.0, &noise);

    std::vector<Detection> found;
    ASSERT_TRUE(detector.detect(exposure.view(), &found));
    std::vector<SeenSource> seen;
    for (const Detection& d : found) {
      SeenSource source;
      ASSERT_TRUE(unproject(camera, {d.u, d.v}, &source.direction_C));
      source.sigma_rad = d.sigma_px / camera.fx;
      seen.push_back(source);
    }
    if (k == 0) {
      ASSERT_TRUE(identifier.lost_in_space(seen, kVelocity, &fix));
    } else {
      const Mat3 predicted = flight_test::axis_rotation(vec3(0.3, 0.9, 0.1), 1e-3) * R_CI;
      ASSERT_TRUE(identifier.track(seen, kVelocity, predicted, 1.2e-3, &fix)) << k;
    }
    std::vector<UnknownSource> unknown;
    for (std::size_t j = 0; j < found.size(); ++j) {
      if (fix.star[j] >= 0) continue;
      unknown.push_back({found[j], transpose(fix.attitude.R_CI) * seen[j].direction_C,
                         std::hypot(seen[j].sigma_rad, 2e-5)});
    }
    tracker.frame(static_cast<std::int64_t>(t_s) * kSecond_ns, R_HI, unknown);
    const Track* target = tracker.target();
    EXPECT_TRUE(k >= 2 || target == nullptr) << k;
    if (k < 3) continue;
    ASSERT_NE(target, nullptr) << k;
    ASSERT_GE(target->source, 0);
    const double error = norm(target->direction_H - target_H);
    // 2400 e- over 12 e- of noise a pixel: 0.06 px or 2e-5 rad a coordinate, with attitude; 5
    // sigma.
    EXPECT_LT(error, 1.5e-4) << k;
    squares += error * error / 2.0;
    ++bearings;
    EXPECT_GT(tracker.stars_set_aside(), 3);
    EXPECT_GE(tracker.hot_set_aside(), 1);
  }
  RecordProperty("bearing_urad", std::to_string(1e6 * std::sqrt(squares / bearings)));
  // Nothing else is taken for a target: the streak of hot pixels is, at most, for some frames.
  int confirmed = 0;
  for (const Track& track : tracker.tracks()) confirmed += track.confirmed && track.source >= 0;
  EXPECT_EQ(confirmed, 1);
}

// Missing frames and a frame that comes twice do no harm; after six without the target the track
// is gone and a new one is found.
TEST(TargetTrackerTest, TrackSurvivesGapsAndEndsAfterSix) {
  TargetTracker tracker;
  const Mat3 R_HI = flight_test::axis_rotation(vec3(0, 0, 1), 0.4);
  const auto frame = [&](int k, bool visible) {
    std::vector<UnknownSource> sources;
    const Vec3 d_H = vec3(1e-3 * k, 1.0, -2e-3 * k);
    Detection detection;
    detection.u = 100.3 + 3.1 * k, detection.v = 200.2 - 2.3 * k;
    detection.sharpness = 0.2;
    const Mat3 R = flight_test::axis_rotation(vec3(0, 0, 1), 0.066 * k) * R_HI;
    if (visible) sources.push_back({detection, transpose(R) * ((1.0 / norm(d_H)) * d_H), 3e-5});
    tracker.frame(60 * kSecond_ns * k, R, sources);
  };
  for (int k = 1; k < 6; ++k) frame(k, true);
  ASSERT_NE(tracker.target(), nullptr);
  const int id = tracker.target()->id;
  frame(5, true);  // again
  EXPECT_EQ(tracker.target()->hits, 5);
  for (int k = 6; k < 11; ++k) frame(k, false);
  ASSERT_NE(tracker.target(), nullptr);
  frame(11, true);
  EXPECT_EQ(tracker.target()->id, id);
  EXPECT_EQ(tracker.target()->hits, 6);
  for (int k = 12; k < 18; ++k) frame(k, false);
  EXPECT_EQ(tracker.target(), nullptr);
  for (int k = 18; k < 22; ++k) frame(k, true);
  ASSERT_NE(tracker.target(), nullptr);
  EXPECT_NE(tracker.target()->id, id);
  const Vec3 elsewhere = vec3(0.0, -1.0, 0.0);
  EXPECT_EQ(tracker.target(&elsewhere, 0.1), nullptr);
}

}  // namespace
}  // namespace rpo_kit
