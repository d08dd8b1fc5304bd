#include <orrery/models/camera/blur.hpp>
#include <orrery/models/camera/celestial_disc.hpp>
#include <orrery/models/camera/parallel_rows.hpp>
#include <orrery/models/camera/scene.hpp>
#include <orrery/models/orbit/earth.hpp>
#include <orrery/models/orbit/shadow.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

namespace orrery {

namespace {

constexpr double kPointBelow_px = 1;
constexpr int kMostInstants = 16;

// Instants half a pixel apart over a path.
int instants(double path_px) {
  return std::clamp(static_cast<int>(std::ceil(2 * path_px)), 1, kMostInstants);
}

// From the middle of the exposure [s], for instant k of n.
double instant_s(int k, int n, double duration_s) {
  return duration_s * ((k + 0.5) / n - 0.5);
}

double focal_px(const PinholeCamera& camera) {
  return std::max(camera.fx_px(), camera.fy_px());
}

// `upper` covers what `lower` has.
void cover(ElectronImage& lower, const Image<float>& covered, const ElectronImage& upper) {
  for (std::size_t k = 0; k < lower.values.size(); ++k) {
    lower.values[k] = lower.values[k] * std::max(0.0f, 1 - covered.values[k]) + upper.values[k];
  }
}

}  // namespace

Scene::Scene(const PinholeCamera& camera, const OpticsOptions& optics, SceneOptions options)
    : camera_(camera),
      optics_(optics),
      options_(std::move(options)),
      earth_(options_.earth_view),
      stars_(options_.stars),
      vignetting_(camera, optics.vignetting_power) {
  check(options_.stray_light);
  for (const Mesh& mesh : options_.targets) {
    if (mesh.triangles().empty()) {
      throw std::invalid_argument("Scene: a target without triangles");
    }
  }
}

Scene::~Scene() = default;

SceneFrame Scene::render(const SceneState& state, const ExposureTime& exposure, int threads) {
  if (state.targets.size() != options_.targets.size()) {
    throw std::invalid_argument("Scene::render: " + std::to_string(state.targets.size()) +
                                " states of targets; expected " +
                                std::to_string(options_.targets.size()));
  }
  SceneFrame frame;
  frame.light = ElectronImage(camera_.width_px(), camera_.height_px());
  draw_background(frame, state, exposure, threads);
  frame.targets.resize(options_.targets.size());
  std::vector<std::size_t> order(options_.targets.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&state](std::size_t a, std::size_t b) {
    return norm(state.targets[a].r_ECI - state.camera.r_ECI) >
           norm(state.targets[b].r_ECI - state.camera.r_ECI);
  });
  Image<float> covered;  // by targets that are larger than a point
  for (const std::size_t k : order) {
    frame.targets[k] = draw_target(frame, covered, k, state, exposure, threads);
  }
  const EarthPose earth = earth_pose(state, 0);
  const bool is_earth_near = options_.earth && earth_.is_in_view(camera_, earth);
  const auto is_hidden = [&](const Vec3& u_ECI) {
    if (is_earth_near && earth_.hides(u_ECI, earth)) return true;
    if (covered.values.empty()) return false;
    const std::optional<Pixel> at = camera_.project(state.camera.R_CI * u_ECI);
    if (!at || !camera_.is_inside(*at)) return false;
    const int u = std::clamp(static_cast<int>(std::lround(at->u)), 0, covered.width_px - 1);
    const int v = std::clamp(static_cast<int>(std::lround(at->v)), 0, covered.height_px - 1);
    return covered.at(u, v) > 0.5f;
  };
  frame.stars = stars_.draw(frame.light, camera_, optics_, state.camera, exposure, is_hidden);
  draw_stray_light(frame.light, state, exposure.duration_s);
  vignetting_.apply(frame.light, threads);
  return frame;
}

EarthPose Scene::earth_pose(const SceneState& state, double dt_s) const {
  const CameraPose& c = state.camera;
  const double au = kAstronomicalUnit_m / norm(state.r_sun_ECI);
  return {.R_CI = dt_s == 0 ? c.R_CI : c.R_CI_after(dt_s),
          .R_EI = state.R_EI,
          .r_ECI = c.r_ECI + dt_s * c.v_ECI,
          .v_ECI = c.v_ECI,
          .to_sun_ECI = unit(state.r_sun_ECI),
          .sun = au * au};
}

