// Navigation by two cameras and GNSS, of rpo_kit's imaging: the star camera says how the spacecraft
// is turned, GNSS differences where in the target camera's image the target must be, and the target
// camera in which direction it is.
//
// Images come in the order of their latencies, not of their exposures. The target camera's is the
// slower: when its image comes, attitudes from before and after its exposure are known, and the
// attitude in between is interpolated. An image without both gives no bearing.
//
// Configuration, lines of `key = numbers`:
//   id, target                 own number, and that of whom to look for
//   R_TS                       turns axes of the star camera into those of the target camera, by
//   rows earth_velocity_mps         of the Earth about the barycentre, ECI: for aberration
//   star_size, target_size     of the images [px]
//   electrons_per_dn           of both
//   target_radius_m            its centre of light may be half of that off, 1 sigma
// The star catalogue is the file /data/stars: a line `x y z magnitude` for each.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "camera_navigation_messages.h"
#include "orrery_flight.hpp"
#include "rpo_kit/imaging/camera.hpp"
#include "rpo_kit/imaging/detection.hpp"
#include "rpo_kit/imaging/star_identification.hpp"
#include "support/gnss_fix.hpp"
#include "support/orbit/earth_rotation.hpp"

namespace {

using flight_support::GnssFix;
using flight_support::Mat3;
using flight_support::StateEci;
using flight_support::Vec3;
using flight_support::vec3;
using orrery_abi::Bytes;
using orrery_abi::Host;
using Port = orrery_abi::Port<class CameraNavigation>;

enum PortId : std::uint32_t {
  kGnss = 1,
  kCrosslink,
  kStarCamera,
  kTargetCamera,
  kFrame,
  kAttitude,
  kBearing
};
constexpr int kPorts = 8;
constexpr std::size_t kFixesKept = 16, kAttitudesKept = 8;
constexpr std::int64_t kLongestGap_ns = 3000000000;  // between attitudes on both sides
constexpr double kDrift_rad = 6e-3;                  // of the axes from star image to star image
constexpr double kReach_px = 15;                     // from where the target must be
constexpr std::uint32_t kMostImageBytes = 1048576;

const unsigned char* data_of(Bytes bytes) {
  return static_cast<const unsigned char*>(bytes.data);
}

// (1 - [turn]x + ([turn]x)^2 / 2): 2e-9 rad off for the largest turn here.
Mat3 small_rotation(const Vec3& turn) {
  Mat3 x;
  x(0, 1) = -turn[2], x(0, 2) = turn[1];
  x(1, 0) = turn[2], x(1, 2) = -turn[0];
  x(2, 0) = -turn[1], x(2, 1) = turn[0];
  return flight_support::identity<3>() - x + 0.5 * (x * x);
}
// The inverse.
Vec3 small_turn(const Mat3& a) {
  return 0.5 * vec3(a(1, 2) - a(2, 1), a(2, 0) - a(0, 2), a(0, 1) - a(1, 0));
}

class Configuration {
 public:
  explicit Configuration(const orrery_boot& boot) {
    std::string text(static_cast<const char*>(boot.config), boot.config_bytes);
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      add(text.substr(at, end - at));
      at = end + 1;
    }
  }
  double number(const char* key) const { return numbers(key, 1)[0]; }
  Vec3 vector(const char* key) const {
    const std::vector<double>& n = numbers(key, 3);
    return vec3(n[0], n[1], n[2]);
  }
  Mat3 matrix(const char* key) const {
    const std::vector<double>& n = numbers(key, 9);
    Mat3 m;
    for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = n[static_cast<std::size_t>(k)];
    return m;
  }

 private:
  void add(const std::string& line) {
    const std::size_t equal = line.find('=');
    if (equal == std::string::npos) return;
    std::vector<double>& values = values_[line.substr(0, line.find(' '))];
    const char* at = line.c_str() + equal + 1;
    for (char* end = nullptr;; at = end) {
      const double value = std::strtod(at, &end);
      if (end == at) return;
      values.push_back(value);
    }
  }
  // A configuration without it is the test's mistake: the flight software does not boot.
  const std::vector<double>& numbers(const char* key, std::size_t count) const {
    const auto found = values_.find(key);
    if (found == values_.end() || found->second.size() != count) std::abort();
    return found->second;
  }
  std::map<std::string, std::vector<double>> values_;
};

