#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/camera.hpp>
#include <orrery/models/camera/film_frame.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "orrery_messages.h"

namespace orrery {

namespace {

constexpr Duration kShortestExposure = 1us, kLongestExposure = 100s;
constexpr Duration kLongestDelay = 1000s;
constexpr const char* kFaults[] = {"lost",
                                   "frozen",
                                   "late_s",
                                   "time_offset_s",
                                   "torn_row",
                                   "blinded",
                                   "exposure_factor",
                                   "contamination",
                                   "misalignment_x_deg",
                                   "misalignment_y_deg",
                                   "hot_pixels",
                                   "cosmic_rays_ps",
                                   "dead",
                                   "stuck",
                                   "misalignment_z_deg"};
constexpr double kDegree = 3.14159265358979323846 / 180;

void check(const char* option, Duration value, Duration low, Duration high) {
  if (value < low || value > high) {
    throw std::invalid_argument("Camera: " + std::string(option) + " = " + to_string(value) +
                                "; accepted: " + to_string(low) + " to " + to_string(high));
  }
}

void check(const char* option, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument("Camera: " + std::string(option) + " = " + to_text(value) +
                                "; accepted: " + to_text(low) + " to " + to_text(high));
  }
}

void check_mounting(const Mat3& R) {
  const Mat3 product = R * transpose(R);
  const double off = norm(product.row_x - Vec3{1, 0, 0}) + norm(product.row_y - Vec3{0, 1, 0}) +
                     norm(product.row_z - Vec3{0, 0, 1});
  if (!(off < 1e-9) || !(dot(cross(R.row_x, R.row_y), R.row_z) > 0)) {
    throw std::invalid_argument("Camera: R_CB is no rotation matrix within 1e-9");
  }
}

CameraOptions checked(const CameraOptions& o) {
  if (o.name.empty()) throw std::invalid_argument("Camera: name is empty");
  check_mounting(o.R_CB);
  for (const double p : {o.position_B.x, o.position_B.y, o.position_B.z}) {
    check("position_B", p, -100, 100);
  }
  check("period", o.period, 0s, 24h);
  check("exposure", o.exposure, kShortestExposure, kLongestExposure);
  check("row_period", o.row_period, 0s, 1ms);
  check("read_out", o.read_out, 0s, kLongestDelay);
  check("transfer", o.transfer, 0s, kLongestDelay);
  check("rows_per_message", o.rows_per_message, 0, o.lens.height_px);
  check("threads", o.threads, 1, 64);
  check("record_period", o.record_period, 0s, 24h * 365);
  const Duration shutter = o.exposure + o.row_period * (o.lens.height_px - 1);
  if (o.period != 0s && o.period < shutter) {
    throw std::invalid_argument("Camera: period = " + to_string(o.period) +
                                "; accepted: 0 s, or at least the " + to_string(shutter) +
                                " of an exposure");
  }
  return o;
}

SceneOptions scene_options(const CameraOptions& o) {
  SceneOptions scene{.stars = o.stars,
                     .earth = o.earth,
                     .earth_view = o.earth_view,
                     .sun_and_moon = o.sun_and_moon,
                     .stray_light = o.stray_light};
  scene.renderer = o.renderer;
  for (const CameraTarget& target : o.targets) scene.targets.push_back(target.mesh);
  return scene;
}

// A fault's value, whatever a test gave.
double fault_in(const DeviceContext& io, const char* name, double nominal, double low,
                double high) {
  const double value = io.fault(name, nominal);
  return std::isnan(value) ? nominal : std::clamp(value, low, high);
}

Duration seconds(double s) {
  return Duration(std::llround(1e9 * s));
}

}  // namespace

Camera::Camera(const Options& options, FrameCallback on_frame)
    : options_(checked(options)),
      on_frame_(std::move(on_frame)),
      scene_(PinholeCamera(options.lens), options.optics, scene_options(options)) {
  RandomStream none(0);
  Detector(options.detector, 16, 16, none);  // checks the options
}

void Camera::start(DeviceContext& io) {
  if (!detector_) {
    detector_ = std::make_unique<Detector>(options_.detector, options_.lens.width_px,
                                           options_.lens.height_px, io.random("fixed_pattern"));
  }
  number_ = 0;
  previous_ = {};
  under_way_.clear();
  busy_until_ = io.now();
  io.declare_event("rejected");
  if (options_.period > 0s) {
    io.every(options_.period, [this, &io] { begin(io, options_.exposure); });
  }
}

void Camera::fault_set(std::string_view name) {
  std::string known;
  for (const char* one : kFaults) {
    if (name == one) return;
    known += std::string(known.empty() ? "" : ", ") + one;
  }
  throw std::invalid_argument(options_.name + ": no fault '" + std::string(name) + "'; there are " +
                              known);
}