void Scene::draw_background(SceneFrame& frame, const SceneState& state,
                            const ExposureTime& exposure, int threads) {
  const EarthPose earth = earth_pose(state, 0);
  const bool has_earth = options_.earth && earth_.is_in_view(camera_, earth);
  const int count =
      instants(norm(state.camera.omega_CI_C) * exposure.duration_s * focal_px(camera_));
  Image<float> sky(frame.light.width_px, frame.light.height_px);
  if (options_.sun_and_moon) {
    for (int k = 0; k < count; ++k) {
      const double dt = instant_s(k, count, exposure.duration_s);
      draw_discs(sky, state, state.camera.R_CI_after(dt), 1.0f / static_cast<float>(count));
    }
  }
  if (has_earth) {
    if (rays_.values.empty()) rays_ = pixel_rays(camera_);
    Image<float> suns(sky.width_px, sky.height_px), covered(sky.width_px, sky.height_px);
    for (int k = 0; k < count; ++k) {
      const double dt = count == 1 ? 0 : instant_s(k, count, exposure.duration_s);
      earth_.add(suns, covered, rays_, earth_pose(state, dt), 1.0f / static_cast<float>(count),
                 threads);
    }
    cover(sky, covered, suns);
  }
  const bool is_empty = !has_earth && std::all_of(sky.values.begin(), sky.values.end(),
                                                  [](float suns) { return suns == 0; });
  if (is_empty) return;
  blur(sky, optics_.options().psf_sigma_px, threads);
  const float scale = static_cast<float>(optics_.electrons_ps_of_suns(exposure.duration_s));
  for (std::size_t k = 0; k < sky.values.size(); ++k) {
    frame.light.values[k] = scale * sky.values[k];
  }
}

void Scene::draw_discs(Image<float>& suns, const SceneState& state, const Mat3& R_CI,
                       float weight) const {
  const Vec3& r = state.camera.r_ECI;
  const Vec3 sun = state.r_sun_ECI - r, moon = state.r_moon_ECI - r;
  const auto seen_C = [&](const Vec3& line_ECI) {
    return R_CI * aberrated(unit(line_ECI), state.camera.v_ECI);
  };
  const double au = kAstronomicalUnit_m / norm(sun);
  const Vec3 sun_C = seen_C(sun);
  const double field = camera_.half_field_rad() + 0.02;
  if (sun_C.z > std::cos(std::min(field, 1.5))) {
    add_disc(
        suns, camera_,
        {.direction_C = sun_C, .radius_rad = std::asin(kRadiusSun_m / norm(sun)), .suns = au * au},
        weight);
  }
  const Vec3 moon_C = seen_C(moon);
  if (norm(state.r_moon_ECI) > 0 && moon_C.z > std::cos(std::min(field, 1.5))) {
    const double magnitude = moon_magnitude(state.r_moon_ECI, state.r_sun_ECI, r);
    add_disc(suns, camera_,
             {.direction_C = moon_C,
              .radius_rad = std::asin(kRadiusMoon_m / norm(moon)),
              .suns = std::pow(10.0, -0.4 * (magnitude - kSunMagnitude)),
              .is_lit = true,
              .to_sun_C = R_CI * unit(state.r_sun_ECI - state.r_moon_ECI)},
             weight);
  }
}

