// Corners that the flight software finds in rendered images, against the corners of the model
// projected by the camera model of the renderer (which OpenCV's projectPoints checks).
#include "rpo_kit/near_range/keypoint_finder.hpp"

#include <orrery/models/camera/detector.hpp>
#include <orrery/models/camera/scene.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "../../../missions/inspection_target.hpp"
#include "../flight_test_support.hpp"

namespace {

using flight_support::Mat3;
using flight_support::norm;
using flight_support::transpose;
using flight_support::Vec3;
using flight_support::vec3;
using flight_test::Noise;

constexpr double kDegree = 0.0174532925199433;

orrery::PinholeOptions lens() {
  return {.width_px = 512,
          .height_px = 512,
          .fx_px = 3000,
          .fy_px = 3000,
          .distortion = {.k1 = -0.09, .k2 = 0.03, .p1 = 2e-4, .p2 = -1e-4}};
}
rpo_kit::Camera flight_camera() {
  return {512, 512, 3000, 3000, 255.5, 255.5, -0.09, 0.03, 2e-4, -1e-4, 0};
}
constexpr rpo_kit::PixelNoise kNoise{4, 64, 8, 0.01};

rpo_kit::Wireframe wireframe() {
  std::vector<Vec3> corners;
  for (const orrery::Vec3& c : orrery::rendezvous::target_corners_B()) {
    corners.push_back(vec3(c.x, c.y, c.z));
  }
  std::vector<rpo_kit::WireframeFace> faces;
  for (const std::vector<int>& given : orrery::rendezvous::target_faces()) {
    rpo_kit::WireframeFace face;
    for (const int corner : given) face.corners[face.count++] = corner;
    face.albedo = orrery::rendezvous::target_albedos()[faces.size()];
    faces.push_back(face);
  }
  rpo_kit::Wireframe wireframe;
  EXPECT_TRUE(wireframe.set(corners, faces));
  return wireframe;
}

orrery::Vec3 of(const Vec3& v) {
  return {v[0], v[1], v[2]};
}
orrery::Mat3 of(const Mat3& m) {
  return {{m(0, 0), m(0, 1), m(0, 2)}, {m(1, 0), m(1, 1), m(1, 2)}, {m(2, 0), m(2, 1), m(2, 2)}};
}

/// The camera's axes are ECI's here, 7000 km above the Earth's middle.
struct Picture {
  rpo_kit::Pose truth;
  Vec3 to_sun_C;
  orrery::DigitalImage image;
  rpo_kit::ImageView view() const { return {image.values.data(), image.width_px, image.height_px}; }
};

Vec3 direction(Noise& noise) {
  const Vec3 v = vec3(noise.normal(), noise.normal(), noise.normal());
  return (1 / norm(v)) * v;
}

/// Sun between 20 and 110 deg off the line from target to camera.
Picture picture(std::uint64_t seed, double range_m) {
  Noise noise(seed);
  Picture p;
  const Vec3 aside = vec3(0.01 * noise.normal(), 0.01 * noise.normal(), 1);
  p.truth.r_BC_C = range_m * ((1 / norm(aside)) * aside);
  p.truth.R_CB =
      rpo_kit::turned(3.1 * noise.uniform() * direction(noise), flight_support::identity<3>());
  const double phase = kDegree * (20 + 90 * noise.uniform()), turn = 6.28 * noise.uniform();
  const orrery::Vec3 to_sun{std::sin(phase) * std::cos(turn), std::sin(phase) * std::sin(turn),
                            -std::cos(phase)};
  p.to_sun_C = vec3(to_sun.x, to_sun.y, to_sun.z);
  static const orrery::PinholeCamera camera(lens());
  static orrery::Scene scene(
      camera, {.aperture_m = 0.003},
      {.earth = false, .sun_and_moon = false, .targets = {orrery::rendezvous::inspection_mesh()}});
  orrery::RandomStream pattern(7);
  static const orrery::Detector detector({.bits = 14,
                                          .gain_electrons_per_DN = 4,
                                          .full_well_electrons = 66000,
                                          .hot_pixels_per_million = 100,
                                          .hot_pixel_electrons_ps = 1e6},
                                         512, 512, pattern);
  orrery::SceneState state;
  state.camera.r_ECI = {0, 0, 7e6};
  state.camera.R_CI = of(flight_support::identity<3>());
  state.R_EI = state.camera.R_CI;
  state.r_sun_ECI = 1.496e11 * to_sun;
  state.r_moon_ECI = {0, 3.8e8, 0};
  state.targets = {
      {.r_ECI = state.camera.r_ECI + of(p.truth.r_BC_C), .R_TI = of(transpose(p.truth.R_CB))}};
  const orrery::ExposureTime exposure{4e-4, 0};
  p.image = detector.read(scene.render(state, exposure).light, 4e-4, seed);
  return p;
}

struct Corners {
  int count = 0, far = 0;  // beyond 5 sigma
  double squares_px2 = 0, chi2 = 0;
  double rms_px() const { return std::sqrt(squares_px2 / (2 * count)); }
  double normalised() const { return std::sqrt(chi2 / (2 * count)); }
};
void compare(const Picture& p, const std::vector<rpo_kit::Keypoint>& keypoints, Corners* all) {
  static const orrery::PinholeCamera camera(lens());
  const auto corners = orrery::rendezvous::target_corners_B();
  for (const rpo_kit::Keypoint& k : keypoints) {
    const orrery::Vec3& c = corners[static_cast<std::size_t>(k.point)];
    const auto at = camera.project(of(p.truth.r_BC_C + p.truth.R_CB * vec3(c.x, c.y, c.z)));
    const double off_px = std::hypot(at->u - k.pixel.u, at->v - k.pixel.v);
    ++all->count;
    all->far += off_px > 5 * k.sigma_px ? 1 : 0;
    all->squares_px2 += off_px * off_px;
    all->chi2 += off_px * off_px / (k.sigma_px * k.sigma_px);
  }
}

double turn_deg(const Mat3& a, const Mat3& b) {
  const Mat3 D = a * transpose(b);
  return std::acos(std::min(1.0, 0.5 * (D(0, 0) + D(1, 1) + D(2, 2) - 1))) / kDegree;
}

/// A few in ctest.
int pictures(int few) {
  const char* more = std::getenv("KEYPOINT_PICTURES");
  return more == nullptr ? few : std::atoi(more);
}

}  // namespace

