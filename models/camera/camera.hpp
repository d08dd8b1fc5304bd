/// An on-board camera: what it sees becomes bytes on a port of flight software.
#pragma once

#include <orrery/models/camera/detector.hpp>
#include <orrery/models/camera/scene.hpp>
#include <orrery/models/device/device.hpp>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace orrery {

/// Another spacecraft of the world, and its shape.
struct CameraTarget {
  std::string spacecraft = {};
  Mesh mesh = Mesh::sphere(0.15, 24);  // in its body axes
};

struct CameraOptions {
  std::string name = "camera";  // of the device; by default its ports' too
  PinholeOptions lens = {};
  OpticsOptions optics = {};
  DetectorOptions detector = {};
  Mat3 R_CB = {};             // mounting: f_C = R_CB f_B, z the boresight, x right, y down
  Vec3 position_B{};          // of the pinhole [m], each within +-100
  Duration period = 10s;      // of exposures from power-on, 0 s: by command only; to 1 day
  Duration exposure = 100ms;  // of each row, 1 us to 100 s
  Duration row_period = 0ns;  // rolling shutter, from row to row; 0: global. To 1 ms
  Duration read_out = 100ms;  // from the end of the exposure, 0 to 1000 s
  Duration transfer = 200ms;  // from there to flight software, 0 to 1000 s
  int rows_per_message = 0;   // 0: the whole image in one; else in bands of so many rows
  StarCatalogue stars = {};   // none by default: StarCatalogue::bright_stars()
  bool earth = true;
  EarthViewOptions earth_view = {};
  bool sun_and_moon = true;
  StrayLightOptions stray_light = {};
  std::vector<CameraTarget> targets = {};
  Renderer renderer = Renderer::kCpu;
  int threads = 1;  // of rendering, 1 to 64; no bit depends on it
  Duration record_period =
      0s;  // of 16-bit PNG files and the film strip; 0 s: none, 1 ns: every frame
};

/// Of one exposure: what flight software gets, and what was true.
struct CameraFrame {
  std::uint32_t number = 0;  // since power-on, from 1
  SimTime begin{}, middle{};
  double exposure_s = 0;  // that took place
  DigitalImage image = {};
  Mat3 R_CI{};  // at the middle
  std::vector<DrawnPoint> stars = {};
  std::vector<std::optional<SeenTarget>> targets = {};
};

/// Device "camera". Exposures begin at power-on and every `period`, or when the message `expose` of
/// orrery_messages.h says; one that comes while another is under way, in the past or out of range
/// is rejected (event "rejected"). The message `image` leaves exposure, read-out and transfer
/// later, with the time of the onboard clock at which the exposure began. Two events per exposure
/// besides its timer; without exposures nothing happens.
///
/// Truth     Orbit and attitude at the middle of the exposure, angular velocity constant over it.
/// Other
///           spacecraft as they are at that instant (DeviceContext::other). Sun and Moon of
///           Surroundings: within 0.12 deg.
/// Records   stars (in the image), mean_DN, and for each target <name>_u_px, <name>_v_px and
///           <name>_electrons while it is in the image; with `record_period` images and a film
///           strip.
/// Random    Streams "fixed_pattern" (at the first power-on) and "frames": one draw per exposure.
/// Faults    each asked once per exposure, in its middle:
///           lost            not 0: the frame never comes
///           frozen          not 0: the pixels of the frame before, with this one's header
///           late_s          s: it comes that much later, to 1e6
///           time_offset_s   s: its time stamp is that much off
///           torn_row        rows from this one on are those of the frame before
///           blinded         electrons/s that every pixel gets besides
///           exposure_factor what took place over what was commanded and is said, 0 to 100
///           misalignment_x_deg, _y_deg, _z_deg   the camera has turned by that vector in its axes
///           contamination   part of the light that the lens has lost, 0 to 1
///           hot_pixels      when it begins to hold: so many pixels become hot for good
///           cosmic_rays_ps  on the detector, instead of the option
///           and "dead" and "stuck", as every device has them.
/// Checked by  test_suites/unit/models/camera/camera_test.cpp,
/// test_suites/unit/fixtures/camera_world_test.cpp
class Camera final : public Device {
 public:
  using Options = CameraOptions;
  using FrameCallback = std::function<void(const CameraFrame&)>;

  /// @param on_frame  Called in the middle of each exposure, lost ones included.
  /// @throws std::invalid_argument  an option outside its range, or a mounting that is no rotation.
  ///         std::runtime_error     no OpenGL where it is asked for; says what to install.
  explicit Camera(const Options& options = {}, FrameCallback on_frame = {});

  std::string_view name() const override { return options_.name; }
  void start(DeviceContext& io) override;
  /// @throws std::invalid_argument  no such fault; lists them.
  void fault_set(std::string_view name) override;
  void from_flight(DeviceContext& io, Bytes bytes) override;

  const Options& options() const { return options_; }
  std::uint64_t exposures() const { return exposures_; }
  std::uint64_t rejected() const { return rejected_; }

 private:
  struct Request {
    SimTime begin{};
    std::int64_t begin_onboard_ns = 0;
    Duration exposure{};
  };
  // Of one exposure: each is asked for once, as asking counts.
  struct Faults {
    bool lost = false, frozen = false;
    double late_s = 0, time_offset_s = 0, torn_row = 0, blinded = 0, exposure_factor = 1;
    Vec3 misalignment_deg{};
    double contamination = 0, cosmic_rays_ps = 0;
    int hot_pixels = 0;
  };
  Faults faults_now(const DeviceContext& io) const;
  void begin(DeviceContext& io, Duration exposure);
  void expose(DeviceContext& io, const Request& request);
  SceneState scene_state(const DeviceContext& io, const Vec3& misalignment_deg) const;
  void apply_detector_faults(DeviceContext& io, const Faults& faults);
  void damage(const Faults& faults, DigitalImage& image) const;
  void send_later(DeviceContext& io, const Request& request, const Faults& faults,
                  const DigitalImage& image);
  void send(DeviceContext& io, std::uint32_t number);
  ByteBuffer message(const Request& request, std::int64_t begin_ns, const DigitalImage& image,
                     int first_row, int rows) const;
  void record(DeviceContext& io, const CameraFrame& frame);
  void reject(DeviceContext& io, const std::string& why);
  Duration shutter_time(Duration exposure) const;

  Options options_;
  FrameCallback on_frame_;
  Scene scene_;
  std::unique_ptr<Detector> detector_;  // made at the first power-on
  DigitalImage previous_;
  std::uint32_t number_ = 0;
  SimTime busy_until_{};
  bool is_burst_over_ = false;
  SimTime next_record_{};
  std::map<std::uint32_t, std::vector<ByteBuffer>> under_way_;
  std::uint64_t exposures_ = 0, rejected_ = 0;
};

}  // namespace orrery
