#include <orrery/models/camera/camera.hpp>
#include <orrery/models/camera/png.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "../support/fake_device_context.hpp"
#include "orrery_messages.h"

namespace orrery {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const SimTime kStart = gps_midnight(2025, 3, 20);

struct Received {
  orrery_image header{};
  std::vector<unsigned> pixels;
  unsigned at(int u, int v) const { return pixels[std::size_t(v) * header.width + std::size_t(u)]; }
};

Received parsed(const ByteBuffer& bytes) {
  Received out;
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  EXPECT_EQ(orrery_get_image_header(data, std::uint32_t(bytes.size()), &out.header), 1);
  for (std::size_t k = 0; k < out.header.width * out.header.rows; ++k) {
    out.pixels.push_back(orrery_get_u16(data + ORRERY_IMAGE_HEADER_BYTES + 2 * k));
  }
  return out;
}

// 64 x 48 px, one bright star on the boresight, no noise: what a frame has in it is known.
CameraOptions small_camera() {
  CameraOptions options;
  options.lens = {.width_px = 64, .height_px = 48, .fx_px = 500, .fy_px = 500};
  options.detector = {.shot_noise = false,
                      .read_noise_electrons = 0,
                      .dark_electrons_ps = 0,
                      .response_nonuniformity = 0,
                      .hot_pixels_per_million = 0};
  options.earth = options.sun_and_moon = false;
  options.stars = StarCatalogue({{.number = 5, .direction_ECI = {0, 0, 1}, .magnitude = 3}});
  return options;
}

FakeDeviceContext context() {
  FakeDeviceContext io(kStart);
  io.truth_at = [](SimTime t) { return OrbitState{.t = t, .r_ECI = {7e6, 0, 0}}; };
  io.surroundings_at = [](SimTime) {
    return Surroundings{.r_sun_ECI = {0, 1.496e11, 0}, .r_moon_ECI = {0, 0, -3.8e8}};
  };
  return io;
}

unsigned brightest(const Received& image) {
  return *std::max_element(image.pixels.begin(), image.pixels.end());
}

TEST(CameraTest, ImageComesExposureReadOutAndTransferLaterWithItsTimeAndParameters) {
  CameraOptions options = small_camera();
  options.period = 4s, options.exposure = 200ms, options.read_out = 300ms, options.transfer = 1s;
  options.lens.distortion = {.k1 = -0.01, .p2 = 1e-4};
  Camera camera(options);
  FakeDeviceContext io = context();
  io.clock_offset = 5ms;
  camera.start(io);
  io.run_for(10s);
  ASSERT_EQ(io.to_flight_log.size(), 3u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(io.to_flight_log[std::size_t(k)].t, kStart + 4s * k + 1500ms);
    const Received image = parsed(io.to_flight_log[std::size_t(k)].bytes);
    EXPECT_EQ(image.header.frame, std::uint32_t(k + 1));
    EXPECT_EQ(image.header.exposure_begin_ns, to_ns(kStart + 4s * k + 5ms));
    EXPECT_EQ(image.header.exposure_s, 0.2);
    EXPECT_EQ(image.header.row_period_s, 0);
    EXPECT_EQ(image.header.width, 64u);
    EXPECT_EQ(image.header.rows, 48u);
    EXPECT_EQ(image.header.bits, 12u);
    EXPECT_EQ(image.header.gain, 4);
    EXPECT_EQ(image.header.offset, 64);
    EXPECT_EQ(image.header.fx_fy_cx_cy[2], 31.5);
    EXPECT_EQ(image.header.k1_k2_p1_p2_k3[0], -0.01);
    EXPECT_EQ(image.header.k1_k2_p1_p2_k3[3], 1e-4);
    // V 3 over 0.2 s: 1.9e10 x 3.1416e-4 m^2 x 10^-1.2 x 0.2 = 75,324 electrons; the middle four
    // pixels have erf(1/(0.8 sqrt 2))^2 = 0.6220 of them; 4 electrons to the DN. Aberration moves
    // the star by 0.05 px: second order.
    const unsigned four = image.at(31, 23) + image.at(32, 23) + image.at(31, 24) + image.at(32, 24);
    EXPECT_NEAR(four - 4 * 64.0, 11714, 0.005 * 11714);
    EXPECT_EQ(image.at(5, 5), 64u);
  }
}

TEST(CameraTest, SeesAlongItsMountingInTheBody) {
  CameraOptions options = small_camera();
  options.R_CB = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};  // boresight along x of the body
  int stars = 0;
  Camera camera(options, [&stars](const CameraFrame& frame) { stars += int(frame.stars.size()); });
  FakeDeviceContext io = context();
  camera.start(io);
  io.run_for(1s);
  EXPECT_EQ(stars, 0);
  io.attitude = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};  // x of the body towards the star
  io.run_for(10s);
  EXPECT_EQ(stars, 1);
}

