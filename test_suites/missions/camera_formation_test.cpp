// Two cameras at different rates and GNSS at 1 Hz on three spacecraft in one run.
//
// Three spacecraft follow each other, 2 km apart. Each has a star camera towards the zenith (256 x
// 256, every 2 s, quick) and a target camera (512 x 512, every 3 s, with an exposure too short for
// stars, slow to read out) that looks along or against the track at another one; the foremost looks
// at the last, past the one in between. Flight software (flight/camera_navigation.cpp) makes
// attitudes of the stars, GNSS differences of what the others say, and directions of both with the
// target's place in its image. What it says is judged by the truth; where the target must be in the
// image is computed here, from orbit, attitude and mounting, without the simulator's camera.
#include <orrery/fixtures/missions/reference_mission.hpp>
#include <orrery/models/camera/camera.hpp>
#include <orrery/models/orbit/mean_elements.hpp>
#include <orrery/orrery.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "flight/camera_navigation_messages.h"

using namespace orrery;

namespace {

constexpr std::array<const char*, 3> kNames = {"last", "middle", "first"};
constexpr std::array<int, 3> kTargets = {1, 2, 0};
constexpr double kRadius_m = 0.15;  // of each
constexpr Duration kObservation = 40s;

const Mat3 kForward = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};  // R_CB: along x of the body, the track
const Mat3 kBackward = {{0, -1, 0}, {0, 0, 1}, {-1, 0, 0}};

struct Rates {
  Duration period, exposure, read_out, transfer;
  Duration latency() const { return exposure + read_out + transfer; }
};
constexpr Rates kStarRates = {2s, 100ms, 50ms, 150ms};
constexpr Rates kTargetRates = {3s, 400us, 800ms, 1100ms};

// As many as the sky has to V 5.5, at places of this seed.
const std::vector<Star>& sky() {
  static const std::vector<Star> stars = [] {
    RandomStream stream(11);
    std::vector<Star> all;
    for (int k = 0; k < 2800; ++k) {
      const double z = stream.uniform(-1, 1), a = stream.uniform(0, 6.283185307179586);
      const double r = std::sqrt(1 - z * z);
      all.push_back({.number = k + 1,
                     .direction_ECI = unit({r * std::cos(a), r * std::sin(a), z}),
                     .magnitude = 5.5 + 2.0 * std::log10(stream.uniform())});
    }
    return all;
  }();
  return stars;
}

std::string star_file() {
  std::string text;
  for (const Star& star : sky()) {
    const Vec3& d = star.direction_ECI;
    char line[120];
    std::snprintf(line, sizeof line, "%.12f %.12f %.12f %.3f\n", d.x, d.y, d.z, star.magnitude);
    text += line;
  }
  return text;
}

std::string numbers(const Vec3& v) {
  char text[120];
  std::snprintf(text, sizeof text, " %.9g %.9g %.9g", v.x, v.y, v.z);
  return text;
}

const Mat3& mounting(int k) {
  return k == 2 ? kBackward : kForward;
}

CameraOptions star_camera(Duration period, int threads) {
  CameraOptions options;
  options.name = "star_camera";
  options.lens = {.width_px = 256, .height_px = 256, .fx_px = 726, .fy_px = 726};  // 20 deg
  options.period = period;
  options.exposure = kStarRates.exposure;
  options.read_out = kStarRates.read_out;
  options.transfer = kStarRates.transfer;
  options.stars = StarCatalogue(sky());
  options.threads = threads;
  return options;
}

// 15 deg. A sphere of 0.3 m in sunlight at 2 km is of magnitude -4.
CameraOptions target_camera(int k, Duration period, int threads) {
  CameraOptions options;
  options.name = "target_camera";
  options.lens = {.width_px = 512,
                  .height_px = 512,
                  .fx_px = 1944,
                  .fy_px = 1944,
                  .distortion = {.k1 = -0.08, .p1 = 2e-4}};
  options.optics.aperture_m = 0.01;
  options.R_CB = mounting(k);
  options.period = period;
  options.exposure = kTargetRates.exposure;
  options.read_out = kTargetRates.read_out;
  options.transfer = kTargetRates.transfer;
  options.stars = StarCatalogue(sky());
  options.threads = threads;
  for (const char* name : kNames) {
    if (name == kNames[static_cast<std::size_t>(k)]) continue;
    options.targets.push_back({.spacecraft = name, .mesh = Mesh::sphere(kRadius_m, 24)});
  }
  return options;
}

struct Arrival {
  Duration t;  // since the start
  std::uint32_t camera, frame;
  auto operator<=>(const Arrival&) const = default;
};

