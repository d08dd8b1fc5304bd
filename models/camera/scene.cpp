#include <orrery/models/camera/blur.hpp>
#include <orrery/models/camera/celestial_disc.hpp>
#include <orrery/models/camera/gl_renderer.hpp>
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

std::unique_ptr<GlRenderer> gl_renderer(Renderer renderer) {
  if (renderer == Renderer::kCpu) return {};
  return std::make_unique<GlRenderer>(renderer == Renderer::kOsMesa ? GlPlatform::kOsMesa
                                      : renderer == Renderer::kEgl  ? GlPlatform::kEgl
                                                                    : GlPlatform::kAny);
}

// Calls work(k) for all values of an image.
template <class Work>
void for_all(int threads, const Image<float>& image, const Work& work) {
  for_bands_of_rows(threads, image.height_px, [&image, &work](int first, int end) {
    for (std::size_t k = image.index(0, first); k < image.index(0, end); ++k) work(k);
  });
}

// `upper` covers what `lower` has.
void cover(float& lower, float covered, float upper) {
  lower = lower * std::max(0.0f, 1 - covered) + upper;
}

// Of an image: all pixels that samples reach.
struct Part {
  int left_px = 0, top_px = 0, width_px = 0, height_px = 0;
};
Part part_of(const Image<float>& image, const MeshSamples& s, double sigma_px) {
  const double reach = std::ceil(5 * sigma_px) + 1;
  const auto within = [](double at, int size) {
    return static_cast<int>(std::clamp(at, 0.0, double(size)));
  };
  Part part{within(std::floor(s.left - reach), image.width_px),
            within(std::floor(s.top - reach), image.height_px)};
  part.width_px =
      within(std::ceil(s.left + s.columns / s.per_px_u + reach) + 1, image.width_px) - part.left_px;
  part.height_px =
      within(std::ceil(s.top + s.rows / s.per_px_v + reach) + 1, image.height_px) - part.top_px;
  return part;
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
  gl_ = gl_renderer(options_.renderer);
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
  frame.stars = draw_stars(frame.light, state, exposure, is_hidden);
  draw_stray_light(frame.light, state, exposure.duration_s);
  vignetting_.apply(frame.light, threads);
  return frame;
}

std::vector<DrawnPoint> Scene::draw_stars(ElectronImage& image, const SceneState& state,
                                          const ExposureTime& exposure,
                                          const StarField::IsHidden& is_hidden) const {
  if (!gl_) return stars_.draw(image, camera_, optics_, state.camera, exposure, is_hidden);
  std::vector<GlRenderer::Point> points;
  const auto sink = [&points](const Pixel& at, double electrons) {
    points.push_back({float(at.u), float(at.v), float(electrons)});
  };
  auto drawn = stars_.trace(sink, camera_, optics_, state.camera, exposure, is_hidden);
  gl_->add_points(image, points, optics_.options().psf_sigma_px);
  return drawn;
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
  bool is_empty = true;
  if (options_.sun_and_moon) {
    for (int k = 0; k < count; ++k) {
      const double dt = instant_s(k, count, exposure.duration_s);
      if (draw_discs(sky, state, state.camera.R_CI_after(dt), 1.0f / static_cast<float>(count))) {
        is_empty = false;
      }
    }
  }
  if (has_earth) {
    if (rays_.values.empty()) rays_ = pixel_rays(camera_);
    Image<float> suns(sky.width_px, sky.height_px), covered(sky.width_px, sky.height_px);
    for (int k = 0; k < count; ++k) {
      const double dt = count == 1 ? 0 : instant_s(k, count, exposure.duration_s);
      earth_.add(suns, covered, rays_, earth_pose(state, dt), 1.0f / static_cast<float>(count),
                 threads, gl_.get());
    }
    if (is_empty) {
      sky = std::move(suns);
    } else {
      for_all(threads, sky,
              [&](std::size_t k) { cover(sky.values[k], covered.values[k], suns.values[k]); });
    }
    is_empty = false;
  }
  if (is_empty) return;
  blur(sky, optics_.options().psf_sigma_px, threads);
  const float scale = static_cast<float>(optics_.electrons_ps_of_suns(exposure.duration_s));
  for_all(threads, sky, [&](std::size_t k) { frame.light.values[k] = scale * sky.values[k]; });
}

