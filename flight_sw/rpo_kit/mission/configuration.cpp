#include "rpo_kit/mission/configuration.hpp"

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "support/configuration_reader.hpp"

namespace rpo_kit {
namespace {

class Reader final : public flight_support::ConfigurationReader {
 public:
  Reader(Configuration* c, char* message, std::size_t message_bytes)
      : ConfigurationReader(message, message_bytes), configuration_(c) {}

 private:
  bool set(const char* key, const char* value) override {
    if (std::strcmp(key, "role") == 0) return set_role(value);
    if (std::strcmp(key, "waypoint") == 0) return add_waypoint(value);
    if (std::strcmp(key, "keypoint") == 0) return add_keypoint(value);
    if (std::strcmp(key, "face") == 0) return add_face(value);
    if (std::strcmp(key, "albedo") == 0) return set_albedo(value);
    if (std::strcmp(key, "star_catalogue") == 0) return set_star_catalogue(value);
    Configuration& c = *configuration_;
    Camera& camera = c.inspection.camera;
    double leap_seconds = c.earth_time.leap_seconds;
    double second = c.second_observer ? 1.0 : 0.0;
    double width = c.imaging.width, height = c.imaging.height;
    double view_width = c.view_width, view_height = c.view_height;
    const NumberKey keys[] = {
        {"crosslink_period_s", &c.crosslink_period_s, 1.0, 600.0},
        {"telemetry_period_s", &c.telemetry_period_s, 1.0, 86400.0},
        {"decision_period_s", &c.decision_period_s, 1.0, 600.0},
        {"burn_lead_s", &c.burn_lead_s, 25.0, 600.0},
        {"second_observer", &second, 0.0, 1.0},
        {"leap_seconds", &leap_seconds, 0.0, 60.0},
        {"ut1_minus_utc_s", &c.earth_time.ut1_minus_utc_s, -1.0, 1.0},
        {"lag_s", &c.navigation.lag_s, 0.0, 600.0},
        {"pairing_s", &c.navigation.pairing_s, 0.0, 30.0},
        {"lost_s", &c.navigation.lost_s, 60.0, 1e6},
        {"burn_error_fraction", &c.navigation.burn_fraction, 0.0, 1.0},
        {"burn_error_rad", &c.navigation.burn_direction_rad, 0.0, 1.0},
        {"keep_out_m", &c.approach.transfer.keep_out_m, 0.0, 1e4},
        {"range_known", &c.approach.observability.range_known, 1e-3, 1.0},
        {"abort_radius_m", &c.approach.abort_radius_m, 10.0, 1e4},
        {"abort_m", &c.autonomy.abort_m, 0.0, 1e4},
        {"hold_limit_s", &c.autonomy.hold_limit_s, 60.0, 1e7},
        {"camera_f_px", &camera.fx, 1.0, 1e6},
        {"camera_cx_px", &camera.cx, 0.0, 1e5},
        {"camera_cy_px", &camera.cy, 0.0, 1e5},
        {"inertia_y", &c.inspection.filter.inertia[1], 1e-3, 1e3},
        {"inertia_z", &c.inspection.filter.inertia[2], 1e-3, 1e3},
        {"tumble_noise_rad2ps3", &c.inspection.filter.angular_rad2ps3, 0.0, 1.0},
        {"scale_error", &c.inspection.filter.scale_error, 0.0, 0.1},
        {"image_width_px", &width, 0.0, 4096.0},
        {"image_height_px", &height, 0.0, 4096.0},
        {"view_width_px", &view_width, 64.0, 4096.0},
        {"view_height_px", &view_height, 64.0, 4096.0},
        {"psf_sigma_px", &c.imaging.detection.psf_sigma_px, 0.3, 5.0},
        {"pair_magnitude", &c.imaging.pair_magnitude, -2.0, 20.0},
        {"target_size_m", &c.imaging.target_size_m, 0.0, 100.0},
        {"model_rad", &c.imaging.model_rad, 0.0, 1e-2},
        {"pointing_rad", &c.imaging.pointing_rad, 1e-5, 0.1},
    };
    for (std::size_t k = 0; k < sizeof keys / sizeof keys[0]; ++k) {
      if (std::strcmp(key, keys[k].name) != 0) continue;
      if (!set_number(keys, k, value)) return false;
      camera.fy = camera.fx;
      c.earth_time.leap_seconds = static_cast<int>(leap_seconds);
      c.second_observer = second == 1.0;
      c.imaging.width = static_cast<int>(width);
      c.imaging.height = static_cast<int>(height);
      c.view_width = static_cast<int>(view_width);
      c.view_height = static_cast<int>(view_height);
      if (c.earth_time.leap_seconds != leap_seconds || c.imaging.width != width ||
          c.imaging.height != height || c.view_width != view_width ||
          c.view_height != view_height || (second != 0.0 && second != 1.0)) {
        return fail(key, "is no integer");
      }
      return true;
    }
    return fail(key, "is no key of this package");
  }

  bool set_role(const char* value) {
    if (role_seen_) return fail("role", "is given twice");
    role_seen_ = true;
    const struct {
      const char* name;
      Role role;
    } roles[] = {
        {"target", Role::kTarget}, {"chaser", Role::kChaser}, {"observer", Role::kObserver}};
    for (const auto& one : roles) {
      if (std::strcmp(value, one.name) != 0) continue;
      configuration_->role = one.role;
      return true;
    }
    return fail("role", "is not target, chaser or observer");
  }