// What the truth was in the middle of an exposure.
struct Truth {
  Vec3 r_TC_ECI;  // of the target
  Mat3 R_CI;
};

struct Seen {
  std::vector<Arrival> arrivals;
  std::uint32_t fixes = 0, heard = 0;
  std::vector<double> attitude_error_rad, attitude_over_sigma;
  std::vector<double> image_error_px, predicted_error_px, bearing_error_rad, bearing_over_sigma;
  std::map<std::int64_t, Mat3> R_CI;    // of the star camera, by the middle of the exposure
  std::map<std::int64_t, Truth> truth;  // of the target camera, likewise
  int late = 0, misplaced = 0;
};

struct Options {
  std::uint64_t seed = 1;
  int threads = 1;
  bool cameras = true, expose = true;
};

WorldOptions world_options(const Options& options) {
  WorldOptions world;
  world.gravity_degree = 20;
  world.run = RunId{options.seed};
  return world;
}

// Turns the axes of `a` into those of `b`: the vector of the rotation.
Vec3 turn_between(const Mat3& a, const Mat3& b) {
  const Mat3 d = b * transpose(a);
  return 0.5 * Vec3{d.row_y.z - d.row_z.y, d.row_z.x - d.row_x.z, d.row_x.y - d.row_y.x};
}

