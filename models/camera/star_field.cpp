#include <orrery/models/camera/star_field.hpp>

#include <algorithm>
#include <cmath>

namespace orrery {

namespace {

constexpr double kInstantsPerPixel = 2;
constexpr double kMostInstants = 512;
constexpr double kSlack_rad = 2e-3;  // aberration, proper motion over centuries, spill from outside

// One source during one exposure.
class Track {
 public:
  Track(const PinholeCamera& camera, const CameraPose& pose, const ExposureTime& exposure,
        const PointSource& source)
      : camera_(camera), pose_(pose), exposure_(exposure), source_(source) {}

  /// At `dt` [s] from the middle of the row's own exposure.
  std::optional<Pixel> at(double dt) const {
    std::optional<Pixel> pixel = seen(dt);
    if (exposure_.row_period_s == 0) return pixel;
    for (int i = 0; i < 2 && pixel; ++i) pixel = seen(dt + row_delay_s(pixel->v));
    return pixel;
  }

 private:
  double row_delay_s(double v) const {
    const double row = std::clamp(v, 0.0, camera_.height_px() - 1.0);
    return (row - 0.5 * (camera_.height_px() - 1)) * exposure_.row_period_s;
  }
  std::optional<Pixel> seen(double dt) const {
    const Vec3 line_ECI = source_.line_of_sight_ECI + dt * source_.rate_ECI_ps;
    return camera_.project(dt == 0 ? pose_.R_CI * line_ECI : pose_.R_CI_after(dt) * line_ECI);
  }

  const PinholeCamera& camera_;
  const CameraPose& pose_;
  const ExposureTime& exposure_;
  const PointSource& source_;
};

int instants(const std::optional<Pixel>& a, const std::optional<Pixel>& b) {
  if (!a || !b) return 1;
  const double path_px = std::hypot(b->u - a->u, b->v - a->v);
  return static_cast<int>(std::clamp(std::ceil(kInstantsPerPixel * path_px), 1.0, kMostInstants));
}

}  // namespace

namespace {

PointSink sink_into(ElectronImage& image, const Optics& optics) {
  return [&image, sigma_px = optics.options().psf_sigma_px](const Pixel& at, double electrons) {
    add_point(image, at, electrons, sigma_px);
  };
}

}  // namespace

std::optional<Pixel> add_source(ElectronImage& image, const PinholeCamera& camera,
                                const Optics& optics, const CameraPose& pose,
                                const ExposureTime& exposure, const PointSource& source) {
  return trace_source(sink_into(image, optics), camera, pose, exposure, source);
}

std::optional<Pixel> trace_source(const PointSink& sink, const PinholeCamera& camera,
                                  const CameraPose& pose, const ExposureTime& exposure,
                                  const PointSource& source) {
  const Track track(camera, pose, exposure, source);
  const std::optional<Pixel> middle = track.at(0);
  const double half = 0.5 * exposure.duration_s;
  const int count = instants(track.at(-half), track.at(half));
  const double electrons = source.electrons_ps * exposure.duration_s / count;
  for (int k = 0; k < count; ++k) {
    const double dt = count == 1 ? 0 : half * ((2 * k + 1.0) / count - 1);
    const std::optional<Pixel> at = track.at(dt);
    if (at) sink(*at, electrons);
  }
  return middle;
}

std::vector<DrawnPoint> StarField::draw(ElectronImage& image, const PinholeCamera& camera,
                                        const Optics& optics, const CameraPose& pose,
                                        const ExposureTime& exposure,
                                        const IsHidden& is_hidden) const {
  return trace(sink_into(image, optics), camera, optics, pose, exposure, is_hidden);
}

std::vector<DrawnPoint> StarField::trace(const PointSink& sink, const PinholeCamera& camera,
                                         const Optics& optics, const CameraPose& pose,
                                         const ExposureTime& exposure,
                                         const IsHidden& is_hidden) const {
  const double longest_s = exposure.duration_s + exposure.row_period_s * camera.height_px();
  const double reach = camera.half_field_rad() + kSlack_rad + norm(pose.omega_CI_C) * longest_s +
                       6 * optics.options().psf_sigma_px / std::min(camera.fx_px(), camera.fy_px());
  const double least_cosine = reach < 3.14 ? std::cos(reach) : -1;
  const Vec3 boresight_ECI = pose.R_CI.row_z;
  const Vec3 velocity_ECI = earth_velocity_ECI(pose.t) + pose.v_ECI;
  const double years = julian_years(pose.t);
  std::vector<DrawnPoint> drawn;
  for (const Star& star : catalogue_.stars()) {
    if (dot(star.direction_ECI, boresight_ECI) < least_cosine) continue;
    const Vec3 seen_ECI = aberrated(direction_ECI(star, years), velocity_ECI);
    if (is_hidden && is_hidden(seen_ECI)) continue;
    const PointSource source{seen_ECI, {}, optics.electrons_ps(star.magnitude)};
    const std::optional<Pixel> at = trace_source(sink, camera, pose, exposure, source);
    if (at && camera.is_inside(*at)) {
      drawn.push_back({star.number, *at, source.electrons_ps * exposure.duration_s});
    }
  }
  return drawn;
}

}  // namespace orrery
