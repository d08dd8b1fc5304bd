/// What OpenGL draws of a scene: the samples of a mesh, the Earth, points of light. Not installed.
#pragma once

#include <orrery/models/camera/gl_context.hpp>
#include <orrery/models/camera/image.hpp>
#include <orrery/models/camera/pixel_rays.hpp>
#include <orrery/models/frames/vector.hpp>

#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace orrery {

/// The same methods as on the CPU, in 32-bit floats; each call returns what it has drawn. What the
/// pixels are depends on the driver: with Mesa's llvmpipe on the kind of processor too.
class GlRenderer {
 public:
  /// @throws std::runtime_error  as GlContext::make; a driver that refuses a shader.
  explicit GlRenderer(GlPlatform platform);
  ~GlRenderer();

  using Float3 = float[3];
  /// A corner of a triangle; three for each.
  struct MeshVertex {
    float u = 0, v = 0;  // in samples
    float depth = 2;     // -1 near ... 1 far, linear in the image; 2: not seen
    float distance = 1;  // Z [m]
    Float3 position = {}, normal = {};
    // Of the triangle: cosine of the Sun's angle, radiances [suns/sr] by the Sun and the Earth,
    // factor and exponent of its lobe, its number.
    float cosine = 0, lambert = 0, earthshine = 0, lobe = 0, shininess = 1, id = 0;
  };
  struct MeshDrawing {
    int columns = 0, rows = 0;
    std::vector<MeshVertex> vertices = {};
    Vec3 to_sun{}, sun_x{}, sun_y{};  // axes of the shadow map
    Vec3 camera{};                    // all in the target's axes
    double radius_m = 1;
    int shadow_size = 512;
  };
  /// Radiance [suns/sr] of each sample, -1 where nothing is.
  std::vector<float> mesh(const MeshDrawing& drawing);

  struct EarthDrawing {
    Mat3 R_EC{};
    Vec3 beta_C{}, to_sun_E{}, p{};  // p: of the camera, radius 1, stretched along z
    double stretch = 1, sun = 1;
    double scale_height = 0, limb = 0;  // over the radius; reflectance, 0: no atmosphere
    bool glint = false;
    int cells = 1;                   // along an edge of a face of the surface
    const float* surface = nullptr;  // albedo and night, 6 faces
  };
  /// For each pixel its part of the irradiance [suns] and how much of it is covered.
  /// @param rays  The same object at each call.
  std::vector<std::pair<float, float>> earth(const EarthDrawing& drawing,
                                             const Image<PixelRay>& rays);

  struct Point {
    float u = 0, v = 0, electrons = 0;
  };
  void add_points(ElectronImage& image, const std::vector<Point>& points, double sigma_px);

 private:
  using Name = GlFunctions::Name;
  class Target;
  Name program(const char* vertex, const char* fragment);
  Name shader(unsigned type, const char* text);
  void attributes(std::initializer_list<int> sizes);
  int at(Name program, const char* uniform) const;
  void set(Name program, const char* uniform, const Vec3& value) const;
  void set(Name program, const char* uniform, double value) const;
  void set(Name program, const char* uniform, int value) const;
  Name texture(int internal_format, int width, int height, unsigned format, const void* data);
  void bind(int unit, Name texture) const;

  std::unique_ptr<GlContext> context_;
  const GlFunctions& gl_;
  Name array_ = 0, buffer_ = 0, framebuffer_ = 0;
  Name shadow_program_ = 0, mesh_program_ = 0, earth_program_ = 0, point_program_ = 0;
  Name rays_ = 0, surface_ = 0;  // textures, made at the first view of the Earth
};

}  // namespace orrery