std::vector<rpo_kit::Star> read_stars() {
  std::vector<rpo_kit::Star> stars;
  std::FILE* file = std::fopen("/data/stars", "r");
  if (file == nullptr) return stars;
  char line[160];
  while (std::fgets(line, sizeof line, file) != nullptr) {
    double n[4];
    char* at = line;
    for (double& value : n) value = std::strtod(at, &at);
    stars.push_back({vec3(n[0], n[1], n[2]), n[3]});
  }
  std::fclose(file);
  return stars;
}

rpo_kit::DetectionOptions detection_options(double electrons_per_dn) {
  rpo_kit::DetectionOptions options;
  options.electrons_per_dn = electrons_per_dn;
  options.saturation_dn = 4095;
  return options;
}

rpo_kit::IdentificationOptions identification_options() {
  rpo_kit::IdentificationOptions options;
  options.field_radius_rad = 0.25;
  return options;
}

// The image of one message, its pixels in the order of this processor.
struct Frame {
  orrery_image header;
  std::vector<std::uint16_t> pixels;
  rpo_kit::Camera camera;

  bool read(Bytes bytes) {
    const unsigned char* at = data_of(bytes);
    if (!orrery_get_image_header(at, bytes.size, &header) || header.rows != header.height) {
      return false;
    }
    pixels.resize(std::size_t{header.width} * header.height);
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      pixels[k] =
          static_cast<std::uint16_t>(orrery_get_u16(at + ORRERY_IMAGE_HEADER_BYTES + 2 * k));
    }
    camera.width = static_cast<int>(header.width), camera.height = static_cast<int>(header.height);
    const double* f = header.fx_fy_cx_cy;
    const double* d = header.k1_k2_p1_p2_k3;
    camera.fx = f[0], camera.fy = f[1], camera.cx = f[2], camera.cy = f[3];
    camera.k1 = d[0], camera.k2 = d[1], camera.p1 = d[2], camera.p2 = d[3], camera.k3 = d[4];
    return true;
  }
  rpo_kit::ImageView view() const { return {pixels.data(), camera.width, camera.height}; }
  std::int64_t middle_ns() const {
    return header.exposure_begin_ns + std::llround(0.5e9 * header.exposure_s);
  }
};

class CameraNavigation {
 public:
  CameraNavigation(Host host, const orrery_boot& boot)
      : host_(host),
        configuration_(boot),
        id_(static_cast<std::uint32_t>(configuration_.number("id"))),
        target_(static_cast<std::uint32_t>(configuration_.number("target"))),
        R_TS_(configuration_.matrix("R_TS")),
        v_earth_ECI_(configuration_.vector("earth_velocity_mps")),
        catalogue_(read_stars(), 4.8, 0.45),
        identifier_(catalogue_, identification_options()),
        star_detector_(detector("star_size")),
        target_detector_(detector("target_size")) {
    novatel_framer_init(&framer_, room_, sizeof room_);
  }

  std::int32_t gnss(std::int64_t, Bytes bytes) {
    const unsigned char* at = data_of(bytes);
    for (std::size_t left = bytes.size; left > 0;) {
      const std::size_t taken = novatel_framer_write(&framer_, at, left);
      at += taken, left -= taken;
      novatel_frame frame;
      GnssFix fix;
      while (novatel_framer_next(&framer_, &frame) != 0) {
        if (read_fix(frame, &fix)) take_own(fix);
      }
    }
    return ORRERY_OK;
  }

