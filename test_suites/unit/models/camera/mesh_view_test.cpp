#include <orrery/models/camera/exposure.hpp>
#include <orrery/models/camera/mesh_view.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "angles.hpp"
#include "opencv_projection.hpp"

namespace orrery {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Camera axes are ECI's: the target stands along z.
MeshPose at(const Vec3& r_TC, const Mat3& R_TI = {}) {
  return {.R_TI = R_TI, .r_TC_ECI = r_TC};
}
Lighting sun_from(const Vec3& direction) {
  return {.to_sun_ECI = unit(direction)};
}

// The cone that touches a sphere, cut by the plane z = 1: with half-angle a about an axis t off the
// boresight an ellipse of area pi sin^2 a cos a (cos^2 t - sin^2 a)^(-3/2), from the determinant of
// the cone's quadratic form. A polyhedron of 2 x 60 meridians inscribed in it lacks about
// (pi/60)^2/3 = 0.1 %.
TEST(MeshViewTest, SilhouetteOfASphereIsTheTangentCones) {
  const PinholeCamera camera({.width_px = 1000, .height_px = 1000, .fx_px = 800, .fy_px = 800});
  const Mesh sphere = Mesh::sphere(1, 60);
  for (const double off_deg : {0.0, 12.0, 22.0}) {
    for (const double distance : {3.0, 12.0, 80.0, 5000.0}) {
      const double t = off_deg * kDegree;
      const Vec3 r = distance * Vec3{std::sin(t) * 0.8, std::sin(t) * 0.6, std::cos(t)};
      const double sine = 1 / distance, c = std::cos(t), s2 = sine * sine;
      const double expected = 800.0 * 800 * pi * s2 * std::sqrt(1 - s2) / std::pow(c * c - s2, 1.5);
      if (distance == 3 && off_deg > 0) continue;  // reaches beyond the image
      const double area = sample_mesh(sphere, camera, at(r), sun_from({1, 0, 0})).area_px2();
      EXPECT_NEAR(area / expected, 1, 0.004) << off_deg << " deg, " << distance << " m";
    }
  }
}

// Far away, the projections of its three visible faces: sum of |cosine| times area, over the square
// of the distance; the perspective of 1.5 m at 800 m is 1e-3 of it at most.
TEST(MeshViewTest, SilhouetteOfABoxIsTheSumOfItsFaces) {
  const PinholeCamera camera({.width_px = 512, .height_px = 512, .fx_px = 80000, .fy_px = 80000});
  const Vec3 size{1.0, 1.5, 0.4};
  const Mesh box = Mesh::box(size);
  for (const Vec3 turn :
       {Vec3{0, 0, 0}, Vec3{0.4, 0.9, -0.3}, Vec3{2.0, -0.5, 1.0}, Vec3{0, 0, 0.5}}) {
    const Mat3 R_TI = rotation_by(turn);
    const Vec3 view = R_TI * Vec3{0, 0, 1};
    const double expected =
        (std::abs(view.x) * size.y * size.z + std::abs(view.y) * size.x * size.z +
         std::abs(view.z) * size.x * size.y) *
        100 * 100;
    const double area = sample_mesh(box, camera, at({0, 0, 800}, R_TI), {}).area_px2();
    EXPECT_NEAR(area / expected, 1, 0.005);
  }
}

// A square plate with corners at known places: its four edges are fitted to the half covered
// pixels, and meet in the corners that OpenCV projects. Bound: 0.05 px; samples are 0.1 px apart.
TEST(MeshViewTest, CornersAreWhereOpenCvProjectsThem) {
  const PinholeCamera camera({.width_px = 320,
                              .height_px = 240,
                              .fx_px = 400,
                              .fy_px = 405,
                              .cx_px = 158.3,
                              .cy_px = 121.1,
                              .distortion = {.k1 = -0.08, .k2 = 0.02, .p1 = 5e-4, .p2 = -4e-4}});
  const Mesh plate = Mesh::box({1, 1, 1e-3});
  for (const double turn : {0.0, 0.2, 0.7}) {
    const Mat3 R_TI = rotation_by({0, 0, turn});
    const Vec3 r{0.12, -0.08, 4.0};
    std::vector<Vec3> corners;
    for (const Vec3 c : {Vec3{-0.5, -0.5, -5e-4}, Vec3{0.5, -0.5, -5e-4}, Vec3{0.5, 0.5, -5e-4},
                         Vec3{-0.5, 0.5, -5e-4}}) {
      corners.push_back(transpose(R_TI) * c + r);
    }
    const std::vector<Pixel> expected = opencv_projection(camera, corners);
    if (expected.empty()) GTEST_SKIP() << "built without OpenCV (libopencv-calib3d-dev)";
    ElectronImage image(320, 240);
    Image<float> covered(320, 240);
    add_samples(image, covered, sample_mesh(plate, camera, at(r, R_TI), sun_from({0, 0, -1})), 1,
                0.5);
    // Each edge: offsets of the half covered points along its normal, from the middle 80 % of it.
    struct Line {
      double nx, ny, d;
    };
    std::vector<Line> lines;
    for (std::size_t k = 0; k < 4; ++k) {
      const Pixel p = expected[k], q = expected[(k + 1) % 4];
      const double ux = q.u - p.u, uy = q.v - p.v, length = std::hypot(ux, uy);
      const double nx = -uy / length, ny = ux / length;  // inwards, as v runs down
      double sum0 = 0, sum1 = 0, sum2 = 0, sum_d = 0, sum_sd = 0;
      for (double s = 0.1 * length; s < 0.9 * length; s += 0.25) {
        // The covered length along the normal, 4 px to either side, by linear interpolation.
        double inside = 0;
        for (int step = 0; step < 160; ++step) {
          const double n = -4 + 0.05 * step;
          const double u = p.u + ux / length * s + nx * (n + 0.025);
          const double v = p.v + uy / length * s + ny * (n + 0.025);
          const int i = int(std::floor(u)), j = int(std::floor(v));
          const double x = u - i, y = v - j;
          inside += 0.05 * ((1 - y) * ((1 - x) * covered.at(i, j) + x * covered.at(i + 1, j)) +
                            y * ((1 - x) * covered.at(i, j + 1) + x * covered.at(i + 1, j + 1)));
        }
        const double d = 4 - inside, along = s / length - 0.5;
        sum0 += 1, sum1 += along, sum2 += along * along, sum_d += d, sum_sd += along * d;
      }
      const double slope = (sum0 * sum_sd - sum1 * sum_d) / (sum0 * sum2 - sum1 * sum1);
      const double offset = (sum_d - slope * sum1) / sum0;
      // Edge points p + s u + (offset + slope (s/length - 1/2)) n: a line turned by slope/length.
      const double tx = ux / length + slope / length * nx, ty = uy / length + slope / length * ny;
      const double x0 = p.u + 0.5 * ux + offset * nx, y0 = p.v + 0.5 * uy + offset * ny;
      lines.push_back({-ty, tx, -ty * x0 + tx * y0});
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const Line &a = lines[(k + 3) % 4], &b = lines[k];
      const double det = a.nx * b.ny - a.ny * b.nx;
      const double u = (a.d * b.ny - b.d * a.ny) / det, v = (a.nx * b.d - b.nx * a.d) / det;
      EXPECT_NEAR(u, expected[k].u, 0.05) << turn;
      EXPECT_NEAR(v, expected[k].v, 0.05) << turn;
    }
  }
}

// 2/3 albedo (R/d)^2 Phi(phase). Flat triangles of 3 deg and the shadow map cost some near the
// terminator.
TEST(MeshViewTest, FluxOfASphereIsLambertsAtAnyPhase) {
  const PinholeCamera camera({.width_px = 512, .height_px = 512, .fx_px = 1e5, .fy_px = 1e5});
  const Mesh sphere = Mesh::sphere(0.5, 60, {.albedo = 0.4});
  for (const double phase_deg : {0.0, 30.0, 60.0, 90.0, 120.0}) {
    const double p = phase_deg * kDegree;
    for (const double distance : {400.0, 4000.0, 90e5}) {
      const auto samples = sample_mesh(sphere, camera, at({0, 0, distance}),
                                       sun_from({std::sin(p), 0, -std::cos(p)}));
      const double expected = lambert_sphere_suns(0.5, 0.4, distance, p, 1);
      EXPECT_NEAR(samples.total_suns() / expected, 1, 0.01) << phase_deg << " deg " << distance;
    }
  }
  EXPECT_NEAR(lambert_phase(0), 1, 1e-15);
  EXPECT_NEAR(lambert_phase(pi / 2), 1 / pi, 1e-15);
  EXPECT_NEAR(lambert_phase(pi), 0, 1e-15);
}

TEST(MeshViewTest, LitSideIsTowardsTheSun) {
  const PinholeCamera camera({.width_px = 256, .height_px = 256});
  const Mesh sphere = Mesh::sphere(0.5, 30);
  const auto samples = sample_mesh(sphere, camera, at({0, 0, 100}), sun_from({1, 0, -1}));
  const double radius_px = 4000 * 0.5 / 100;
  // Centre of light of a Lambert sphere at phase 90 deg and less lies sunwards by up to 3 pi/16 of
  // R.
  EXPECT_GT(samples.photocentre().u, 127.5 + 0.1 * radius_px);
  EXPECT_NEAR(samples.photocentre().v, 127.5, 0.1);
}

// Over a plate of 16 m^2 hangs a black one of 1 m^2, 1 m nearer; the Sun stands at 45 deg. The
// camera looks from far above: it does not see 1 m^2 and sees 1 m^2 in shadow.
TEST(MeshViewTest, OnePartThrowsItsShadowOnAnother) {
  const PinholeCamera camera({.width_px = 512, .height_px = 512, .fx_px = 50000, .fy_px = 50000});
  Mesh plates = Mesh::box({4, 4, 0.01}, {.albedo = 0.5});
  const double whole =
      sample_mesh(plates, camera, at({0, 0, 1000}), sun_from({1, 0, -1})).total_suns();
  EXPECT_NEAR(whole / (16 * 0.5 / pi * std::sqrt(0.5) / 1e6), 1, 0.005);
  plates.add(Mesh::box({1, 1, 0.01}, {.albedo = 0}), {0.4, 0.3, -1.005});
  const double partly =
      sample_mesh(plates, camera, at({0, 0, 1000}), sun_from({1, 0, -1})).total_suns();
  EXPECT_NEAR(partly / whole, 14.0 / 16, 0.006);
}

TEST(MeshViewTest, EarthshineLightsTheNightSide) {
  const PinholeCamera camera({.width_px = 256, .height_px = 256});
  const Mesh plate = Mesh::box({1, 1, 0.01}, {.albedo = 0.5});
  const Lighting far{.sun = 0, .to_earth_ECI = unit({0, 1, -1}), .earth = 0.1};
  const double seen = sample_mesh(plate, camera, at({0, 0, 100}), far).total_suns();
  EXPECT_NEAR(seen / (0.1 * 0.5 / pi * std::sqrt(0.5) / 1e4), 1, 0.005);
}

// Umbra, sunlight and the Earth's light at 500 km: (R/r)^2 2/3 0.3 over the subsolar point.
TEST(LightingTest, KnowsTheShadowAndTheEarth) {
  const Vec3 sun{kAstronomicalUnit_m, 0, 0};
  EXPECT_EQ(lighting_at({-7e6, 0, 0}, sun).sun, 0);
  EXPECT_NEAR(lighting_at({7e6, 0, 0}, sun).sun, 1, 1e-4);
  const double ratio = 6378136.3 / 7e6;
  EXPECT_NEAR(lighting_at({7e6, 0, 0}, sun).earth, 0.2 * ratio * ratio, 2e-5);
  EXPECT_NEAR(lighting_at({-7e6, 0, 0}, sun).earth, 0, 1e-12);
}

TEST(MeshViewTest, ThreadsDoNotShow) {
  const PinholeCamera camera({.width_px = 256, .height_px = 256});
  const Mesh sphere = Mesh::sphere(0.5, 20, {.albedo = 0.3, .specular = 0.2});
  const auto pose = at({0.3, 0.2, 90}, rotation_by({1, 2, 3}));
  const auto one = sample_mesh(sphere, camera, pose, sun_from({1, 1, -1}), 1);
  for (const int threads : {2, 5}) {
    const auto many = sample_mesh(sphere, camera, pose, sun_from({1, 1, -1}), threads);
    EXPECT_EQ(many.suns, one.suns);
    EXPECT_EQ(many.covered, one.covered);
  }
}

TEST(MeshTest, ReadsWhatModellersWrite) {
  const Mesh mesh = Mesh::parse_obj(
      "# a tetrahedron\nmtllib x.mtl\no body\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 2\nvn 0 0 1\n"
      "usemtl gold\nf 1 3 2\nf 1/1/1 2/2/1 4/3/1\nusemtl black\nf -4//1 -1//1 -2//1\nf 2 3 4\n",
      "tetra.obj", {{"gold", {.albedo = 0.6}}});
  EXPECT_EQ(mesh.vertices_B().size(), 4u);
  ASSERT_EQ(mesh.triangles().size(), 4u);
  EXPECT_EQ(mesh.radius_m(), 2);
  EXPECT_EQ(mesh.materials()[std::size_t(mesh.triangles()[0].material)].albedo, 0.6);
  EXPECT_EQ(mesh.materials()[std::size_t(mesh.triangles()[2].material)].albedo, 0.3);
  EXPECT_EQ(mesh.triangles()[2].corners, (std::array<int, 3>{0, 3, 2}));
}

// Signed volume by the divergence theorem: outward normals make it that of the body.
TEST(MeshTest, ReadyShapesAreClosedWithOutwardNormals) {
  const auto volume = [](const Mesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles()) {
      const Vec3& a = mesh.vertices_B()[std::size_t(t.corners[0])];
      const Vec3& b = mesh.vertices_B()[std::size_t(t.corners[1])];
      const Vec3& c = mesh.vertices_B()[std::size_t(t.corners[2])];
      sum += dot(a, cross(b, c)) / 6;
    }
    return sum;
  };
  EXPECT_NEAR(volume(Mesh::box({1, 2, 3})), 6, 1e-12);
  EXPECT_NEAR(volume(Mesh::sphere(2, 100)) / (4.0 / 3 * pi * 8), 1, 1e-3);
}