// From a guess 3 deg and 1 % of the range off, at 60 to 15 m. Required for poses: 2 deg, 1 %. Of
// KEYPOINT_PICTURES=60: 52 found, 1048 corners 0.35 px off (0.71 sigma), 9 beyond 5 sigma; poses
// 0.37 deg (median), range 0.48 % (1.0 sigma). Sun up to 110 deg off: some show nearly nothing.
TEST(KeypointFinderTest, CornersNearAGuessAreThoseOfTheModel) {
  const rpo_kit::Wireframe shape = wireframe();
  rpo_kit::KeypointFinder finder(shape);
  Corners corners;
  int found = 0;
  double place_chi2 = 0, place = 0;
  std::vector<double> turns;
  const int count = pictures(10);
  for (int k = 0; k < count; ++k) {
    const double range_m = 60 - 45.0 * k / std::max(1, count - 1);
    const Picture p = picture(100 + static_cast<std::uint64_t>(k), range_m);
    Noise noise(static_cast<std::uint64_t>(k));
    rpo_kit::Pose guess = p.truth;
    guess.r_BC_C = 1.01 * guess.r_BC_C;
    guess.R_CB = rpo_kit::turned(3 * kDegree * direction(noise), guess.R_CB);
    std::vector<rpo_kit::Keypoint> keypoints;
    finder.find(flight_camera(), p.view(), kNoise, p.to_sun_C, &guess, 3.0, &keypoints);
    found += keypoints.empty() ? 0 : 1;
    compare(p, keypoints, &corners);
    rpo_kit::Pose pose;
    if (!rpo_kit::estimate_pose(flight_camera(), shape.corners_B(), keypoints, {}, &pose)) continue;
    turns.push_back(turn_deg(pose.R_CB, p.truth.R_CB));
    const double off_m = pose.r_BC_C[2] - p.truth.r_BC_C[2];
    place_chi2 += off_m * off_m / pose.covariance(2, 2);
    place += off_m * off_m / (range_m * range_m);
  }
  ASSERT_GT(turns.size(), 2u);
  const double poses = static_cast<double>(turns.size());
  std::sort(turns.begin(), turns.end());
  std::printf(
      "%d of %d; %d corners, %d beyond 5 sigma, %.2f px, normalised %.2f; %.0f poses: range "
      "%.2f %%, normalised %.2f; %.2f deg (median), %.2f worst\n",
      found, count, corners.count, corners.far, corners.rms_px(), corners.normalised(), poses,
      100 * std::sqrt(place / poses), std::sqrt(place_chi2 / poses), turns[turns.size() / 2],
      turns.back());
  EXPECT_GT(2 * found, count);
  EXPECT_LT(corners.rms_px(), 0.6);
  EXPECT_LT(corners.normalised(), 1.3);
  EXPECT_LE(20 * corners.far, corners.count);
  EXPECT_LT(turns[turns.size() / 2], 1.0);
  EXPECT_LT(100 * std::sqrt(place / poses), 1.0);
}