bool Scene::draw_discs(Image<float>& suns, const SceneState& state, const Mat3& R_CI,
                       float weight) const {
  const Vec3& r = state.camera.r_ECI;
  const Vec3 sun = state.r_sun_ECI - r, moon = state.r_moon_ECI - r;
  const auto seen_C = [&](const Vec3& line_ECI) {
    return R_CI * aberrated(unit(line_ECI), state.camera.v_ECI);
  };
  const double au = kAstronomicalUnit_m / norm(sun);
  const Vec3 sun_C = seen_C(sun);
  const double field = camera_.half_field_rad() + 0.02;
  const bool is_sun_near = sun_C.z > std::cos(std::min(field, 1.5));
  if (is_sun_near) {
    add_disc(
        suns, camera_,
        {.direction_C = sun_C, .radius_rad = std::asin(kRadiusSun_m / norm(sun)), .suns = au * au},
        weight);
  }
  const Vec3 moon_C = seen_C(moon);
  const bool is_moon_near = norm(state.r_moon_ECI) > 0 && moon_C.z > std::cos(std::min(field, 1.5));
  if (is_moon_near) {
    const double magnitude = moon_magnitude(state.r_moon_ECI, state.r_sun_ECI, r);
    add_disc(suns, camera_,
             {.direction_C = moon_C,
              .radius_rad = std::asin(kRadiusMoon_m / norm(moon)),
              .suns = std::pow(10.0, -0.4 * (magnitude - kSunMagnitude)),
              .is_lit = true,
              .to_sun_C = R_CI * unit(state.r_sun_ECI - state.r_moon_ECI)},
             weight);
  }
  return is_sun_near || is_moon_near;
}

struct Scene::TargetView {
  const Mesh& mesh;
  const TargetState& target;
  const CameraPose& camera;
  Lighting light;
  double row_s = 0;  // from the middle of the exposure to that of the row of its middle

  Vec3 r_TC_ECI() const { return target.r_ECI - camera.r_ECI; }
  Vec3 v_TC_ECI() const { return target.v_ECI - camera.v_ECI; }
  MeshPose at(double dt) const {
    return {.R_CI = camera.R_CI_after(row_s + dt),
            .R_TI = rotation_by((row_s + dt) * target.omega_TI_T) * target.R_TI,
            .r_TC_ECI = r_TC_ECI() + (row_s + dt) * v_TC_ECI()};
  }
};

bool Scene::is_behind_the_earth(const Vec3& r_TC_ECI, const SceneState& state) const {
  if (!options_.earth) return false;
  const double distance = norm(r_TC_ECI);
  const double to_tangent = -dot(state.camera.r_ECI, r_TC_ECI) / distance;
  return distance > to_tangent && earth_.hides(r_TC_ECI / distance, earth_pose(state, 0));
}

