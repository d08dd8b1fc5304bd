#include "rpo_kit/imaging/frame_processor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rpo_kit/imaging/earth_velocity.hpp"

namespace rpo_kit {

using namespace flight_support;

namespace {

IdentificationOptions with_field(IdentificationOptions options, double field_radius_rad) {
  options.field_radius_rad = field_radius_rad;
  return options;
}

Mat3 cross_matrix(const Vec3& a) {
  return Mat3{{{0.0, -a[2], a[1]}, {a[2], 0.0, -a[0]}, {-a[1], a[0], 0.0}}};
}

}  // namespace

FrameProcessor::FrameProcessor(const ImagingOptions& options, std::vector<Star> stars)
    : options_(options),
      catalogue_(std::move(stars), options.pair_magnitude, 2.0 * options.field_radius_rad),
      identifier_(catalogue_, with_field(options.identification, options.field_radius_rad)),
      detector_(options.width, options.height, options.detection),
      tracker_(options.tracker, detector_.hot_sharpness()) {}

// First from where the camera looked before: in RTN it hardly turns.
bool FrameProcessor::find_attitude(const Vec3& v_ECI, const Mat3& R_HI, FrameReport* report) {
  bool known = has_attitude_ && identifier_.track(stars_, v_ECI, R_CH_ * R_HI,
                                                  options_.pointing_rad, &identification_);
  if (!known) {
    report->lost_in_space = true;
    known = identifier_.lost_in_space(stars_, v_ECI, &identification_);
  }
  report->attitude_known = known;
  if (!known) return false;
  has_attitude_ = true;
  report->identified = identification_.identified;
  report->attitude = identification_.attitude;
  R_CH_ = report->attitude.R_CI * transpose(R_HI);
  return true;
}

// Root mean square of the two axes across it.
double FrameProcessor::direction_sigma(const SeenSource& source, const Attitude& attitude) const {
  const Mat3 X = cross_matrix(source.direction_C);
  const Mat3 turned = X * attitude.covariance_C * transpose(X);
  const double variance = 0.5 * (turned(0, 0) + turned(1, 1) + turned(2, 2));
  return std::hypot(std::hypot(source.sigma_rad, options_.systematic_rad), std::sqrt(variance));
}

// With a star: both together are one source, somewhere between them.
bool FrameProcessor::is_blended(const Camera& camera, const Vec3& direction_ECI) const {
  const double least = std::cos(options_.blend_px / std::min(camera.fx, camera.fy));
  return std::any_of(catalogue_.stars().begin(), catalogue_.stars().end(), [&](const Star& star) {
    return dot(star.direction_ECI, direction_ECI) > least;
  });
}

void FrameProcessor::find_target(const FrameHeader& header, const Mat3& R_HI,
                                 const ExpectedTarget* expected, FrameReport* report) {
  const Mat3 R_IC = transpose(report->attitude.R_CI);
  unknown_.clear();
  const double swing = expected == nullptr ? 0.0 : options_.swing_m / expected->range_m;
  tracker_.set_max_rate(std::clamp(swing, options_.search_rate, options_.most_rate));
  for (std::size_t k = 0; k < seen_.size(); ++k) {
    if (k < identification_.star.size() && identification_.star[k] >= 0) continue;
    unknown_.push_back(
        {found_[k], R_IC * seen_[k].direction_C, direction_sigma(seen_[k], report->attitude)});
  }
  tracker_.frame(header.t_ns, R_HI, unknown_);
  const Track* target = nullptr;
  if (expected == nullptr) {
    target = tracker_.target();
  } else {
    const Vec3 direction_H = R_HI * expected->direction_ECI;
    target = tracker_.target(&direction_H, expected->reach_rad);
  }
  if (target == nullptr || target->source < 0 || target->t_ns != header.t_ns) return;
  const UnknownSource& source = unknown_[static_cast<std::size_t>(target->source)];
  if (is_blended(header.camera, source.direction_ECI)) return;
  const double size_rad =
      expected == nullptr ? 0.0 : options_.target_size_m / std::max(expected->range_m, 1.0);
  report->target = true;
  report->bearing = {header.t_ns, source.direction_ECI, std::hypot(source.sigma_rad, size_rad)};
  report->pixel = {source.detection.u, source.detection.v};
}

bool FrameProcessor::process(const FrameHeader& header, const ImageView& image, const Observer& own,
                             const ExpectedTarget* expected, FrameReport* report) {
  *report = FrameReport();
  report->t_ns = header.t_ns;
  detector_.set_conversion(header.electrons_per_dn, header.saturation_dn);
  if (!detector_.detect(image, &found_)) return false;
  const Camera& camera = header.camera;
  std::size_t kept = 0;
  seen_.clear();
  for (const Detection& detection : found_) {
    SeenSource source;
    if (!unproject(camera, {detection.u, detection.v}, &source.direction_C)) continue;
    source.sigma_rad = detection.sigma_px / std::sqrt(camera.fx * camera.fy);
    seen_.push_back(source);
    found_[kept++] = detection;
  }
  found_.resize(kept);
  report->sources = static_cast<int>(kept);
  const std::size_t most = static_cast<std::size_t>(options_.most_stars);
  stars_.assign(seen_.begin(),
                seen_.begin() + static_cast<std::ptrdiff_t>(std::min(most, seen_.size())));

  const StateEci state = state_from_osculating(osculating_from_mean(own.mean));
  const Mat3 R_HI = eci_to_rtn(state);
  if (!find_attitude(earth_velocity_ECI(header.t_ns) + state.v_ECI, R_HI, report)) return true;
  find_target(header, R_HI, expected, report);
  return true;
}

}  // namespace rpo_kit