  std::int32_t crosslink(std::int64_t, Bytes bytes) {
    const unsigned char* at = data_of(bytes);
    if (bytes.size != CAMERA_NAVIGATION_CROSSLINK_BYTES ||
        orrery_get_u32(at + 60) != orrery_crc32(at, 60)) {
      return ORRERY_REJECTED;
    }
    ++heard_;
    if (orrery_get_u32(at) != target_) return ORRERY_OK;
    GnssFix fix;
    fix.epoch_ns = orrery_get_i64(at + 4);
    double r[3], v[3];
    orrery_get_f64s(at + 12, r, 3);
    orrery_get_f64s(at + 36, v, 3);
    fix.r_ECEF = vec3(r[0], r[1], r[2]), fix.v_ECEF = vec3(v[0], v[1], v[2]);
    keep(&target_fixes_, fix);
    return ORRERY_OK;
  }

  std::int32_t star_camera(std::int64_t now_ns, Bytes bytes) {
    Frame frame;
    std::vector<rpo_kit::Detection> found;
    if (!frame.read(bytes) || !star_detector_->detect(frame.view(), &found)) return ORRERY_REJECTED;
    say_frame(CAMERA_NAVIGATION_STAR, frame, now_ns, found.size());
    if (own_fixes_.empty()) return ORRERY_OK;
    std::vector<rpo_kit::SeenSource> seen;
    for (const rpo_kit::Detection& d : found) {
      rpo_kit::SeenSource source;
      if (d.sharpness > star_detector_->hot_sharpness() ||
          !unproject(frame.camera, {d.u, d.v}, &source.direction_C)) {
        continue;
      }
      source.sigma_rad = d.sigma_px / frame.camera.fx;
      seen.push_back(source);
    }
    const Vec3 v_ECI = v_earth_ECI_ + in_eci(own_fixes_.rbegin()->second).v_ECI;
    rpo_kit::Identification stars;
    const bool known =
        !attitudes_.empty() &&
        identifier_.track(seen, v_ECI, attitudes_.rbegin()->second.R_CI, kDrift_rad, &stars);
    if (!known && !identifier_.lost_in_space(seen, v_ECI, &stars)) return ORRERY_OK;
    attitudes_[frame.middle_ns()] = stars.attitude;
    if (attitudes_.size() > kAttitudesKept) attitudes_.erase(attitudes_.begin());
    say_attitude(frame.middle_ns(), stars);
    return ORRERY_OK;
  }

  std::int32_t target_camera(std::int64_t now_ns, Bytes bytes) {
    Frame frame;
    std::vector<rpo_kit::Detection> found;
    if (!frame.read(bytes) || !target_detector_->detect(frame.view(), &found)) {
      return ORRERY_REJECTED;
    }
    say_frame(CAMERA_NAVIGATION_TARGET, frame, now_ns, found.size());
    const std::int64_t t_ns = frame.middle_ns();
    rpo_kit::Attitude star_camera;
    Vec3 r_ECI;
    std::int64_t epoch_ns = 0;
    if (!attitude_at(t_ns, &star_camera) || !to_target(t_ns, &r_ECI, &epoch_ns)) return ORRERY_OK;
    const Mat3 R_TI = R_TS_ * star_camera.R_CI;
    rpo_kit::Pixel predicted;
    if (!project(frame.camera, R_TI * r_ECI, &predicted)) return ORRERY_OK;
    const rpo_kit::Detection* target = nearest(found, predicted);
    if (target == nullptr) return ORRERY_OK;
    Vec3 direction_T;
    if (!unproject(frame.camera, {target->u, target->v}, &direction_T)) return ORRERY_OK;
    const Vec3 direction_S = transpose(R_TS_) * direction_T;
    const double sigma_rad =
        std::hypot(std::hypot(target->sigma_px / frame.camera.fx,
                              0.5 * configuration_.number("target_radius_m") / norm(r_ECI)),
                   across(star_camera.covariance_C, direction_S));
    say_bearing(t_ns, transpose(R_TI) * direction_T, sigma_rad, *target, predicted,
                1e-9 * static_cast<double>(t_ns - epoch_ns));
    return ORRERY_OK;
  }

  std::int32_t tick(std::int64_t) { return ORRERY_OK; }
  static const Port (&ports())[kPorts];

 private:
  using Fixes = std::map<std::int64_t, GnssFix>;  // by epoch