double rms_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / double(std::max<std::size_t>(1, values.size())));
}
double largest_of(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

class CameraFormation : public World {
 public:
  explicit CameraFormation(const Options& options) : World(world_options(options)) {
    const SimTime epoch = now();
    const QuasiNonsingularElements chief =
        to_quasi_nonsingular(missions::reference_chief_orbit(epoch));
    v_earth_ECI_ = earth_velocity_ECI(epoch);
    for (int k = 0; k < 3; ++k) add(k, chief);
    if (!options.cameras) return;
    for (int k = 0; k < 3; ++k) add_cameras(k, options);
  }

  std::array<Seen, 3> seen;

 private:
  static const unsigned char* data_of(Bytes bytes) {
    return reinterpret_cast<const unsigned char*>(bytes.data());
  }

  void add(int k, const QuasiNonsingularElements& chief) {
    // One after the other along the track, and not in line.
    const double up_m = k == 0 ? 0 : k == 1 ? 40 : -40, aside_m = k == 0 ? 0 : k == 1 ? 80 : -100;
    const RelativeElements roe_m = {
        .da = 0, .dl = 2000.0 * (k - 1), .dex = -up_m, .dey = 0, .dix = 0, .diy = -aside_m};
    const InertialState state =
        to_inertial(mean_to_osculating(deputy_elements(chief, 1 / chief.a_m * roe_m)));
    SpacecraftOptions one;
    one.name = kNames[static_cast<std::size_t>(k)];
    one.initial.r_ECI = state.r_ECI, one.initial.v_ECI = state.v_ECI;
    one.initial.mass_kg = 11;
    one.gnss.period = 1s;
    one.flight.library = "camera_navigation";
    one.flight.files["/data/stars"] = star_file();
    const Mat3& R = mounting(k);
    one.flight.config =
        "id = " + std::to_string(k) +
        "\ntarget = " + std::to_string(kTargets[static_cast<std::size_t>(k)]) +
        "\nR_TS =" + numbers(R.row_x) + numbers(R.row_y) + numbers(R.row_z) +
        "\nearth_velocity_mps =" + numbers(v_earth_ECI_) +
        "\nstar_size = 256\ntarget_size = 512\nelectrons_per_dn = 4\ntarget_radius_m = 0.15\n";
    add_spacecraft(one);
    const FlightHandle kit = flight(one.name);
    kit.on_output("frame", [this, k](SimTime, Bytes bytes) { note_frame(k, data_of(bytes)); });
    kit.on_output("attitude",
                  [this, k](SimTime, Bytes bytes) { note_attitude(k, data_of(bytes)); });
    kit.on_output("bearing", [this, k](SimTime, Bytes bytes) { note_bearing(k, data_of(bytes)); });
  }

  void add_cameras(int k, const Options& options) {
    const std::string name = kNames[static_cast<std::size_t>(k)];
    const SpacecraftHandle craft = spacecraft(name);
    const auto at = static_cast<std::size_t>(k);
    craft.add<Camera>(star_camera(options.expose ? kStarRates.period : 0s, options.threads),
                      [this, at, craft](const CameraFrame& frame) {
                        seen[at].R_CI[to_ns(frame.middle)] = craft.R_BI();
                      });
    craft.add<Camera>(
        target_camera(k, options.expose ? kTargetRates.period : 0s, options.threads),
        [this, k, at, craft](const CameraFrame& frame) {
          const Vec3 r = spacecraft(kNames[static_cast<std::size_t>(kTargets[at])]).truth().r_ECI;
          seen[at].truth[to_ns(frame.middle)] = {r - craft.truth().r_ECI,
                                                 mounting(k) * craft.R_BI()};
        });
  }

  void note_frame(int k, const unsigned char* at) {
    Seen& mine = seen[static_cast<std::size_t>(k)];
    const std::uint32_t camera = orrery_get_u32(at);
    const Rates& rates = camera == CAMERA_NAVIGATION_STAR ? kStarRates : kTargetRates;
    mine.arrivals.push_back({elapsed(), camera, orrery_get_u32(at + 4)});
    const std::int64_t begin_ns = orrery_get_i64(at + 8), received_ns = orrery_get_i64(at + 16);
    mine.late += received_ns - begin_ns != rates.latency().count();
    mine.late += received_ns != to_ns(now());
    mine.fixes = orrery_get_u32(at + 28), mine.heard = orrery_get_u32(at + 32);
  }

  void note_attitude(int k, const unsigned char* at) {
    Seen& mine = seen[static_cast<std::size_t>(k)];
    const auto truth = mine.R_CI.find(orrery_get_i64(at));
    if (truth == mine.R_CI.end()) {
      ++mine.misplaced;
      return;
    }
    double R[9], sigma[3];
    orrery_get_f64s(at + 8, R, 9);
    orrery_get_f64s(at + 80, sigma, 3);
    const Vec3 error =
        turn_between({{R[0], R[1], R[2]}, {R[3], R[4], R[5]}, {R[6], R[7], R[8]}}, truth->second);
    mine.attitude_error_rad.push_back(norm(error));
    for (const double e : {error.x / sigma[0], error.y / sigma[1], error.z / sigma[2]}) {
      mine.attitude_over_sigma.push_back(std::abs(e));
    }
  }

  void note_bearing(int k, const unsigned char* at) {
    Seen& mine = seen[static_cast<std::size_t>(k)];
    rpo_kit_bearing b;
    double more[5];
    ASSERT_TRUE(rpo_kit_get_bearing(at, RPO_KIT_BEARING_BYTES, &b));
    orrery_get_f64s(at + RPO_KIT_BEARING_BYTES, more, 5);
    const auto found = mine.truth.find(b.exposure_ns);
    if (found == mine.truth.end()) {
      ++mine.misplaced;
      return;
    }
    const Truth& truth = found->second;
    const Vec3 r_C = truth.R_CI * truth.r_TC_ECI;
    const double x = r_C.x / r_C.z, y = r_C.y / r_C.z, r2 = x * x + y * y;
    const double k1 = -0.08, p1 = 2e-4;  // as Brown and Conrady have it
    const double u = 255.5 + 1944 * (x * (1 + k1 * r2) + 2 * p1 * x * y);
    const double v = 255.5 + 1944 * (y * (1 + k1 * r2) + p1 * (r2 + 2 * y * y));
    mine.image_error_px.push_back(std::hypot(more[0] - u, more[1] - v));
    mine.predicted_error_px.push_back(std::hypot(more[2] - u, more[3] - v));
    const Vec3 d{b.direction_ECI[0], b.direction_ECI[1], b.direction_ECI[2]};
    mine.bearing_error_rad.push_back(norm(cross(d, unit(truth.r_TC_ECI))));
    mine.bearing_over_sigma.push_back(mine.bearing_error_rad.back() / b.sigma_rad);
  }

  Vec3 v_earth_ECI_;
};

// All images that come until then, in that order.
std::vector<Arrival> expected_arrivals(Duration end) {
  std::vector<Arrival> all;
  const auto add = [&](std::uint32_t camera, const Rates& rates) {
    std::uint32_t frame = 1;
    for (Duration begin = 0s; begin + rates.latency() <= end; begin += rates.period, ++frame) {
      all.push_back({begin + rates.latency(), camera, frame});
    }
  };
  add(CAMERA_NAVIGATION_STAR, kStarRates);
  add(CAMERA_NAVIGATION_TARGET, kTargetRates);
  std::sort(all.begin(), all.end());
  return all;
}

// Star images that come before a target image that was exposed before them.
int overtaking(const std::vector<Arrival>& arrivals) {
  int count = 0;
  Duration newest_star{-1};
  for (const Arrival& a : arrivals) {
    if (a.camera == CAMERA_NAVIGATION_STAR) {
      newest_star = (a.frame - 1) * kStarRates.period;
    } else {
      count += newest_star > (a.frame - 1) * kTargetRates.period;
    }
  }
  return count;
}

}  // namespace

