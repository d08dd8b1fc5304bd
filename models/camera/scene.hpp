/// All that a camera sees during one exposure: stars, Earth, Moon, Sun, other spacecraft.
#pragma once

#include <orrery/models/camera/earth_view.hpp>
#include <orrery/models/camera/exposure.hpp>
#include <orrery/models/camera/mesh.hpp>
#include <orrery/models/camera/mesh_view.hpp>
#include <orrery/models/camera/optics.hpp>
#include <orrery/models/camera/star_field.hpp>
#include <orrery/models/camera/stray_light.hpp>

#include <memory>
#include <optional>
#include <vector>

namespace orrery {

class GlRenderer;

/// kOpenGl: OSMesa where it is installed, else EGL without a surface. See the README.
enum class Renderer { kCpu, kOpenGl, kOsMesa, kEgl };

struct SceneOptions {
  StarCatalogue stars = {};
  bool earth = true;
  EarthViewOptions earth_view = {};
  bool sun_and_moon = true;
  StrayLightOptions stray_light = {};
  /// Other spacecraft, in the order of SceneState::targets.
  std::vector<Mesh> targets = {};
  Renderer renderer = Renderer::kCpu;
};

/// At the middle of the exposure; turns and moves evenly during it.
struct TargetState {
  Vec3 r_ECI{}, v_ECI{};
  Mat3 R_TI{};
  Vec3 omega_TI_T{};
};
struct SceneState {
  CameraPose camera = {};
  Mat3 R_EI{};
  Vec3 r_sun_ECI{}, r_moon_ECI{};  // geocentric [m]
  std::vector<TargetState> targets = {};
};

/// What was drawn, for comparison.
struct SeenTarget {
  Pixel origin{};  // of the target's axes, at the middle of the exposure
  Pixel photocentre{};
  double electrons = 0;  // all of its light, in the image or not
  double size_px = 0;    // of its sphere across
};
struct SceneFrame {
  ElectronImage light;
  std::vector<DrawnPoint> stars;
  std::vector<std::optional<SeenTarget>> targets;  // none: behind the camera or the Earth
};

/// Method      From the far to the near: Sun and Moon as discs, the Earth over them, both through
/// the PSF;
///             stars whose centre nothing hides; then the targets, the nearest last. A target is
///             always its mesh, sampled at least 128 times across: below 1 px its samples' sum is
///             drawn as one point at their centre of light, above as they are, so that its flux
///             does not change there. Motion: stars and points as tracks; meshes as the mean of up
///             to 16 instants, the Earth and discs likewise, half a pixel apart where that
///             suffices. Rolling shutter: a mesh at the time of the row of its middle, Earth and
///             discs at that of the middle row.
/// Not there   Shadows and light of one target on another, and of the Moon; stars through the
///             atmosphere above the solid Earth's edge are not dimmed.
/// OpenGL      Draws stars, Earth and meshes in 32-bit floats by the same steps; points, Moon, Sun,
///             PSF and stray light stay on the CPU. Pixels are then the driver's: equal on OSMesa
///             and EGL of one Mesa, for any number of its threads, not on every processor.
/// Checked by  test_suites/unit/models/camera/scene_test.cpp, gl_renderer_test.cpp
class Scene {
 public:
  /// @throws std::invalid_argument  an option outside its range; a target without triangles.
  ///         std::runtime_error     no OpenGL where it is asked for; says what to install.
  Scene(const PinholeCamera& camera, const OpticsOptions& optics, SceneOptions options);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  const PinholeCamera& camera() const { return camera_; }
  const Optics& optics() const { return optics_; }
  /// The same bits for any number of threads.
  /// @throws std::invalid_argument  as many targets as the options have are needed.
  SceneFrame render(const SceneState& state, const ExposureTime& exposure, int threads = 1);

 private:
  std::vector<DrawnPoint> draw_stars(ElectronImage& image, const SceneState& state,
                                     const ExposureTime& exposure,
                                     const StarField::IsHidden& is_hidden) const;
  void draw_background(SceneFrame& frame, const SceneState& state, const ExposureTime& exposure,
                       int threads);
  // False: none is near the image.
  bool draw_discs(Image<float>& suns, const SceneState& state, const Mat3& R_CI,
                  float weight) const;
  std::optional<SeenTarget> draw_target(SceneFrame& frame, Image<float>& covered, std::size_t index,
                                        const SceneState& state, const ExposureTime& exposure,
                                        int threads) const;
  struct TargetView;
  bool is_behind_the_earth(const Vec3& r_TC_ECI, const SceneState& state) const;
  void draw_point(ElectronImage& image, const TargetView& view, const SeenTarget& seen,
                  const ExposureTime& exposure) const;
  void draw_mesh(ElectronImage& image, Image<float>& covered, const TargetView& view,
                 const MeshSamples& middle, const ExposureTime& exposure, int threads) const;
  void draw_stray_light(ElectronImage& image, const SceneState& state, double exposure_s) const;
  EarthPose earth_pose(const SceneState& state, double dt_s) const;

  PinholeCamera camera_;
  Optics optics_;
  SceneOptions options_;
  EarthView earth_;
  StarField stars_;
  Vignetting vignetting_;
  Image<PixelRay> rays_;            // empty until the Earth is in view
  std::unique_ptr<GlRenderer> gl_;  // null: on the CPU
};

}  // namespace orrery