  bool set_star_catalogue(const char* value) {
    char* path = configuration_->star_catalogue;
    if (*path != '\0') return fail("star_catalogue", "is given twice");
    if (*value == '\0' || std::strlen(value) >= sizeof configuration_->star_catalogue) {
      return fail("star_catalogue", "is no path of 1 to 95 characters");
    }
    std::strcpy(path, value);
    return true;
  }

  // `count` numbers within +-1e6 and nothing behind them.
  bool numbers(const char* key, const char* value, int count, double* to) {
    for (int k = 0; k < count; ++k) {
      char* end = nullptr;
      to[k] = std::strtod(value, &end);
      if (end == value || !(std::fabs(to[k]) <= 1e6)) return fail(key, "lacks a number");
      value = end;
    }
    while (*value == ' ') ++value;
    return *value == '\0' || fail(key, "has more numbers than it takes");
  }

  // The first one replaces the plan that is there by default.
  bool add_waypoint(const char* value) {
    double x[4];
    if (!numbers("waypoint", value, 4, x)) return false;
    ApproachPlan& plan = configuration_->approach.plan;
    if (!waypoint_seen_) plan.count = 0;
    waypoint_seen_ = true;
    if (plan.count == kMostWaypoints) return fail("waypoint", "is one too many");
    if (!(x[1] > 0.0 && x[2] >= 2.0 && x[3] >= 0.0)) {
      return fail("waypoint", "is not: along_track_m, radius_m > 0, leg_rev >= 2, hold_rev >= 0");
    }
    plan.waypoints[plan.count++] = {x[0], x[1], x[2], x[3]};
    return true;
  }

  bool add_keypoint(const char* value) {
    double x[3];
    if (!numbers("keypoint", value, 3, x)) return false;
    InspectionOptions& inspection = configuration_->inspection;
    if (inspection.points == kMostPoints) return fail("keypoint", "is one too many");
    inspection.points_B[inspection.points++] = flight_support::vec3(x[0], x[1], x[2]);
    return true;
  }

  // Numbers of keypoints, counted from 0, up to kMostFaceCorners.
  bool add_face(const char* value) {
    InspectionOptions& inspection = configuration_->inspection;
    if (inspection.face_count == kMostFaces) return fail("face", "is one too many");
    WireframeFace& face = inspection.faces[inspection.face_count++];
    face.count = 0;
    for (;;) {
      while (*value == ' ') ++value;
      if (*value == '\0') break;
      char* end = nullptr;
      const long corner = std::strtol(value, &end, 10);
      if (end == value || corner < 0 || corner >= kMostPoints) {
        return fail("face", "has what is no number of a keypoint");
      }
      if (face.count == kMostFaceCorners) return fail("face", "has more corners than it takes");
      face.corners[face.count++] = static_cast<int>(corner);
      value = end;
    }
    return face.count >= 3 || fail("face", "needs three corners");
  }

  // Of the face before it.
  bool set_albedo(const char* value) {
    InspectionOptions& inspection = configuration_->inspection;
    if (inspection.face_count == 0) return fail("albedo", "stands behind a face");
    double& albedo = inspection.faces[inspection.face_count - 1].albedo;
    if (!numbers("albedo", value, 1, &albedo)) return false;
    return (albedo > 0.0 && albedo <= 1.0) || fail("albedo", "is not above 0 and at most 1");
  }

  Configuration* configuration_;
  bool role_seen_ = false, waypoint_seen_ = false;
};

}  // namespace

bool parse_configuration(const char* text, std::size_t bytes, Configuration* configuration,
                         char* message, std::size_t message_bytes) {
  *configuration = Configuration();
  Reader reader(configuration, message, message_bytes);
  if (!reader.read(text, bytes)) return false;
  ImagingOptions& imaging = configuration->imaging;
  if (*configuration->star_catalogue != '\0' && (imaging.width < 64 || imaging.height < 64)) {
    return reader.fail("star_catalogue", "needs image_width_px and image_height_px of 64 and more");
  }
  imaging.field_radius_rad = std::atan2(0.5 * std::hypot(imaging.width, imaging.height),
                                        configuration->inspection.camera.fx);
  const InspectionOptions& inspection = configuration->inspection;
  if ((configuration->view_width > 0) != (configuration->view_height > 0)) {
    return reader.fail("view_width_px", "and view_height_px go together");
  }
  if (configuration->view_width > 0) {
    Wireframe wireframe;
    const std::vector<flight_support::Vec3> corners(inspection.points_B,
                                                    inspection.points_B + inspection.points);
    const std::vector<WireframeFace> faces(inspection.faces,
                                           inspection.faces + inspection.face_count);
    if (!wireframe.set(corners, faces) || wireframe.empty()) {
      return reader.fail("view_width_px", "needs faces of keypoints, each plane to 1 cm");
    }
  }
  const NavigationOptions& n = configuration->navigation;
  configuration->approach.burn_error = std::hypot(n.burn_fraction, n.burn_direction_rad);
  return true;
}

}  // namespace rpo_kit