std::optional<SeenTarget> Scene::draw_target(SceneFrame& frame, Image<float>& covered,
                                             std::size_t index, const SceneState& state,
                                             const ExposureTime& exposure, int threads) const {
  TargetView view{.mesh = options_.targets[index],
                  .target = state.targets[index],
                  .camera = state.camera,
                  .light = lighting_at(state.targets[index].r_ECI, state.r_sun_ECI)};
  const Vec3 r_TC = view.r_TC_ECI();
  const std::optional<Pixel> origin = camera_.project(state.camera.R_CI * r_TC);
  if (!origin || is_behind_the_earth(r_TC, state)) return {};
  const double middle_row = 0.5 * (camera_.height_px() - 1);
  view.row_s = (std::clamp(origin->v, 0.0, 2 * middle_row) - middle_row) * exposure.row_period_s;
  const MeshSamples samples =
      sample_mesh(view.mesh, camera_, view.at(0), view.light, threads, gl_.get());
  SeenTarget seen{
      .origin = *origin,
      .photocentre = samples.suns.empty() ? *origin : samples.photocentre(),
      .electrons = optics_.electrons_ps_of_suns(samples.total_suns()) * exposure.duration_s,
      .size_px = 2 * view.mesh.radius_m() * focal_px(camera_) / norm(r_TC)};
  if (samples.suns.empty()) return seen;
  if (seen.size_px < kPointBelow_px) {
    draw_point(frame.light, view, seen, exposure);
  } else {
    draw_mesh(frame.light, covered, view, samples, exposure, threads);
  }
  return seen;
}

void Scene::draw_point(ElectronImage& image, const TargetView& view, const SeenTarget& seen,
                       const ExposureTime& exposure) const {
  if (!camera_.is_inside(seen.photocentre, 8 * optics_.options().psf_sigma_px)) return;
  const MeshPose pose = view.at(0);
  const Vec3 line_C = norm(pose.r_TC_ECI) * camera_.direction_C(seen.photocentre);
  const Vec3 line_ECI = transpose(pose.R_CI) * line_C;
  add_source(image, camera_, optics_, view.camera, exposure,
             {.line_of_sight_ECI = line_ECI - view.row_s * view.v_TC_ECI(),
              .rate_ECI_ps = view.v_TC_ECI(),
              .electrons_ps = seen.electrons / exposure.duration_s});
}

void Scene::draw_mesh(ElectronImage& image, Image<float>& covered, const TargetView& view,
                      const MeshSamples& middle, const ExposureTime& exposure, int threads) const {
  const auto origin_at = [&](double dt) {
    const MeshPose pose = view.at(dt);
    return camera_.project(pose.R_CI * pose.r_TC_ECI);
  };
  const double half = 0.5 * exposure.duration_s;
  const std::optional<Pixel> begin = origin_at(-half), end = origin_at(half);
  const int count = begin && end ? instants(std::hypot(end->u - begin->u, end->v - begin->v)) : 1;
  const double sigma_px = optics_.options().psf_sigma_px;
  // With one instant the light's extent is known.
  const Part part =
      count == 1 ? part_of(image, middle, sigma_px) : Part{0, 0, image.width_px, image.height_px};
  if (part.width_px <= 0 || part.height_px <= 0) return;
  ElectronImage layer(part.width_px, part.height_px);
  Image<float> layer_covered(part.width_px, part.height_px);
  const double electrons_per_sun = optics_.electrons_ps_of_suns(exposure.duration_s);
  for (int k = 0; k < count; ++k) {
    const MeshPose pose = view.at(instant_s(k, count, exposure.duration_s));
    add_samples(
        layer, layer_covered,
        count == 1 ? middle : sample_mesh(view.mesh, camera_, pose, view.light, threads, gl_.get()),
        electrons_per_sun, sigma_px, 1.0 / count, threads, part.left_px, part.top_px);
  }
  if (covered.values.empty()) covered = Image<float>(image.width_px, image.height_px);
  for_bands_of_rows(threads, part.height_px, [&](int first_row, int end_row) {
    for (int row = first_row; row < end_row; ++row) {
      const std::size_t to = image.index(part.left_px, part.top_px + row);
      const std::size_t from = layer.index(0, row);
      for (std::size_t k = 0; k < static_cast<std::size_t>(part.width_px); ++k) {
        const float upper_covered = layer_covered.values[from + k];
        cover(image.values[to + k], upper_covered, layer.values[from + k]);
        covered.values[to + k] = std::max(covered.values[to + k], upper_covered);
      }
    }
  });
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