  std::unique_ptr<rpo_kit::PointSourceDetector> detector(const char* size) const {
    const int px = static_cast<int>(configuration_.number(size));
    return std::make_unique<rpo_kit::PointSourceDetector>(
        px, px, detection_options(configuration_.number("electrons_per_dn")));
  }
  static void keep(Fixes* fixes, const GnssFix& fix) {
    (*fixes)[fix.epoch_ns] = fix;
    if (fixes->size() > kFixesKept) fixes->erase(fixes->begin());
  }
  static StateEci in_eci(const GnssFix& fix) {
    return eci_from_ecef(fix.epoch_ns, fix.r_ECEF, fix.v_ECEF, flight_support::EarthTime());
  }

  void take_own(const GnssFix& fix) {
    ++fixes_;
    keep(&own_fixes_, fix);
    unsigned char message[CAMERA_NAVIGATION_CROSSLINK_BYTES];
    orrery_put_u32(message, id_);
    orrery_put_i64(message + 4, fix.epoch_ns);
    for (int k = 0; k < 3; ++k) {
      orrery_put_f64(message + 12 + 8 * k, fix.r_ECEF[k]);
      orrery_put_f64(message + 36 + 8 * k, fix.v_ECEF[k]);
    }
    orrery_put_u32(message + 60, orrery_crc32(message, 60));
    host_.output(kCrosslink, {message, sizeof message});
  }

  // At the newest epoch of both, moved on by the relative velocity.
  bool to_target(std::int64_t t_ns, Vec3* r_ECI, std::int64_t* epoch_ns) const {
    for (auto own = own_fixes_.rbegin(); own != own_fixes_.rend(); ++own) {
      const auto other = target_fixes_.find(own->first);
      if (other == target_fixes_.end()) continue;
      const StateEci a = in_eci(own->second), b = in_eci(other->second);
      *epoch_ns = own->first;
      *r_ECI =
          b.r_ECI - a.r_ECI + (1e-9 * static_cast<double>(t_ns - *epoch_ns)) * (b.v_ECI - a.v_ECI);
      return true;
    }
    return false;
  }

  bool attitude_at(std::int64_t t_ns, rpo_kit::Attitude* attitude) const {
    const auto after = attitudes_.lower_bound(t_ns);
    if (after == attitudes_.end()) return false;
    if (after->first == t_ns) {
      *attitude = after->second;
      return true;
    }
    if (after == attitudes_.begin()) return false;
    const auto before = std::prev(after);
    const std::int64_t gap_ns = after->first - before->first;
    if (gap_ns > kLongestGap_ns) return false;
    const double part = static_cast<double>(t_ns - before->first) / static_cast<double>(gap_ns);
    const Vec3 turn = small_turn(after->second.R_CI * transpose(before->second.R_CI));
    attitude->R_CI = small_rotation(part * turn) * before->second.R_CI;
    attitude->covariance_C = ((1 - part) * (1 - part)) * before->second.covariance_C +
                             (part * part) * after->second.covariance_C;
    return true;
  }

  static const rpo_kit::Detection* nearest(const std::vector<rpo_kit::Detection>& found,
                                           const rpo_kit::Pixel& at) {
    const rpo_kit::Detection* best = nullptr;
    double least = kReach_px;
    for (const rpo_kit::Detection& d : found) {
      const double away = std::hypot(d.u - at.u, d.v - at.v);
      if (away < least) best = &d, least = away;
    }
    return best;
  }

  // Per axis, of a direction that turns with the attitude.
  static double across(const Mat3& covariance, const Vec3& d) {
    double trace = 0.0, along = 0.0;
    for (int k = 0; k < 3; ++k) trace += covariance(k, k);
    along = dot(d, covariance * d);
    // d x theta has the variance theta^2 - (d theta)^2, summed over both axes across d.
    return std::sqrt(0.5 * std::max(0.0, trace - along));
  }