// Required:
//   each image comes once, in the order of exposure + read-out + transfer, and says when it began;
//   centroids     within the disc of the target (its centre of light is not its centre), 0.146 px
//                 at 2 km, and 0.1 px of noise; seen 0.08
//   predicted     from GNSS differences of 2.1 m per axis: 2.0 px at 2 km; 3 px in both, seen 2.7
//   errors over their sigmas   RMS 1; attitudes of 60 numbers each, whose neighbours share stars
TEST(CameraFormationTest, TwoCamerasAndGnssAtTheirOwnRatesOnThreeSpacecraft) {
  CameraFormation world({.seed = 5});
  world.run_for(kObservation);
  const std::vector<Arrival> expected = expected_arrivals(kObservation);
  ASSERT_EQ(expected.size(), 20u + 13u);
  EXPECT_GT(overtaking(expected), 3);
  for (std::size_t k = 0; k < 3; ++k) {
    const char* name = kNames[k];
    SCOPED_TRACE(name);
    const Seen& seen = world.seen[k];
    EXPECT_EQ(seen.arrivals, expected);
    EXPECT_EQ(seen.late, 0);
    EXPECT_EQ(seen.misplaced, 0);
    EXPECT_EQ(seen.fixes, 39u);  // 0 to 38 s, when the last image comes
    // A sixth is lost in blackouts, some are on their way.
    EXPECT_GT(seen.heard, 40u);
    EXPECT_LE(seen.heard, 2 * 39u);
    for (const char* other : kNames) {
      if (other == name) continue;
      EXPECT_EQ(world.crosslink(name, other).from(name).sent(), 41u);  // 0 to 40 s
    }

    EXPECT_EQ(seen.attitude_error_rad.size(), 20u);
    EXPECT_LT(rms_of(seen.attitude_over_sigma), 1.5);
    EXPECT_GT(rms_of(seen.attitude_over_sigma), 0.4);
    EXPECT_LT(largest_of(seen.attitude_over_sigma), 4.5);
    EXPECT_LT(rms_of(seen.attitude_error_rad), 1e-4);
    // Not the first: its exposure began with the stars', so no attitude is before it.
    EXPECT_EQ(seen.image_error_px.size(), 12u);
    EXPECT_LT(largest_of(seen.image_error_px), 0.146 + 0.1);
    EXPECT_LT(rms_of(seen.predicted_error_px), 6);
    EXPECT_LT(largest_of(seen.bearing_over_sigma), 4.5);
    EXPECT_LT(rms_of(seen.bearing_error_rad), 2e-4);

    EXPECT_EQ(world.flight(name).crashes(), 0u);
    EXPECT_EQ(world.flight(name).rejected(), 0u);
    std::printf(
        "%s: attitude %.0f urad, %.2f sigma, worst %.2f; direction %.0f urad, %.2f sigma, worst "
        "%.2f; centroid %.3f px, worst %.3f; predicted within %.2f px; heard %u\n",
        name, 1e6 * rms_of(seen.attitude_error_rad), rms_of(seen.attitude_over_sigma),
        largest_of(seen.attitude_over_sigma), 1e6 * rms_of(seen.bearing_error_rad),
        rms_of(seen.bearing_over_sigma), largest_of(seen.bearing_over_sigma),
        rms_of(seen.image_error_px), largest_of(seen.image_error_px),
        rms_of(seen.predicted_error_px), seen.heard);
  }
}

TEST(CameraFormationTest, RunsAreEqualForAnyNumberOfThreads) {
  const auto fly = [](const Options& options) {
    CameraFormation world(options);
    world.run_for(10s);
    return world.fingerprint();
  };
  const std::string once = fly({.seed = 7});
  EXPECT_EQ(fly({.seed = 7}), once);
  EXPECT_EQ(fly({.seed = 7, .threads = 3}), once);
  EXPECT_NE(fly({.seed = 8}), once);
}

// Cameras that wait for a command: they are switched on, and then cost no event in two hours.
TEST(CameraFormationTest, HoursWithoutExposuresCostNothing) {
  CameraFormation without({.cameras = false}), with({.expose = false});
  without.run_for(1s), with.run_for(1s);
  const std::uint64_t more = with.events() - without.events();
  EXPECT_LE(more, 6u);
  without.run_for(2h), with.run_for(2h);
  EXPECT_EQ(with.events() - without.events(), more);
  EXPECT_GT(without.events(), 3u * 7200u);
  EXPECT_EQ(with.propagation_steps(), without.propagation_steps());
}