void Camera::from_flight(DeviceContext& io, Bytes bytes) {
  if (bytes.size() != ORRERY_EXPOSE_BYTES) {
    return reject(io, "message of " + std::to_string(bytes.size()) + " bytes; expected 16");
  }
  std::int64_t begin_ns = 0;
  double exposure_s = 0;
  orrery_get_expose(reinterpret_cast<const unsigned char*>(bytes.data()), &begin_ns, &exposure_s);
  const bool is_default = exposure_s == 0;
  if (!is_default && !(exposure_s >= 1e-6 && exposure_s <= 100)) {
    return reject(io, "exposure of " + to_text(exposure_s) + " s; accepted: 1e-6 to 100");
  }
  const std::int64_t onboard_ns = io.onboard_ns();
  if (begin_ns < onboard_ns) return reject(io, "begins in the past");
  if (begin_ns > onboard_ns + days(365).count()) {
    return reject(io, "begins more than 365 days ahead");
  }
  const Duration exposure = is_default ? options_.exposure : seconds(exposure_s);
  const SimTime at = std::max(io.now(), io.truth_of_onboard(begin_ns));
  io.after(at - io.now(), [this, &io, exposure] { begin(io, exposure); });
}

Duration Camera::shutter_time(Duration exposure) const {
  return exposure + options_.row_period * (options_.lens.height_px - 1);
}

void Camera::begin(DeviceContext& io, Duration exposure) {
  if (io.now() < busy_until_) return reject(io, "another exposure is under way");
  const Duration open = shutter_time(exposure);
  busy_until_ = io.now() + open;
  const Request request{io.now(), io.onboard_ns(), exposure};
  io.after(open / 2, [this, &io, request] { expose(io, request); });
}

Camera::Faults Camera::faults_now(const DeviceContext& io) const {
  Faults f{.torn_row = double(options_.lens.height_px),
           .cosmic_rays_ps = options_.detector.cosmic_rays_ps};
  if (!io.may_be_faulty()) return f;
  f.lost = io.fault("lost", 0) != 0;
  f.frozen = io.fault("frozen", 0) != 0;
  f.late_s = fault_in(io, "late_s", 0, 0, 1e6);
  f.time_offset_s = fault_in(io, "time_offset_s", 0, -1e9, 1e9);
  f.torn_row = fault_in(io, "torn_row", f.torn_row, 0, f.torn_row);
  f.blinded = fault_in(io, "blinded", 0, 0, 1e12);
  f.exposure_factor = fault_in(io, "exposure_factor", 1, 0, 100);
  f.misalignment_deg.x = fault_in(io, "misalignment_x_deg", 0, -180, 180);
  f.misalignment_deg.y = fault_in(io, "misalignment_y_deg", 0, -180, 180);
  f.misalignment_deg.z = fault_in(io, "misalignment_z_deg", 0, -180, 180);
  f.contamination = fault_in(io, "contamination", 0, 0, 1);
  f.cosmic_rays_ps = fault_in(io, "cosmic_rays_ps", f.cosmic_rays_ps, 0, 1e5);
  f.hot_pixels = static_cast<int>(fault_in(io, "hot_pixels", 0, 0, 1e6));
  return f;
}

void Camera::expose(DeviceContext& io, const Request& request) {
  ++number_, ++exposures_;
  const Faults faults = faults_now(io);
  apply_detector_faults(io, faults);
  const double exposure_s = to_seconds(request.exposure) * faults.exposure_factor;
  const SceneState state = scene_state(io, faults.misalignment_deg);
  const ExposureTime time{exposure_s, to_seconds(options_.row_period)};
  SceneFrame seen = scene_.render(state, time, options_.threads);
  const double glare = faults.blinded * exposure_s;
  if (faults.contamination != 0 || glare != 0) {
    const double left = 1 - faults.contamination;
    for (float& e : seen.light.values) e = static_cast<float>(left * double(e) + glare);
  }
  const std::uint64_t key = io.random("frames").bits();
  CameraFrame frame{.number = number_,
                    .begin = request.begin,
                    .middle = io.now(),
                    .exposure_s = exposure_s,
                    .image = detector_->read(seen.light, exposure_s, key, options_.threads),
                    .R_CI = state.camera.R_CI,
                    .stars = std::move(seen.stars),
                    .targets = std::move(seen.targets)};
  DigitalImage whole = frame.image;
  damage(faults, frame.image);
  record(io, frame);
  if (on_frame_) on_frame_(frame);
  if (!faults.lost) send_later(io, request, faults, frame.image);
  if (!faults.frozen) previous_ = std::move(whole);  // it goes on repeating what it froze at
}

SceneState Camera::scene_state(const DeviceContext& io, const Vec3& misalignment_deg) const {
  const OrbitState orbit = io.truth();
  const Surroundings around = io.surroundings();
  const Mat3 R_BI = io.R_BI();
  Mat3 R_CB = options_.R_CB;
  if (misalignment_deg != Vec3{}) R_CB = rotation_by(misalignment_deg * kDegree) * R_CB;
  SceneState state;
  state.camera = {.t = io.now(),
                  .r_ECI = orbit.r_ECI + transpose(R_BI) * options_.position_B,
                  .v_ECI = orbit.v_ECI,
                  .R_CI = R_CB * R_BI,
                  .omega_CI_C = R_CB * io.omega_BI_B()};
  state.R_EI = around.R_EI;
  state.r_sun_ECI = around.r_sun_ECI;
  state.r_moon_ECI = around.r_moon_ECI;
  for (const CameraTarget& target : options_.targets) {
    const SpacecraftState other = io.other(target.spacecraft);
    state.targets.push_back({other.orbit.r_ECI, other.orbit.v_ECI, other.R_BI, other.omega_BI_B});
  }
  return state;
}