TEST(MeshTest, SaysWhatIsWrongAndWhere) {
  const auto obj = [](const char* text) { return [text] { Mesh::parse_obj(text, "a.obj"); }; };
  using E = std::invalid_argument;
  EXPECT_THAT(obj("v 0 0\n"), ThrowsMessage<E>(HasSubstr("a.obj, line 1: v with fewer")));
  EXPECT_THAT(obj("v 0 0 0\nf 1 1 2\n"), ThrowsMessage<E>(HasSubstr("line 2")));
  EXPECT_THAT(obj("v 0 0 0\nf 0 1 1\n"), ThrowsMessage<E>(HasSubstr("vertex 0")));
  EXPECT_THAT(obj("v 0 0 0\n"), ThrowsMessage<E>(HasSubstr("no face")));
  EXPECT_THAT(obj("curv 1\n"), ThrowsMessage<E>(HasSubstr("'curv'")));
  EXPECT_THAT([] { Mesh::box({1, 0, 1}); }, ThrowsMessage<E>(HasSubstr("Mesh::box: size")));
  EXPECT_THAT(
      [] {
        Mesh::box({1, 1, 1}, {.albedo = 0.9, .specular = 0.3});
      },
      ThrowsMessage<E>(HasSubstr("together at most 1")));
}

}  // namespace
}  // namespace orrery