std::optional<SeenTarget> Scene::draw_target(SceneFrame& frame, Image<float>& covered,
                                             std::size_t index, const SceneState& state,
                                             const ExposureTime& exposure, int threads) const {
  const Mesh& mesh = options_.targets[index];
  const TargetState& target = state.targets[index];
  const CameraPose& camera = state.camera;
  const Vec3 r_TC = target.r_ECI - camera.r_ECI, v_TC = target.v_ECI - camera.v_ECI;
  const double distance = norm(r_TC);
  const std::optional<Pixel> origin = camera_.project(camera.R_CI * r_TC);
  if (!origin) return {};
  const EarthPose earth = earth_pose(state, 0);
  if (options_.earth && earth_.hides(r_TC / distance, earth) &&
      distance > -dot(camera.r_ECI, r_TC) / distance) {
    return {};
  }
  const Lighting light = lighting_at(target.r_ECI, state.r_sun_ECI);
  const double per_sun = optics_.electrons_ps_of_suns(1);
  const double row_s =
      (std::clamp(origin->v, 0.0, camera_.height_px() - 1.0) - 0.5 * (camera_.height_px() - 1)) *
      exposure.row_period_s;
  const auto pose_at = [&](double dt) {
    return MeshPose{.R_CI = camera.R_CI_after(dt),
                    .R_TI = rotation_by(dt * target.omega_TI_T) * target.R_TI,
                    .r_TC_ECI = r_TC + dt * v_TC};
  };
  const MeshSamples middle = sample_mesh(mesh, camera_, pose_at(row_s), light, threads);
  SeenTarget seen{.origin = *origin,
                  .photocentre = middle.suns.empty() ? *origin : middle.photocentre(),
                  .electrons = middle.total_suns() * per_sun * exposure.duration_s,
                  .size_px = 2 * mesh.radius_m() * focal_px(camera_) / distance};
  if (middle.suns.empty()) return seen;
  if (seen.size_px < kPointBelow_px) {
    const Mat3 R_IC = transpose(camera.R_CI_after(row_s));
    const Vec3 line_C = distance * camera_.direction_C(seen.photocentre);
    add_source(frame.light, camera_, optics_, camera, exposure,
               {.line_of_sight_ECI = R_IC * line_C - row_s * v_TC,
                .rate_ECI_ps = v_TC,
                .electrons_ps = middle.total_suns() * per_sun});
    return seen;
  }
  const double half = 0.5 * exposure.duration_s;
  const std::optional<Pixel> begin =
      camera_.project(pose_at(row_s - half).R_CI * pose_at(row_s - half).r_TC_ECI);
  const std::optional<Pixel> end =
      camera_.project(pose_at(row_s + half).R_CI * pose_at(row_s + half).r_TC_ECI);
  const int count = begin && end ? instants(std::hypot(end->u - begin->u, end->v - begin->v)) : 1;
  ElectronImage layer(frame.light.width_px, frame.light.height_px);
  Image<float> layer_covered(frame.light.width_px, frame.light.height_px);
  for (int k = 0; k < count; ++k) {
    const double dt = row_s + instant_s(k, count, exposure.duration_s);
    add_samples(layer, layer_covered,
                count == 1 ? middle : sample_mesh(mesh, camera_, pose_at(dt), light, threads),
                per_sun * exposure.duration_s, optics_.options().psf_sigma_px, 1.0 / count);
  }
  cover(frame.light, layer_covered, layer);
  if (covered.values.empty()) {
    covered = std::move(layer_covered);
  } else {
    for (std::size_t k = 0; k < covered.values.size(); ++k) {
      covered.values[k] = std::max(covered.values[k], layer_covered.values[k]);
    }
  }
  return seen;
}

void Scene::draw_stray_light(ElectronImage& image, const SceneState& state,
                             double exposure_s) const {
  const StrayLightOptions& stray = options_.stray_light;
  const Vec3& r = state.camera.r_ECI;
  if (stray.sun_electrons_ps > 0) {
    add_stray_light(image, camera_,
                    {.direction_C = state.camera.R_CI * unit(state.r_sun_ECI - r),
                     .electrons_ps = stray.sun_electrons_ps *
                                     sunlit_fraction(shadow_geometry(r, state.r_sun_ECI))},
                    stray.exponent, exposure_s);
  }
  if (stray.earth_electrons_ps > 0) {
    const double cosine = dot(unit(r), unit(state.r_sun_ECI));
    add_stray_light(image, camera_,
                    {.direction_C = state.camera.R_CI * unit(-r),
                     .radius_rad = std::asin(std::min(1.0, kRadiusEarth_m / norm(r))),
                     .electrons_ps = stray.earth_electrons_ps *
                                     lambert_phase(std::acos(std::clamp(cosine, -1.0, 1.0)))},
                    stray.exponent, exposure_s);
  }
}

}  // namespace orrery