void Camera::apply_detector_faults(DeviceContext& io, const Faults& faults) {
  detector_->set_cosmic_rays_ps(faults.cosmic_rays_ps);
  if (faults.hot_pixels > 0 && !is_burst_over_) {
    detector_->add_hot_pixels(faults.hot_pixels, io.random("hot_pixels"));
  }
  is_burst_over_ = faults.hot_pixels > 0;
}

void Camera::damage(const Faults& faults, DigitalImage& image) const {
  if (previous_.values.empty()) return;
  const int torn = faults.frozen ? 0 : static_cast<int>(faults.torn_row);
  for (std::size_t k = image.index(0, torn); k < image.values.size(); ++k) {
    image.values[k] = previous_.values[k];
  }
}

void Camera::send_later(DeviceContext& io, const Request& request, const Faults& faults,
                        const DigitalImage& image) {
  const std::int64_t begin_ns = request.begin_onboard_ns + seconds(faults.time_offset_s).count();
  const int rows = options_.rows_per_message == 0 ? image.height_px : options_.rows_per_message;
  std::vector<ByteBuffer>& messages = under_way_[number_];
  for (int first = 0; first < image.height_px; first += rows) {
    messages.push_back(
        message(request, begin_ns, image, first, std::min(rows, image.height_px - first)));
  }
  const SimTime arrival = request.begin + shutter_time(request.exposure) + options_.read_out +
                          options_.transfer + seconds(faults.late_s);
  io.after(arrival - io.now(), [this, &io, number = number_] { send(io, number); });
}

void Camera::send(DeviceContext& io, std::uint32_t number) {
  const auto at = under_way_.find(number);
  if (at == under_way_.end()) return;
  for (const ByteBuffer& bytes : at->second) io.to_flight(bytes);
  under_way_.erase(at);
}

ByteBuffer Camera::message(const Request& request, std::int64_t begin_ns, const DigitalImage& image,
                           int first_row, int rows) const {
  const PinholeCamera& lens = scene_.camera();
  const LensDistortion& d = lens.distortion();
  orrery_image header = {number_,
                         static_cast<unsigned>(image.width_px),
                         static_cast<unsigned>(image.height_px),
                         static_cast<unsigned>(first_row),
                         static_cast<unsigned>(rows),
                         static_cast<unsigned>(options_.detector.bits),
                         begin_ns,
                         to_seconds(request.exposure),
                         to_seconds(options_.row_period),
                         options_.detector.gain_electrons_per_DN,
                         options_.detector.offset_DN,
                         {lens.fx_px(), lens.fy_px(), lens.cx_px(), lens.cy_px()},
                         {d.k1, d.k2, d.p1, d.p2, d.k3}};
  const std::size_t pixels =
      static_cast<std::size_t>(rows) * static_cast<std::size_t>(image.width_px);
  ByteBuffer bytes(ORRERY_IMAGE_HEADER_BYTES + 2 * pixels);
  auto* const at = reinterpret_cast<unsigned char*>(bytes.data());
  orrery_put_image_header(at, &header);
  const std::uint16_t* pixel = image.row(first_row);
  for (std::size_t k = 0; k < pixels; ++k) {
    orrery_put_u16(at + ORRERY_IMAGE_HEADER_BYTES + 2 * k, pixel[k]);
  }
  return bytes;
}

void Camera::record(DeviceContext& io, const CameraFrame& frame) {
  const auto& values = frame.image.values;
  const auto sum = std::accumulate(values.begin(), values.end(), std::uint64_t{0});
  io.record("stars", double(frame.stars.size()));
  io.record("mean_DN", double(sum) / double(values.size()));
  for (std::size_t k = 0; k < frame.targets.size(); ++k) {
    const auto& target = frame.targets[k];
    if (!target || !scene_.camera().is_inside(target->origin)) continue;
    const std::string& name = options_.targets[k].spacecraft;
    io.record(name + "_u_px", target->origin.u);
    io.record(name + "_v_px", target->origin.v);
    io.record(name + "_electrons", target->electrons);
  }
  if (options_.record_period == 0s || frame.middle < next_record_) return;
  next_record_ = frame.middle + options_.record_period;
  if (!io.keeps_files()) return;
  const std::string number = std::to_string(frame.number);
  const std::string padded = std::string(6 - std::min<std::size_t>(6, number.size()), '0') + number;
  io.record_file(padded + ".png", to_png(frame.image, options_.detector.bits));
  io.record_picture("frame " + number, to_png(film_frame(frame)));
}

void Camera::reject(DeviceContext& io, const std::string& why) {
  ++rejected_;
  io.record_event("rejected", why);
  io.log(DeviceContext::kWarning, options_.name + ": exposure rejected: " + why);
}

}  // namespace orrery