// All attitudes, 55 m away. No answer is no error, another attitude is: more than 20 deg. Required:
// one answer of twenty at most, as a track starts with two that agree. Of KEYPOINT_PICTURES=60: 26
// right, one wrong.
TEST(KeypointFinderTest, AttitudeIsFoundWithoutAGuess) {
  const rpo_kit::Wireframe shape = wireframe();
  rpo_kit::KeypointFinder finder(shape);
  int right = 0, wrong = 0;
  const int count = pictures(4);
  for (int k = 0; k < count; ++k) {
    const Picture p = picture(500 + static_cast<std::uint64_t>(k), 55);
    std::vector<rpo_kit::Keypoint> keypoints;
    const auto finding =
        finder.find(flight_camera(), p.view(), kNoise, p.to_sun_C, nullptr, 0, &keypoints);
    if (finding != rpo_kit::Finding::kAcquired) continue;
    (turn_deg(finder.pose().R_CB, p.truth.R_CB) < 20 ? right : wrong)++;
  }
  std::printf("%d right, %d wrong of %d\n", right, wrong, count);
  EXPECT_LE(20 * wrong, right + wrong);
  EXPECT_GE(4 * right, count);
}

// A half turn of the truth is no guess to be followed: it is found out, and mostly mended.
TEST(KeypointFinderTest, FlippedGuessIsNotFollowed) {
  const rpo_kit::Wireframe shape = wireframe();
  rpo_kit::KeypointFinder finder(shape);
  int flipped = 0;
  for (const std::uint64_t seed : {507u}) {
    const Picture p = picture(seed, 40);
    for (int axis = 0; axis < 3; ++axis) {
      Mat3 half = -1.0 * flight_support::identity<3>();
      half(axis, axis) = 1;
      rpo_kit::Pose guess = p.truth;
      guess.R_CB = guess.R_CB * half;
      std::vector<rpo_kit::Keypoint> keypoints;
      const auto finding =
          finder.find(flight_camera(), p.view(), kNoise, p.to_sun_C, &guess, 2.0, &keypoints);
      if (keypoints.empty()) continue;
      flipped += turn_deg(finder.pose().R_CB, p.truth.R_CB) > 20 ? 1 : 0;
      EXPECT_LT(turn_deg(finder.pose().R_CB, p.truth.R_CB), 20)
          << seed << " " << axis << " " << static_cast<int>(finding);
    }
  }
  EXPECT_EQ(flipped, 0);
}