  void say_frame(std::uint32_t camera, const Frame& frame, std::int64_t now_ns,
                 std::size_t sources) const {
    unsigned char message[CAMERA_NAVIGATION_FRAME_BYTES];
    orrery_put_u32(message, camera);
    orrery_put_u32(message + 4, frame.header.frame);
    orrery_put_i64(message + 8, frame.header.exposure_begin_ns);
    orrery_put_i64(message + 16, now_ns);
    orrery_put_u32(message + 24, static_cast<std::uint32_t>(sources));
    orrery_put_u32(message + 28, fixes_);
    orrery_put_u32(message + 32, heard_);
    host_.output(kFrame, {message, sizeof message});
  }
  void say_attitude(std::int64_t t_ns, const rpo_kit::Identification& stars) const {
    unsigned char message[CAMERA_NAVIGATION_ATTITUDE_BYTES];
    const rpo_kit::Attitude& a = stars.attitude;
    orrery_put_i64(message, t_ns);
    for (int k = 0; k < 9; ++k) orrery_put_f64(message + 8 + 8 * k, a.R_CI(k / 3, k % 3));
    for (int k = 0; k < 3; ++k) {
      orrery_put_f64(message + 80 + 8 * k, std::sqrt(a.covariance_C(k, k)));
    }
    orrery_put_u32(message + 104, static_cast<std::uint32_t>(stars.identified));
    host_.output(kAttitude, {message, sizeof message});
  }
  void say_bearing(std::int64_t t_ns, const Vec3& d, double sigma_rad,
                   const rpo_kit::Detection& seen, const rpo_kit::Pixel& predicted,
                   double age_s) const {
    unsigned char message[CAMERA_NAVIGATION_BEARING_BYTES];
    const rpo_kit_bearing bearing = {t_ns, {d[0], d[1], d[2]}, sigma_rad};
    const double more[5] = {seen.u, seen.v, predicted.u, predicted.v, age_s};
    rpo_kit_put_bearing(message, &bearing);
    orrery_put_f64s(message + RPO_KIT_BEARING_BYTES, more, 5);
    host_.output(kBearing, {message, sizeof message});
  }

  Host host_;
  Configuration configuration_;
  std::uint32_t id_, target_;
  Mat3 R_TS_;
  Vec3 v_earth_ECI_;
  rpo_kit::StarCatalogue catalogue_;
  rpo_kit::StarIdentifier identifier_;
  std::unique_ptr<rpo_kit::PointSourceDetector> star_detector_, target_detector_;
  unsigned char room_[flight_support::kGnssRoomBytes];
  novatel_framer framer_;
  Fixes own_fixes_, target_fixes_;
  std::map<std::int64_t, rpo_kit::Attitude> attitudes_;  // by the middle of the exposure
  std::uint32_t fixes_ = 0, heard_ = 0;
};

const Port (&CameraNavigation::ports())[kPorts] {
  static const Port table[kPorts] = {
      {kGnss, ORRERY_IN, ORRERY_STREAM, "gnss", 4096, &CameraNavigation::gnss},
      {kCrosslink, ORRERY_IN, ORRERY_PACKET, "crosslink", 256, &CameraNavigation::crosslink},
      {kStarCamera, ORRERY_IN, ORRERY_PACKET, "star_camera", kMostImageBytes,
       &CameraNavigation::star_camera},
      {kTargetCamera, ORRERY_IN, ORRERY_PACKET, "target_camera", kMostImageBytes,
       &CameraNavigation::target_camera},
      {kCrosslink, ORRERY_OUT, ORRERY_PACKET, "crosslink", CAMERA_NAVIGATION_CROSSLINK_BYTES,
       nullptr},
      {kFrame, ORRERY_OUT, ORRERY_PACKET, "frame", CAMERA_NAVIGATION_FRAME_BYTES, nullptr},
      {kAttitude, ORRERY_OUT, ORRERY_PACKET, "attitude", CAMERA_NAVIGATION_ATTITUDE_BYTES, nullptr},
      {kBearing, ORRERY_OUT, ORRERY_PACKET, "bearing", CAMERA_NAVIGATION_BEARING_BYTES, nullptr},
  };
  return table;
}

}  // namespace

ORRERY_FLIGHT_LIBRARY(CameraNavigation, "camera_navigation", "1.0")
