/// The chaser of rendezvous_world.hpp with a camera instead of sensors made of the truth: what it
/// knows of the target comes from rendered frames alone.
#pragma once

#include <orrery/models/camera/camera.hpp>

#include <cstdio>
#include <deque>

#include "rendezvous_world.hpp"

namespace orrery::rendezvous {

/// The target's shape: the body and the two panels of kKeypoints_B.
inline Mesh target_mesh() {
  Mesh mesh = Mesh::box({0.6, 0.4, 0.3}, {.albedo = 0.3});
  for (const double side : {0.55, -0.55}) mesh.add(Mesh::box({0.2, 0.7, 0.02}), {0, side, 0});
  return mesh;
}

/// 20 deg of sky along the track, 137" to the pixel, stars to V 6.5, one exposure for stars and
/// target: the latter fills pixels to the brim from some 15 km on.
inline CameraOptions star_camera(const StarCatalogue& stars) {
  CameraOptions options;
  options.lens = {.width_px = 512,
                  .height_px = 512,
                  .fx_px = 1500,
                  .fy_px = 1500,
                  .distortion = {.k1 = -0.09, .k2 = 0.03, .p1 = 2e-4, .p2 = -1e-4}};
  options.optics = {.aperture_m = 0.015};
  options.detector = {.bits = 14,
                      .gain_electrons_per_DN = 4,
                      .full_well_electrons = 66000,
                      .hot_pixels_per_million = 100,
                      .hot_pixel_electrons_ps = 20000,
                      .cosmic_rays_ps = 5};
  options.R_CB = {{0, -1, 0}, {0, 0, -1}, {1, 0, 0}};  // along +X, which is along the track
  options.period = 120s;
  options.stars = stars;
  options.targets = {{.spacecraft = "target", .mesh = target_mesh()}};
  return options;
}

/// The stars that the flight software is told of, at the time of the mission.
inline std::string star_file(const StarCatalogue& stars, double faintest, SimTime t) {
  std::string text = "# right ascension [deg], declination [deg], V\n";
  const double years = julian_years(t);
  for (const Star& star : stars.to_magnitude(faintest).stars()) {
    const Vec3 u = direction_ECI(star, years);
    const double ra_rad = std::atan2(u.y, u.x);
    char line[80];
    std::snprintf(line, sizeof line, "%.8f %.8f %.2f\n",
                  (ra_rad < 0 ? ra_rad + 2 * 3.14159265358979 : ra_rad) / kDegree_rad,
                  std::asin(u.z) / kDegree_rad, star.magnitude);
    text += line;
  }
  return text;
}

inline std::string camera_config(const CameraOptions& camera) {
  return "star_catalogue = /data/stars\nimage_width_px = " + std::to_string(camera.lens.width_px) +
         "\nimage_height_px = " + std::to_string(camera.lens.height_px) +
         "\ncamera_f_px = " + std::to_string(camera.lens.fx_px) + "\n";
}

/// What frames gave, against truth.
struct FrameScore {
  int frames = 0;       // that were answered
  int wrong_times = 0;  // of frames with a time at which none was exposed; not judged
  int attitudes = 0, lost_in_space = 0;
  int wrong_attitudes = 0;   // more than 0.1 deg off
  double attitude_chi2 = 0;  // sum of squared normalised errors, 3 degrees of freedom each
  double worst_attitude_rad = 0;
  int directions = 0;
  int wrong_directions = 0;   // more than 0.1 deg off: something else was taken for the target
  double direction_chi2 = 0;  // sum, 2 degrees of freedom each
  double direction_squares = 0, worst_direction_rad = 0, sigma_squares = 0;
};

struct CameraWorld : RendezvousWorld {
  CameraWorld(const RendezvousOptions& options, const CameraOptions& camera)
      : RendezvousWorld(options) {
    camera_ = &spacecraft("chaser").add<Camera>(
        camera, [this](const CameraFrame& frame) { note_frame(frame); });
    flight("chaser").on_output("imaging", [this](SimTime, Bytes message) { judge(message); });
  }

  const Camera& camera() const { return *camera_; }
  FrameScore score;

 private:
  struct Truth {
    SimTime middle;
    Mat3 R_CI;
    Vec3 direction_ECI;
  };
  void note_frame(const CameraFrame& frame) {
    const Vec3 d = spacecraft("target").truth().r_ECI - spacecraft("chaser").truth().r_ECI;
    truths_.push_back({frame.middle, frame.R_CI, unit(d)});
    if (truths_.size() > 8) truths_.pop_front();
  }
  void judge(Bytes message) {
    rpo_kit_imaging r;
    ASSERT_EQ(rpo_kit_get_imaging(data_of(message), static_cast<std::uint32_t>(message.size()), &r),
              1);
    const Truth* truth = nullptr;
    for (const Truth& t : truths_) {
      if (std::abs(to_ns(t.middle) - r.exposure_ns) < 1'000'000) truth = &t;
    }
    if (truth == nullptr) {
      ++score.wrong_times;
      return;
    }
    ++score.frames;
    score.lost_in_space += (r.found & RPO_KIT_FOUND_LOST) != 0 ? 1 : 0;
    if ((r.found & RPO_KIT_FOUND_ATTITUDE) != 0) judge_attitude(r, *truth);
    if ((r.found & RPO_KIT_FOUND_TARGET) != 0) judge_direction(r, *truth);
  }
  void judge_attitude(const rpo_kit_imaging& r, const Truth& truth) {
    const Mat3 D = to_matrix({r.q_CI[0], r.q_CI[1], r.q_CI[2], r.q_CI[3]}) * transpose(truth.R_CI);
    const double c = (D.row_x.x + D.row_y.y + D.row_z.z - 1) / 2;
    const Vec3 turn{(D.row_y.z - D.row_z.y) / 2, (D.row_z.x - D.row_x.z) / 2,
                    (D.row_x.y - D.row_y.x) / 2};
    const double angle_rad = std::atan2(norm(turn), c);
    ++score.attitudes;
    score.worst_attitude_rad = std::max(score.worst_attitude_rad, angle_rad);
    if (angle_rad > 0.1 * kDegree_rad) {
      ++score.wrong_attitudes;
      return;
    }
    const double* s = r.attitude_sigma_rad;
    const Vec3 z{turn.x / s[0], turn.y / s[1], turn.z / s[2]};
    score.attitude_chi2 += dot(z, z);
  }
  void judge_direction(const rpo_kit_imaging& r, const Truth& truth) {
    const Vec3 d{r.direction_ECI[0], r.direction_ECI[1], r.direction_ECI[2]};
    const double off_rad = norm(d - truth.direction_ECI);
    ++score.directions;
    score.worst_direction_rad = std::max(score.worst_direction_rad, off_rad);
    if (off_rad > 0.1 * kDegree_rad) {
      ++score.wrong_directions;
      return;
    }
    score.direction_squares += off_rad * off_rad / 2;
    score.sigma_squares += r.sigma_rad * r.sigma_rad;
    score.direction_chi2 += off_rad * off_rad / (r.sigma_rad * r.sigma_rad);
  }

  Camera* camera_ = nullptr;
  std::deque<Truth> truths_;
};

}  // namespace orrery::rendezvous
