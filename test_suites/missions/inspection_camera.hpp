/// A camera that is held on a tumbling target near by: rendered frames, each with its attitude.
#pragma once

#include <orrery/models/camera/camera.hpp>
#include <orrery/models/camera/png.hpp>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "inspection_target.hpp"
#include "rendezvous_world.hpp"

namespace orrery::rendezvous {

struct InspectionCameraOptions {
  Duration period = 20s, latency = 2s;  // between exposures; of read-out and transfer
  double farthest_m = 120;
  double pointing_rad = 0.01, attitude_rad = 3e-5;  // off the target; of what is known of it
  double rate_radps = 1 * kDegree_rad;              // of the tumbling
  Duration exposure = 400us;
  PinholeOptions lens = {.width_px = 512,
                         .height_px = 512,
                         .fx_px = 3000,
                         .fy_px = 3000,
                         .distortion = {.k1 = -0.09, .k2 = 0.03, .p1 = 2e-4, .p2 = -1e-4}};
  OpticsOptions optics = {.aperture_m = 0.003};
  DetectorOptions detector = {.bits = 14,
                              .gain_electrons_per_DN = 4,
                              .full_well_electrons = 66000,
                              .hot_pixels_per_million = 100,
                              .hot_pixel_electrons_ps = 1e6,
                              .cosmic_rays_ps = 5};
  Duration record_period = 0s;  // of PNG files
};

/// Device "view". The target as the mesh that it is, lit by Sun and Earth, before what of the Earth
/// is behind it. Shut while the target is in the Earth's shadow, or within 30 deg of the Sun.
class InspectionCamera final : public TumblingTargetSensor {
 public:
  InspectionCamera(TruthOf target, const InspectionCameraOptions& options)
      : TumblingTargetSensor(std::move(target)),
        options_(options),
        camera_(options.lens),
        scene_(camera_, options.optics, {.targets = {inspection_mesh()}}) {}
  std::string_view name() const override { return "view"; }
  void start(DeviceContext& io) override {
    tumble(io, options_.rate_radps);
    if (!detector_) {
      detector_.emplace(options_.detector, camera_.width_px(), camera_.height_px(),
                        io.random("fixed_pattern"));
    }
    io.every(options_.period, [this, &io] { expose(io); });
  }

 private:
  void expose(DeviceContext& io) {
    const OrbitState target = target_(), own = io.truth();
    const Vec3 d = target.r_ECI - own.r_ECI;
    if (norm(d) > options_.farthest_m || !may_be_seen(io.now(), target.r_ECI, unit(d))) return;
    const Mat3 R_CI =
        looking_along(unit(unit(d) + normal3(io.random("pointing"), options_.pointing_rad)));
    const Mat3 known = small_turn(normal3(io.random("attitude"), options_.attitude_rad)) * R_CI;
    const Surroundings around = io.surroundings();
    const TumblingBody& turning = body(io.now());
    SceneState state;
    state.camera = {.t = io.now(), .r_ECI = own.r_ECI, .v_ECI = own.v_ECI, .R_CI = R_CI};
    state.R_EI = around.R_EI;
    state.r_sun_ECI = around.r_sun_ECI;
    state.r_moon_ECI = around.r_moon_ECI;
    state.targets = {{target.r_ECI, target.v_ECI, to_matrix(turning.q_BI), turning.omega_BI_B}};
    const double exposure_s = std::chrono::duration<double>(options_.exposure).count();
    const SceneFrame seen = scene_.render(state, {exposure_s, 0});
    const std::uint64_t key = io.random("frames").bits();
    const DigitalImage image = detector_->read(seen.light, exposure_s, key);
    ++images_;
    record(io, image);
    auto message = std::make_shared<const ByteBuffer>(packed(io, image, exposure_s, known));
    io.after(options_.latency, [&io, message] { io.to_flight(*message); });
  }
  ByteBuffer packed(DeviceContext& io, const DigitalImage& image, double exposure_s,
                    const Mat3& known_R_CI) const {
    const LensDistortion& k = camera_.distortion();
    const orrery_image header = {
        static_cast<std::uint32_t>(images_),
        static_cast<unsigned>(image.width_px),
        static_cast<unsigned>(image.height_px),
        0,
        static_cast<unsigned>(image.height_px),
        static_cast<unsigned>(options_.detector.bits),
        io.onboard_ns() - options_.exposure.count() / 2,
        exposure_s,
        0,
        options_.detector.gain_electrons_per_DN,
        options_.detector.offset_DN,
        {camera_.fx_px(), camera_.fy_px(), camera_.cx_px(), camera_.cy_px()},
        {k.k1, k.k2, k.p1, k.p2, k.k3}};
    ByteBuffer bytes(RPO_KIT_VIEW_HEAD_BYTES + ORRERY_IMAGE_HEADER_BYTES + 2 * image.values.size());
    auto* at = reinterpret_cast<unsigned char*>(bytes.data());
    const Quaternion q = to_quaternion(known_R_CI);
    const double q_CI[4] = {q.w, q.x, q.y, q.z};
    rpo_kit_put_view_head(at, q_CI, options_.attitude_rad);
    at += RPO_KIT_VIEW_HEAD_BYTES;
    orrery_put_image_header(at, &header);
    at += ORRERY_IMAGE_HEADER_BYTES;
    for (std::size_t i = 0; i < image.values.size(); ++i)
      orrery_put_u16(at + 2 * i, image.values[i]);
    return bytes;
  }
  void record(DeviceContext& io, const DigitalImage& image) {
    if (options_.record_period == 0s || io.now() < next_record_ || !io.keeps_files()) return;
    next_record_ = io.now() + options_.record_period;
    const std::string number = std::to_string(images_);
    io.record_file(std::string(6 - std::min<std::size_t>(6, number.size()), '0') + number + ".png",
                   to_png(image, options_.detector.bits));
  }

  InspectionCameraOptions options_;
  PinholeCamera camera_;
  Scene scene_;
  std::optional<Detector> detector_;
  SimTime next_record_{};
};

/// What the flight software has to know of target and images.
inline std::string inspection_config(const InspectionCameraOptions& camera = {}) {
  std::string text =
      "view_width_px = " + std::to_string(camera.lens.width_px) +
      "\nview_height_px = " + std::to_string(camera.lens.height_px) +
      "\ninertia_y = 1.4\ninertia_z = 1.7\ntumble_noise_rad2ps3 = 1e-12\nscale_error = 0.0015\n";
  for (const Vec3& p : target_corners_B()) {
    text += "keypoint = " + std::to_string(p.x) + " " + std::to_string(p.y) + " " +
            std::to_string(p.z) + "\n";
  }
  const std::vector<std::vector<int>> faces = target_faces();
  for (std::size_t k = 0; k < faces.size(); ++k) {
    text += "face =";
    for (const int corner : faces[k]) text += " " + std::to_string(corner);
    text += "\nalbedo = " + std::to_string(target_albedos()[k]) + "\n";
  }
  return text;
}

}  // namespace orrery::rendezvous