TEST(CameraTest, BandsOfRowsMakeUpTheImage) {
  CameraOptions options = small_camera();
  Camera whole(options);
  FakeDeviceContext io = context();
  whole.start(io);
  io.run_for(1s);
  options.rows_per_message = 20;
  Camera banded(options);
  FakeDeviceContext io2 = context();
  banded.start(io2);
  io2.run_for(1s);
  ASSERT_EQ(io2.to_flight_log.size(), 3u);
  std::vector<unsigned> pixels;
  for (std::size_t k = 0; k < 3; ++k) {
    const Received band = parsed(io2.to_flight_log[k].bytes);
    EXPECT_EQ(band.header.first_row, 20 * k);
    EXPECT_EQ(band.header.rows, k == 2 ? 8u : 20u);
    pixels.insert(pixels.end(), band.pixels.begin(), band.pixels.end());
  }
  EXPECT_EQ(pixels, parsed(io.to_flight_log.at(0).bytes).pixels);
}

ByteBuffer expose(std::int64_t begin_ns, double exposure_s) {
  ByteBuffer bytes(ORRERY_EXPOSE_BYTES);
  orrery_put_expose(reinterpret_cast<unsigned char*>(bytes.data()), begin_ns, exposure_s);
  return bytes;
}

TEST(CameraTest, ExposesOnCommandAndCostsNothingWithout) {
  CameraOptions options = small_camera();
  options.period = 0s;
  Camera camera(options);
  FakeDeviceContext io = context();
  camera.start(io);
  io.run_for(24h);
  EXPECT_EQ(camera.exposures(), 0u);
  EXPECT_EQ(io.random("frames").draws(), 0u);
  camera.from_flight(io, expose(to_ns(io.now() + 3s), 0.4));
  io.run_for(10s);
  ASSERT_EQ(io.to_flight_log.size(), 1u);
  EXPECT_EQ(io.to_flight_log[0].t, kStart + 24h + 3s + 400ms + 300ms);
  EXPECT_EQ(parsed(io.to_flight_log[0].bytes).header.exposure_s, 0.4);
  camera.from_flight(io, expose(to_ns(io.now()), 0));
  io.run_for(1s);
  EXPECT_EQ(parsed(io.to_flight_log.at(1).bytes).header.exposure_s, 0.1);
  EXPECT_EQ(camera.rejected(), 0u);
}

