#include "rpo_kit/mission/rpo_kit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "../flight_test_support.hpp"
#include "rpo_kit/rpo_kit_messages.h"

namespace rpo_kit {
namespace {

using namespace flight_support;
using flight_test::kEpoch_ns;
using flight_test::Noise;

// The spacecraft around the package: keeps what it says.
struct Bus : Outputs {
  void out_crosslink(const unsigned char* packet, std::uint32_t bytes) override {
    crosslink.emplace_back(packet, packet + bytes);
  }
  bool out_maneuver(std::int64_t mid_burn_ns, const double dv_ECI[3]) override {
    if (refuse) return false;
    burns.push_back({mid_burn_ns, vec3(dv_ECI[0], dv_ECI[1], dv_ECI[2])});
    return true;
  }
  void out_mode(std::int64_t, std::uint32_t mode) override { modes.push_back(mode); }
  void out_estimate(const RelativeOutput& e) override { estimate = e; }
  void out_target(const unsigned char* message, std::uint32_t bytes) override {
    EXPECT_EQ(rpo_kit_get_target(message, bytes, &target), 1);
  }
  void out_observation(const unsigned char* packet, std::uint32_t bytes) override {
    observations.emplace_back(packet, packet + bytes);
  }
  void out_imaging(const unsigned char* message, std::uint32_t bytes) override {
    EXPECT_EQ(rpo_kit_get_imaging(message, bytes, &imaging), 1);
    ++frames;
  }
  void out_telemetry(const unsigned char* packet, std::uint32_t bytes) override {
    EXPECT_EQ(rpo_kit_get_telemetry(packet, bytes, &telemetry), 1);
  }
  void request_tick(std::int64_t at_ns) override { tick_ns = at_ns; }
  void log(LogLevel level, const char* line) override {
    if (level >= LogLevel::kWarning) complaints.push_back(line);
  }
  struct Wanted {
    std::int64_t t_ns;
    Vec3 dv_ECI;
  };
  std::vector<std::vector<unsigned char>> crosslink, observations;
  std::vector<Wanted> burns;
  std::vector<std::uint32_t> modes;
  RelativeOutput estimate;
  rpo_kit_telemetry telemetry = {};
  rpo_kit_target target = {};
  rpo_kit_imaging imaging = {};
  int frames = 0;
  std::int64_t tick_ns = -1;
  std::vector<std::string> complaints;
  bool refuse = false;
};

Configuration configured(const char* text) {
  Configuration configuration;
  char message[192] = "";
  EXPECT_TRUE(parse_configuration(text, std::strlen(text), &configuration, message, sizeof message))
      << message;
  return configuration;
}

bool give(RpoKit* kit, std::int64_t t_ns, unsigned order) {
  unsigned char message[RPO_KIT_COMMAND_BYTES];
  rpo_kit_put_command(message, order);
  return kit->in_command(t_ns, message, sizeof message);
}

// Two instances of the class, NovAtel bytes and crosslink packets between them, two numerical
// orbits and a thruster with 1 % of error: from 600 m to the inspection orbit.
TEST(RpoKitTest, TwoInstancesMeetOverGnssAndCrosslink) {
  Bus target_bus, chaser_bus;
  RpoKit target(target_bus, configured("role = target\n"), {kEpoch_ns, 0});
  RpoKit chaser(chaser_bus, configured("role = chaser\n"), {kEpoch_ns, 0});
  Noise noise(3);
  const OrbitElements orbit = flight_test::reference_chief();
  StateEci t_state = flight_test::state_of_mean(orbit);
  StateEci c_state =
      flight_test::state_of_mean(apply_relative_elements(orbit, safe_orbit(-900, 120, 1.0)));
  double nearest_m = INFINITY, worst_m = 0.0;
  std::int64_t t_ns = kEpoch_ns;
  const auto run_to = [&](std::int64_t to_ns) {
    t_state = flight_test::propagate_oblate(t_state, seconds(to_ns - t_ns));
    c_state = flight_test::propagate_oblate(c_state, seconds(to_ns - t_ns));
    t_ns = to_ns;
    nearest_m = std::min(nearest_m, norm(t_state.r_ECI - c_state.r_ECI));
  };
  for (int s = 10; s < 100000 && chaser.mode() != Mode::kInspecting; s += 10) {
    const std::int64_t now_ns = kEpoch_ns + s * kSecond_ns;
    while (!chaser_bus.burns.empty() && chaser_bus.burns.front().t_ns <= now_ns) {
      run_to(chaser_bus.burns.front().t_ns);
      c_state.v_ECI = c_state.v_ECI + (1.0 + 0.01 * noise.normal()) * chaser_bus.burns[0].dv_ECI;
      chaser_bus.burns.erase(chaser_bus.burns.begin());
    }
    run_to(now_ns);
    const auto own = flight_test::bestxyz_frame(flight_test::noisy_fix(t_ns, c_state, &noise));
    const auto other = flight_test::bestxyz_frame(flight_test::noisy_fix(t_ns, t_state, &noise));
    EXPECT_TRUE(chaser.in_gnss(t_ns, own.data(), static_cast<std::uint32_t>(own.size())));
    EXPECT_TRUE(target.in_gnss(t_ns, other.data(), static_cast<std::uint32_t>(other.size())));
    for (const auto& packet : target_bus.crosslink) {
      chaser.in_crosslink(t_ns, packet.data(), static_cast<std::uint32_t>(packet.size()));
    }
    target_bus.crosslink.clear();
    EXPECT_TRUE(s != 600 || give(&chaser, t_ns, RPO_KIT_GO));
    if (chaser_bus.tick_ns <= t_ns) chaser.in_tick(t_ns);
    if (s < 3000 || chaser_bus.estimate.t_ns != t_ns) continue;
    const RelativeStateRtn truth = relative_state_rtn(t_state, c_state);
    double squares = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double e = chaser_bus.estimate.r_DC_RTN[k] - truth.r_DC_RTN[k];
      squares += e * e;
    }
    worst_m = std::max(worst_m, std::sqrt(squares));
  }
  EXPECT_EQ(chaser.mode(), Mode::kInspecting);
  EXPECT_EQ(target.mode(), Mode::kStandby);
  EXPECT_GT(nearest_m, 10.0);
  // Noise of 2.1 m and 42 mm/s every 10 s over an hour: some decimetres, more after burns of 2 %.
  EXPECT_LT(worst_m, 5.0);
  EXPECT_TRUE(chaser_bus.complaints.empty());
  EXPECT_GT(chaser_bus.telemetry.used[0], 500u);
  EXPECT_EQ(chaser_bus.telemetry.rejected, 0u);
  EXPECT_EQ(chaser_bus.telemetry.mode, static_cast<std::uint32_t>(RPO_KIT_MODE_INSPECTING));
  RecordProperty("nearest_m", std::to_string(nearest_m));
  RecordProperty("worst_error_m", std::to_string(worst_m));
  RecordProperty("delta_v_mps", std::to_string(chaser_bus.telemetry.delta_v_mps));
  RecordProperty("bytes_of_object", static_cast<int>(sizeof(RpoKit)));
}

TEST(RpoKitTest, UnusableInputsAreRejectedAndCounted) {
  Bus bus;
  RpoKit chaser(bus, configured("role = chaser\n"), {kEpoch_ns, 0});
  const unsigned char garbage[64] = {1, 2, 3};
  EXPECT_FALSE(chaser.in_crosslink(kEpoch_ns, garbage, sizeof garbage));
  EXPECT_FALSE(chaser.in_command(kEpoch_ns, garbage, RPO_KIT_COMMAND_BYTES));
  EXPECT_FALSE(chaser.in_bearing({kEpoch_ns, vec3(0, 0, 2), 1e-4}));
  EXPECT_FALSE(chaser.in_bearing({kEpoch_ns, vec3(0, 0, 1), 0.0}));
  EXPECT_FALSE(chaser.in_pose({kEpoch_ns, vec3(0, 0, NAN), identity<3>()}));
  EXPECT_FALSE(chaser.in_bearing(garbage, RPO_KIT_BEARING_BYTES - 1));
  EXPECT_FALSE(chaser.in_keypoints(garbage, sizeof garbage));
  rpo_kit_keypoints keypoints = {};
  unsigned char message[RPO_KIT_KEYPOINTS_BYTES];
  const auto given = [&] {
    const std::uint32_t bytes = rpo_kit_put_keypoints(message, &keypoints);
    return chaser.in_keypoints(message, bytes);
  };
  EXPECT_FALSE(given());  // a quaternion of no length
  keypoints.q_CI[0] = 1;
  keypoints.count = 1;
  EXPECT_FALSE(given());  // a keypoint without noise
  keypoints.seen[0].sigma_px = 1;
  EXPECT_TRUE(given());
  EXPECT_FALSE(chaser.in_keypoints(message, RPO_KIT_KEYPOINTS_HEAD_BYTES));
  chaser.in_tick(kEpoch_ns);
  EXPECT_EQ(bus.telemetry.rejected, 10u);
  Bus quiet;
  RpoKit target(quiet, configured("role = target\n"), {kEpoch_ns, 0});
  EXPECT_FALSE(give(&target, kEpoch_ns, RPO_KIT_GO));
  EXPECT_EQ(quiet.tick_ns, -1);
}

// What the observer saw, and its own place at that time, four seconds and 30 km after its last fix:
// within four sigma of the fix, the velocity's noise over 4 s in it.
TEST(RpoKitTest, ObserverTellsWhereItSawTheTargetAndFromWhere) {
  Bus bus;
  RpoKit observer(bus, configured("role = observer\n"), {kEpoch_ns, 0});
  const std::int64_t exposure_ns = kEpoch_ns + 4 * kSecond_ns;
  EXPECT_FALSE(observer.in_bearing({exposure_ns, vec3(0.6, 0, 0.8), 1e-4}));  // no fix
  const StateEci state = flight_test::state_of_mean(flight_test::reference_chief());
  Noise noise(8);
  const auto log = flight_test::bestxyz_frame(flight_test::noisy_fix(kEpoch_ns, state, &noise));
  EXPECT_TRUE(observer.in_gnss(kEpoch_ns, log.data(), static_cast<std::uint32_t>(log.size())));
  EXPECT_TRUE(observer.in_bearing({exposure_ns, vec3(0.6, 0, 0.8), 1e-4}));
  EXPECT_FALSE(observer.in_bearing({kEpoch_ns + 7 * kSecond_ns, vec3(0.6, 0, 0.8), 1e-4}));
  EXPECT_FALSE(give(&observer, kEpoch_ns, RPO_KIT_GO));
  EXPECT_TRUE(bus.crosslink.empty());
  EXPECT_EQ(bus.tick_ns, -1);
  ASSERT_EQ(bus.observations.size(), 1u);
  rpo_kit_observation o;
  ASSERT_EQ(rpo_kit_get_observation(bus.observations[0].data(), RPO_KIT_OBSERVATION_BYTES, &o), 1);
  EXPECT_EQ(o.exposure_ns, exposure_ns);
  EXPECT_EQ(o.direction_ECI[0], 0.6);
  EXPECT_EQ(o.direction_ECI[2], 0.8);
  EXPECT_EQ(o.sigma_rad, 1e-4);
  const Vec3 then = flight_test::propagate_oblate(state, 4.0).r_ECI;
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(o.r_ECI[k], then[k], 6.1) << k;
  for (int k : {0, 3, 5}) EXPECT_NEAR(o.covariance_ECI[k], 1.5 * 1.5 + 0.12 * 0.12, 1e-6) << k;
  for (int k : {1, 2, 4}) EXPECT_EQ(o.covariance_ECI[k], 0.0) << k;
}

TEST(RpoKitTest, ObservationsAreTakenIfConfiguredAndSound) {
  const StateEci state = flight_test::state_of_mean(flight_test::reference_chief());
  const Vec3& r = state.r_ECI;
  const rpo_kit_observation good{
      kEpoch_ns, {r[0] + 3e3, r[1], r[2]}, {2, 0, 0, 2, 0, 2}, {0.6, 0, 0.8}, 1e-4};
  unsigned char packet[RPO_KIT_OBSERVATION_BYTES];
  const auto given = [&](RpoKit* kit, const rpo_kit_observation& o) {
    rpo_kit_put_observation(packet, &o);
    return kit->in_observation(kEpoch_ns + 3 * kSecond_ns, packet, sizeof packet);
  };
  for (const char* text : {"role = chaser\n", "role = target\n", "role = observer\n"}) {
    Bus bus;
    RpoKit kit(bus, configured(text), {kEpoch_ns, 0});
    EXPECT_FALSE(given(&kit, good)) << text;
  }
  Bus bus;
  RpoKit chaser(bus, configured("role = chaser\nsecond_observer = 1\n"), {kEpoch_ns, 0});
  EXPECT_TRUE(given(&chaser, good));  // and left out: it does not know where it is itself
  Noise noise(8);
  const auto log = flight_test::bestxyz_frame(flight_test::noisy_fix(
      kEpoch_ns - 60 * kSecond_ns, flight_test::propagate_oblate(state, -60.0), &noise));
  EXPECT_TRUE(chaser.in_gnss(kEpoch_ns, log.data(), static_cast<std::uint32_t>(log.size())));
  chaser.in_tick(kEpoch_ns);
  EXPECT_TRUE(given(&chaser, good));
  std::vector<rpo_kit_observation> bad(9, good);
  bad[0].exposure_ns += 10 * kSecond_ns;
  bad[1].r_ECI[1] += 2e6;
  bad[2].r_ECI[2] = NAN;
  bad[3].covariance_ECI[3] = -1;
  bad[4].covariance_ECI[1] = 3;
  bad[5].covariance_ECI[5] = INFINITY;
  bad[6].direction_ECI[1] = 0.1;
  bad[7].sigma_rad = 0;
  bad[8].sigma_rad = NAN;
  for (std::size_t k = 0; k < bad.size(); ++k) EXPECT_FALSE(given(&chaser, bad[k])) << k;
  rpo_kit_put_observation(packet, &good);
  EXPECT_FALSE(chaser.in_observation(kEpoch_ns, packet, sizeof packet - 1));
  for (std::size_t k = 0; k < sizeof packet; ++k) {
    packet[k] ^= 0x10;
    EXPECT_FALSE(chaser.in_observation(kEpoch_ns, packet, sizeof packet)) << k;
    packet[k] ^= 0x10;
  }
  EXPECT_TRUE(chaser.in_observation(kEpoch_ns, packet, sizeof packet));
  EXPECT_EQ(chaser.navigation().dropped(), 1);  // of that time there is one
}

// What a camera of 64 x 64 px sends: a band of one frame, all of its pixels alike.
std::vector<unsigned char> band(std::uint32_t frame, unsigned first_row, unsigned rows) {
  orrery_image image = {};
  image.frame = frame;
  image.width = image.height = 64;
  image.first_row = first_row;
  image.rows = rows;
  image.bits = 12;
  image.exposure_begin_ns = kEpoch_ns + frame * kSecond_ns;
  image.exposure_s = 0.2;
  image.row_period_s = 1e-3;
  image.gain = 4.0;
  for (double& f : image.fx_fy_cx_cy) f = 30.0;
  std::vector<unsigned char> message(ORRERY_IMAGE_HEADER_BYTES + 2 * 64 * rows,
                                     static_cast<unsigned char>(frame));
  orrery_put_image_header(message.data(), &image);
  return message;
}

TEST(RpoKitTest, FramesComeWholeOrInBands) {
  const std::string path = testing::TempDir() + "rpo_kit_test_stars.txt";
  std::FILE* file = std::fopen(path.c_str(), "w");
  std::fputs("0 0 1\n10 0 1\n0 10 1\n10 10 1\n", file);
  std::fclose(file);
  const std::string text =
      "role = chaser\nimage_width_px = 64\nimage_height_px = 64\n"
      "camera_f_px = 30\nstar_catalogue = " +
      path + "\n";
  Bus bus;
  RpoKit chaser(bus, configured(text.c_str()), {kEpoch_ns, 0});
  std::remove(path.c_str());
  EXPECT_TRUE(bus.complaints.empty());
  const auto give_band = [&](const std::vector<unsigned char>& message) {
    return chaser.in_image(message.data(), static_cast<std::uint32_t>(message.size()));
  };
  EXPECT_TRUE(give_band(band(1, 0, 64)));
  EXPECT_EQ(bus.frames, 0);  // it does not know where it is
  Noise noise(5);
  const StateEci state = flight_test::state_of_mean(flight_test::reference_chief());
  const auto own = flight_test::bestxyz_frame(flight_test::noisy_fix(kEpoch_ns, state, &noise));
  ASSERT_TRUE(chaser.in_gnss(kEpoch_ns, own.data(), static_cast<std::uint32_t>(own.size())));
  chaser.in_tick(kEpoch_ns + 40 * kSecond_ns);
  EXPECT_TRUE(give_band(band(2, 0, 64)));
  EXPECT_EQ(bus.frames, 1);
  // Middle of the exposure: half of 0.2 s and of 63 rows of 1 ms.
  EXPECT_EQ(bus.imaging.exposure_ns, kEpoch_ns + 2 * kSecond_ns + 131500000);
  EXPECT_EQ(bus.imaging.found, static_cast<std::uint32_t>(RPO_KIT_FOUND_LOST));
  EXPECT_TRUE(give_band(band(3, 0, 40)));
  EXPECT_TRUE(give_band(band(3, 40, 20)));
  EXPECT_EQ(bus.frames, 1);
  EXPECT_TRUE(give_band(band(3, 60, 4)));
  EXPECT_EQ(bus.frames, 2);
  // The pixels of the frame before, in the same bands.
  EXPECT_TRUE(give_band(band(3, 0, 40)));
  EXPECT_TRUE(give_band(band(3, 40, 20)));
  EXPECT_FALSE(give_band(band(3, 60, 4)));
  EXPECT_EQ(bus.frames, 2);
  // A band that is missing, one of another frame, one more, none, a wrong size, a wrong length.
  EXPECT_TRUE(give_band(band(4, 0, 20)));
  EXPECT_FALSE(give_band(band(4, 40, 24)));
  EXPECT_FALSE(give_band(band(5, 20, 44)));
  EXPECT_FALSE(give_band(band(3, 60, 4)));
  EXPECT_FALSE(give_band(band(6, 0, 0)));
  std::vector<unsigned char> message = band(6, 0, 64);
  message.pop_back();
  EXPECT_FALSE(give_band(message));
  message = band(6, 0, 32);
  orrery_put_u16(message.data() + 4, 32);
  orrery_put_u16(message.data() + 10, 64);
  EXPECT_FALSE(give_band(message));
  message = band(6, 0, 64);
  orrery_put_f64(message.data() + 56, std::nan(""));
  EXPECT_FALSE(give_band(message));
  EXPECT_EQ(bus.frames, 2);
  chaser.in_tick(kEpoch_ns + 100 * kSecond_ns);
  EXPECT_EQ(bus.telemetry.rejected, 8u);

  Bus blind;
  RpoKit other(blind, configured("role = chaser\n"), {kEpoch_ns, 0});
  const std::vector<unsigned char> whole = band(1, 0, 64);
  EXPECT_FALSE(other.in_image(whole.data(), static_cast<std::uint32_t>(whole.size())));
}

// A tetrahedron of 2 m.
const char* const kTetrahedron =
    "role = chaser\nview_width_px = 64\nview_height_px = 64\nkeypoint = 1 1 1\nkeypoint = 1 -1 -1\n"
    "keypoint = -1 1 -1\nkeypoint = -1 -1 1\nface = 0 1 2\nface = 0 3 1\nalbedo = 0.5\n"
    "face = 0 2 3\nface = 1 3 2\n";

TEST(RpoKitTest, ViewsThatAreDamagedAreRejected) {
  Bus bus;
  RpoKit chaser(bus, configured(kTetrahedron), {kEpoch_ns, 0});
  std::vector<unsigned char> image = band(1, 0, 64);
  const auto give_view = [&](double w, double sigma_rad) {
    std::vector<unsigned char> message(RPO_KIT_VIEW_HEAD_BYTES);
    const double q_CI[4] = {w, 0, 0, 0};
    rpo_kit_put_view_head(message.data(), q_CI, sigma_rad);
    message.insert(message.end(), image.begin(), image.end());
    return chaser.in_view(message.data(), static_cast<std::uint32_t>(message.size()));
  };
  EXPECT_TRUE(give_view(1, 1e-5));     // it does not know where it is
  EXPECT_FALSE(give_view(0.9, 1e-5));  // no rotation
  EXPECT_FALSE(give_view(1, -1));
  EXPECT_FALSE(give_view(1, std::nan("")));
  image.pop_back();
  EXPECT_FALSE(give_view(1, 1e-5));
  image = band(1, 0, 32);
  EXPECT_FALSE(give_view(1, 1e-5));  // half of it
  image = band(1, 0, 64);
  orrery_put_f64(image.data() + 48, std::nan(""));
  EXPECT_FALSE(give_view(1, 1e-5));
  image.clear();
  EXPECT_FALSE(give_view(1, 1e-5));
  EXPECT_FALSE(chaser.in_view(nullptr, 0));
  // Where it knows its orbit, an image of nothing gives nothing.
  Noise noise(5);
  const StateEci state = flight_test::state_of_mean(flight_test::reference_chief());
  const auto own = flight_test::bestxyz_frame(flight_test::noisy_fix(kEpoch_ns, state, &noise));
  ASSERT_TRUE(chaser.in_gnss(kEpoch_ns, own.data(), static_cast<std::uint32_t>(own.size())));
  image = band(2, 0, 64);
  EXPECT_TRUE(give_view(1, 1e-5));
  EXPECT_FALSE(chaser.inspection().tracking());
  Bus blind;
  RpoKit other(blind, configured("role = chaser\n"), {kEpoch_ns, 0});
  EXPECT_FALSE(other.in_view(image.data(), static_cast<std::uint32_t>(image.size())));
}

TEST(RpoKitConfigurationTest, WrongTextIsNamed) {
  const auto complaint = [](const char* text) {
    Configuration configuration;
    char message[192] = "";
    EXPECT_FALSE(
        parse_configuration(text, std::strlen(text), &configuration, message, sizeof message));
    return std::string(message);
  };
  EXPECT_EQ(complaint("role = chaser\nkeep_out = 5\n"),
            "configuration line 2: 'keep_out' is no key of this package");
  EXPECT_NE(complaint("star_catalogue = /stars\n").find("needs image_width_px"), std::string::npos);
  EXPECT_NE(complaint("star_catalogue =\n").find("is no path"), std::string::npos);
  EXPECT_NE(complaint("image_width_px = 64.5\n").find("is no integer"), std::string::npos);
  EXPECT_EQ(complaint("role = chief\n"),
            "configuration line 1: 'role' is not target, chaser or observer");
  EXPECT_NE(complaint("second_observer = 0.5\n").find("is no integer"), std::string::npos);
  EXPECT_NE(complaint("range_known = 2\n").find("[0.001, 1]"), std::string::npos);
  EXPECT_FALSE(configured("role = chaser\n").second_observer);
  EXPECT_NE(complaint("lost_s = 5\n").find("[60, 1e+06]"), std::string::npos);
  EXPECT_NE(complaint("waypoint = -100 20 3\n").find("lacks a number"), std::string::npos);
  EXPECT_NE(complaint("waypoint = -100 0 3 0\n").find("radius_m > 0"), std::string::npos);
  EXPECT_NE(complaint("keypoint = 1 2 3 4\n").find("more numbers"), std::string::npos);
  EXPECT_NE(complaint("face = 0 1\n").find("needs three corners"), std::string::npos);
  EXPECT_NE(complaint("face = 0 1 x\n").find("no number"), std::string::npos);
  EXPECT_NE(complaint("face = 0 1 2 3 4 5 6 7 8\n").find("more corners"), std::string::npos);
  EXPECT_NE(complaint("albedo = 0.5\n").find("behind a face"), std::string::npos);
  EXPECT_NE(complaint("view_width_px = 64\n").find("go together"), std::string::npos);
  EXPECT_NE(complaint("view_width_px = 64\nview_height_px = 64\n").find("needs faces"),
            std::string::npos);
  const Configuration seen = configured(kTetrahedron);
  EXPECT_EQ(seen.inspection.face_count, 4);
  EXPECT_EQ(seen.inspection.faces[1].corners[1], 3);
  EXPECT_EQ(seen.inspection.faces[1].albedo, 0.5);
  EXPECT_EQ(seen.view_height, 64);
  const Configuration own = configured(
      "waypoint = -100 20 3 1\nwaypoint = 0 15 2 0\nkeypoint = 0.1 -0.2 0.3\ncamera_f_px = 2000\n");
  EXPECT_EQ(own.approach.plan.count, 2);
  EXPECT_EQ(own.approach.plan.waypoints[1].radius_m, 15.0);
  EXPECT_EQ(own.inspection.points, 1);
  EXPECT_EQ(own.inspection.points_B[0][1], -0.2);
  EXPECT_EQ(own.inspection.camera.fy, 2000.0);
  EXPECT_EQ(configured("").approach.plan.count, 7);
  EXPECT_EQ(configured("keep_out_m = 12\n").approach.transfer.keep_out_m, 12.0);
}

}  // namespace
}  // namespace rpo_kit