// The pose that is true explains the faces' light, its half turns do not.
TEST(EdgeFitTest, LightTellsAHalfTurn) {
  const rpo_kit::Wireframe shape = wireframe();
  const Picture p = picture(519, 40);
  const rpo_kit::EdgeFit fit(shape, flight_camera(), p.view(), kNoise);
  const double own = fit.shading(p.truth, p.to_sun_C);
  EXPECT_GT(own, 0.9);  // a patch's shadow and the lobe of the panels are not in it
  for (int axis = 0; axis < 3; ++axis) {
    Mat3 half = -1.0 * flight_support::identity<3>();
    half(axis, axis) = 1;
    rpo_kit::Pose turned = p.truth;
    turned.R_CB = turned.R_CB * half;
    EXPECT_LT(fit.shading(turned, p.to_sun_C), own - 0.05) << axis;
  }
  EXPECT_LT(fit.shading(p.truth, -1.0 * p.to_sun_C), own - 0.05);
}

// The closed form: of a box seen along a diagonal nine of twelve edges, along an axis four, and
// behind a plate none.
TEST(WireframeTest, EdgesThatAreTurnedAwayOrHiddenAreNotSeen) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k) {
    corners.push_back(vec3((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1));
  }
  std::vector<rpo_kit::WireframeFace> faces = {{{0, 4, 6, 2}, 4}, {{1, 3, 7, 5}, 4},
                                               {{0, 1, 5, 4}, 4}, {{2, 6, 7, 3}, 4},
                                               {{0, 2, 3, 1}, 4}, {{4, 5, 7, 6}, 4}};
  const auto edges = [](const rpo_kit::Wireframe& w, const Vec3& eye) {
    std::vector<rpo_kit::EdgePoint> points;
    w.seen_from(eye, 0.2, &points);
    std::vector<int> seen;
    for (const rpo_kit::EdgePoint& p : points) {
      if (p.edge < 12 && (seen.empty() || seen.back() != p.edge)) seen.push_back(p.edge);
    }
    return seen.size();
  };
  rpo_kit::Wireframe box;
  ASSERT_TRUE(box.set(corners, faces));
  EXPECT_EQ(box.edges().size(), 12u);
  EXPECT_NEAR(box.radius_m(), std::sqrt(3.0), 1e-12);
  EXPECT_EQ(edges(box, vec3(20, 30, 25)), 9u);
  EXPECT_EQ(edges(box, vec3(20, 0, 0)), 4u);
  for (const double y : {-3.0, 3.0}) {
    for (const double z : {-3.0, 3.0}) corners.push_back(vec3(5, y, z));
  }
  faces.push_back({{8, 10, 11, 9}, 4});
  ASSERT_TRUE(box.set(corners, faces));
  EXPECT_EQ(edges(box, vec3(20, 0, 0)), 0u);
  EXPECT_EQ(edges(box, vec3(-20, 0, 0)), 4u);
  // With the Sun behind the plate the near side is dark, with it behind the eye it is not.
  std::vector<rpo_kit::FacePoint> lit;
  box.lit_from(vec3(3, 0.1, 0.1), vec3(1, 0, 0), 0.3, &lit);
  ASSERT_GT(lit.size(), 10u);
  for (const rpo_kit::FacePoint& point : lit) EXPECT_EQ(point.sunlight, 0);
  box.lit_from(vec3(-20, 0, 0), vec3(-0.8, 0.6, 0), 0.3, &lit);
  for (const rpo_kit::FacePoint& point : lit) {
    if (point.point_B[0] < 0) {
      EXPECT_NEAR(point.sunlight, 0.3 * 0.8, 1e-12);
    }
  }
  faces.push_back({{0, 3, 5, 6}, 4});  // not plane
  EXPECT_FALSE(box.set(corners, faces));
}