TEST(CameraTest, RejectsWhatItCannotDoAndSaysWhy) {
  CameraOptions options = small_camera();
  options.period = 0s;
  Camera camera(options);
  FakeDeviceContext io = context();
  camera.start(io);
  const std::int64_t now = to_ns(io.now());
  camera.from_flight(io, expose(now - 1, 0.1));
  camera.from_flight(io, expose(now, 1e9));
  camera.from_flight(io, expose(now, std::nan("")));
  camera.from_flight(io, expose(INT64_MIN, 0.1));
  camera.from_flight(io, expose(INT64_MAX, 0.1));
  camera.from_flight(io, ByteBuffer(7));
  EXPECT_EQ(camera.rejected(), 6u);
  camera.from_flight(io, expose(now, 2));
  camera.from_flight(io, expose(now + 1'000'000'000, 0.1));  // while the other is open
  io.run_for(10s);
  EXPECT_EQ(camera.rejected(), 7u);
  EXPECT_EQ(io.to_flight_log.size(), 1u);
  EXPECT_EQ(io.texts.size(), 7u);
  EXPECT_THAT(io.texts[1].text, HasSubstr("1e+09 s; accepted: 1e-6 to 100"));
}

// One fault at a time, in the second of three frames.
class CameraFaultTest : public ::testing::Test {
 protected:
  std::vector<Received> fly(const char* fault, double value,
                            CameraOptions options = small_camera()) {
    Camera camera(options, [this](const CameraFrame& frame) { frames_.push_back(frame); });
    io_.clock_offset = 0ns;
    camera.start(io_);
    io_.run_for(5s);
    io_.faults[fault] = value;
    io_.attitude = rotation_by({0.004, 0, 0});  // the scene has changed by 2 px
    io_.run_for(10s);
    io_.faults.clear();
    io_.run_for(10s);
    std::vector<Received> images;
    for (const auto& sent : io_.to_flight_log) images.push_back(parsed(sent.bytes));
    return images;
  }
  FakeDeviceContext io_ = context();
  std::vector<CameraFrame> frames_;
};

TEST_F(CameraFaultTest, LostFrameLeavesAGapInTheNumbers) {
  const auto images = fly("lost", 1);
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(images[1].header.frame, 3u);
}

TEST_F(CameraFaultTest, FrozenFrameHasOldPixelsAndANewHeader) {
  const auto images = fly("frozen", 1);
  ASSERT_EQ(images.size(), 3u);
  EXPECT_EQ(images[1].pixels, images[0].pixels);
  EXPECT_EQ(images[1].header.exposure_begin_ns,
            images[0].header.exposure_begin_ns + 10'000'000'000);
  EXPECT_NE(images[2].pixels, images[0].pixels);
}

TEST_F(CameraFaultTest, LateFrameKeepsItsTimeStamp) {
  const auto images = fly("late_s", 2.5);
  EXPECT_EQ(io_.to_flight_log.at(1).t, kStart + 10s + 400ms + 2500ms);
  EXPECT_EQ(images.at(1).header.exposure_begin_ns, to_ns(kStart + 10s));
}

TEST_F(CameraFaultTest, TimeStampIsWrong) {
  const auto images = fly("time_offset_s", -0.75);
  EXPECT_EQ(io_.to_flight_log.at(1).t, kStart + 10s + 400ms);
  EXPECT_EQ(images.at(1).header.exposure_begin_ns, to_ns(kStart + 10s - 750ms));
}

TEST_F(CameraFaultTest, TornFrameIsOfTwo) {
  const auto images = fly("torn_row", 24);
  const auto half = std::ptrdiff_t(24 * 64);
  ASSERT_EQ(images.size(), 3u);
  EXPECT_TRUE(std::equal(images[1].pixels.begin() + half, images[1].pixels.end(),
                         images[0].pixels.begin() + half));
  EXPECT_TRUE(std::equal(images[1].pixels.begin(), images[1].pixels.begin() + half,
                         images[2].pixels.begin()));
  EXPECT_NE(images[1].pixels, images[0].pixels);
}

TEST_F(CameraFaultTest, BlindedFrameIsFullOfLight) {
  const auto images = fly("blinded", 1e7);
  EXPECT_EQ(*std::min_element(images.at(1).pixels.begin(), images.at(1).pixels.end()),
            64u + 15000u / 4);
  EXPECT_EQ(images.at(2).at(3, 3), 64u);
}

TEST_F(CameraFaultTest, WrongExposureIsNotSaid) {
  const auto images = fly("exposure_factor", 0.25);
  EXPECT_EQ(images.at(1).header.exposure_s, 0.1);
  EXPECT_EQ(frames_.at(1).exposure_s, 0.025);
  EXPECT_NEAR((brightest(images[1]) - 64.0) / (brightest(images[2]) - 64.0), 0.25, 0.01);
}

TEST_F(CameraFaultTest, ContaminationTakesItsPartOfTheLight) {
  const auto images = fly("contamination", 0.4);
  EXPECT_NEAR((brightest(images.at(1)) - 64.0) / (brightest(images.at(2)) - 64.0), 0.6, 0.01);
}

// 0.1 deg about y are 500 tan(0.1 deg) = 0.873 px along u.
TEST_F(CameraFaultTest, MisalignmentMovesTheStars) {
  fly("misalignment_y_deg", 0.1);
  ASSERT_EQ(frames_.size(), 3u);
  EXPECT_NEAR(std::abs(frames_[1].stars.at(0).at.u - frames_[2].stars.at(0).at.u), 0.873, 0.002);
  EXPECT_NEAR(frames_[1].stars.at(0).at.v, frames_[2].stars.at(0).at.v, 1e-3);
}

TEST_F(CameraFaultTest, BurstOfHotPixelsStays) {
  CameraOptions options = small_camera();
  options.detector.hot_pixel_electrons_ps = 20000;
  const auto images = fly("hot_pixels", 30, options);
  const auto hot = [](const Received& image) {
    return std::count_if(image.pixels.begin(), image.pixels.end(),
                         [](unsigned p) { return p > 100; });
  };
  EXPECT_GE(hot(images.at(1)), hot(images.at(0)) + 20);
  EXPECT_EQ(hot(images.at(2)), hot(images.at(1)));
}

TEST_F(CameraFaultTest, RadiationEventBringsTracks) {
  const auto images = fly("cosmic_rays_ps", 500);
  const auto lit = [](const Received& image) {
    return std::count_if(image.pixels.begin(), image.pixels.end(),
                         [](unsigned p) { return p > 64; });
  };
  EXPECT_GT(lit(images.at(1)), lit(images.at(0)) + 50);
  EXPECT_LT(std::abs(lit(images.at(2)) - lit(images.at(0))), 30);
}

TEST(CameraTest, RecordsTheTargetAndItsPictures) {
  CameraOptions options = small_camera();
  options.targets = {{.spacecraft = "target"}};
  options.record_period = 15s;
  options.period = 5s;
  Camera camera(options);
  FakeDeviceContext io = context();
  io.others["target"] = {.orbit = {.r_ECI = {7e6 + 1, 0, 1000}}};
  camera.start(io);
  io.run_for(31s);
  EXPECT_EQ(io.files.size(), 3u);
  EXPECT_EQ(io.pictures.size(), 3u);
  EXPECT_EQ(io.pictures.at(1).text, "frame 4");
  const ByteBuffer& png = io.files.at("000004.png");
  EXPECT_EQ(png.at(1), std::byte{'P'});
  int seen = 0;
  for (const auto& sample : io.samples) {
    if (sample.channel != "target_u_px") continue;
    ++seen;
    EXPECT_NEAR(sample.value, 31.5 + 0.5, 1e-9);  // 1 m at 1000 m of 500 px
  }
  EXPECT_EQ(seen, 7);
}

TEST(CameraTest, SaysWhatItRefuses) {
  const auto with = [](auto change) {
    return [change] {
      CameraOptions options = small_camera();
      change(options);
      Camera{options};
    };
  };
  using E = std::invalid_argument;
  EXPECT_THAT(with([](auto& o) { o.exposure = 0s; }), ThrowsMessage<E>(HasSubstr("exposure = 0")));
  EXPECT_THAT(with([](auto& o) { o.period = 50ms; }),
              ThrowsMessage<E>(HasSubstr("period = 50 ms")));
  EXPECT_THAT(with([](auto& o) { o.R_CB.row_x = {2, 0, 0}; }), ThrowsMessage<E>(HasSubstr("R_CB")));
  EXPECT_THAT(with([](auto& o) { o.rows_per_message = 49; }),
              ThrowsMessage<E>(HasSubstr("rows_per_message = 49; accepted: 0 to 48")));
  EXPECT_THAT(with([](auto& o) { o.detector.bits = 3; }), ThrowsMessage<E>(HasSubstr("bits = 3")));
  EXPECT_THAT(with([](auto& o) { o.lens.width_px = 0; }), ThrowsMessage<E>(HasSubstr("width_px")));
  EXPECT_THAT([] { Camera(small_camera()).fault_set("lots"); },
              ThrowsMessage<E>(HasSubstr("no fault 'lots'; there are lost, frozen")));
  EXPECT_NO_THROW(Camera(small_camera()).fault_set("torn_row"));
  CameraOptions lonely = small_camera();
  lonely.targets = {{.spacecraft = "nobody"}};
  Camera camera(lonely);
  FakeDeviceContext io = context();
  camera.start(io);
  EXPECT_THAT([&] { io.run_for(1s); }, ThrowsMessage<E>(HasSubstr("nobody")));
}

}  // namespace
}  // namespace orrery
