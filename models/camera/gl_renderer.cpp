#include <orrery/models/camera/gl_renderer.hpp>
#include <orrery/models/camera/gl_shaders.hpp>

#include <cmath>
#include <cstdint>
#include <numeric>
#include <stdexcept>

namespace orrery {

namespace {

// Of the specification of OpenGL 3.3, appendix of enumerants.
constexpr unsigned kTriangles = 0x4, kLessOrEqual = 0x203, kOne = 1, kTexture2d = 0xDE1;
constexpr unsigned kDepthTest = 0xB71, kBlend = 0xBE2, kColour = 0x1800, kDepth = 0x1801;
constexpr unsigned kFloat = 0x1406, kRed = 0x1903, kRg = 0x8227, kRgba = 0x1908;
constexpr unsigned kDepthComponent = 0x1902;
constexpr int kR32f = 0x822E, kRg32f = 0x8230, kRgba32f = 0x8814, kDepth32f = 0x8CAC;
constexpr unsigned kArrayBuffer = 0x8892, kStreamDraw = 0x88E0;
constexpr unsigned kFramebuffer = 0x8D40, kColour0 = 0x8CE0, kDepthAttachment = 0x8D00;
constexpr unsigned kComplete = 0x8CD5, kTexture0 = 0x84C0;
constexpr unsigned kMinFilter = 0x2801, kMagFilter = 0x2800, kNearest = 0x2600;
constexpr unsigned kVertexShader = 0x8B31, kFragmentShader = 0x8B30;
constexpr unsigned kCompileStatus = 0x8B81, kLinkStatus = 0x8B82, kPackAlignment = 0xD05;

constexpr int kFloatsPerVertex = sizeof(GlRenderer::MeshVertex) / sizeof(float);

}  // namespace

/// Textures that are drawn to, and the viewport.
class GlRenderer::Target {
 public:
  Target(GlRenderer& renderer, int width, int height, int format, unsigned components, float clear,
         bool has_depth)
      : renderer_(renderer), width_(width), height_(height), components_(components) {
    const GlFunctions& gl = renderer.gl_;
    colour_ = renderer.texture(format, width, height, components, nullptr);
    gl.BindFramebuffer(kFramebuffer, renderer.framebuffer_);
    gl.FramebufferTexture2D(kFramebuffer, kColour0, kTexture2d, colour_, 0);
    if (has_depth) depth_ = renderer.texture(kDepth32f, width, height, kDepthComponent, nullptr);
    gl.FramebufferTexture2D(kFramebuffer, kDepthAttachment, kTexture2d, depth_, 0);
    if (gl.CheckFramebufferStatus(kFramebuffer) != kComplete) {
      throw std::runtime_error("camera: OpenGL does not draw to floats here");
    }
    gl.Viewport(0, 0, width, height);
    const float colour[4] = {clear, clear, clear, clear}, farthest[1] = {1};
    gl.ClearBufferfv(kColour, 0, colour);
    if (has_depth) gl.ClearBufferfv(kDepth, 0, farthest);
    gl.DepthFunc(kLessOrEqual);
    has_depth ? gl.Enable(kDepthTest) : gl.Disable(kDepthTest);
  }
  ~Target() {
    const Name both[2] = {colour_, depth_};
    renderer_.gl_.DeleteTextures(2, both);
  }
  Target(const Target&) = delete;
  Target& operator=(const Target&) = delete;

  Name colour() const { return colour_; }
  void read(float* to) const {
    renderer_.gl_.ReadPixels(0, 0, width_, height_, components_, kFloat, to);
    if (renderer_.gl_.GetError() != 0) throw std::runtime_error("camera: OpenGL drew with errors");
  }

 private:
  GlRenderer& renderer_;
  int width_, height_;
  unsigned components_;
  Name colour_ = 0, depth_ = 0;
};

GlRenderer::GlRenderer(GlPlatform platform)
    : context_(GlContext::make(platform)), gl_(context_->gl()) {
  const GlContext::Current current(*context_);
  gl_.GenVertexArrays(1, &array_);
  gl_.GenBuffers(1, &buffer_);
  gl_.GenFramebuffers(1, &framebuffer_);
  gl_.BindVertexArray(array_);
  gl_.BindBuffer(kArrayBuffer, buffer_);
  gl_.PixelStorei(kPackAlignment, 1);
  gl_.BlendFunc(kOne, kOne);
  shadow_program_ = program(kShadowVertex, kShadowFragment);
  mesh_program_ = program(kMeshVertex, kMeshFragment);
  earth_program_ = program(kWholeVertex, kEarthFragment);
  point_program_ = program(kPointVertex, kPointFragment);
}

GlRenderer::~GlRenderer() = default;

std::vector<float> GlRenderer::mesh(const MeshDrawing& d) {
  const GlContext::Current current(*context_);
  const int count = static_cast<int>(d.vertices.size());
  gl_.BufferData(kArrayBuffer, count * kFloatsPerVertex * 4, d.vertices.data(), kStreamDraw);
  attributes({4, 3, 3, 4, 2});
  const Target shadows(*this, d.shadow_size, d.shadow_size, kRg32f, kRg, -1, true);
  for (const Name p : {shadow_program_, mesh_program_}) {
    gl_.UseProgram(p);
    set(p, "to_sun", d.to_sun);
    set(p, "sun_x", d.sun_x);
    set(p, "sun_y", d.sun_y);
    set(p, "radius", d.radius_m);
  }
  gl_.UseProgram(shadow_program_);
  gl_.DrawArrays(kTriangles, 0, count);

  const Target samples(*this, d.columns, d.rows, kR32f, kRed, -1, true);
  gl_.UseProgram(mesh_program_);
  gl_.Uniform2f(at(mesh_program_, "size"), float(d.columns), float(d.rows));
  set(mesh_program_, "camera", d.camera);
  set(mesh_program_, "shadow_size", d.shadow_size);
  set(mesh_program_, "shadows", 0);
  bind(0, shadows.colour());
  gl_.DrawArrays(kTriangles, 0, count);
  std::vector<float> radiance(static_cast<std::size_t>(d.columns) *
                              static_cast<std::size_t>(d.rows));
  samples.read(radiance.data());
  return radiance;
}

std::vector<std::pair<float, float>> GlRenderer::earth(const EarthDrawing& d,
                                                       const Image<PixelRay>& rays) {
  static_assert(sizeof(PixelRay) == 4 * sizeof(float));
  static_assert(sizeof(std::pair<float, float>) == 2 * sizeof(float));
  const GlContext::Current current(*context_);
  if (rays_ == 0) {
    rays_ = texture(kRgba32f, rays.width_px, rays.height_px, kRgba, rays.values.data());
    surface_ = texture(kRg32f, d.cells, 6 * d.cells, kRg, d.surface);
  }
  const Target sky(*this, rays.width_px, rays.height_px, kRg32f, kRg, 0, false);
  const Name p = earth_program_;
  gl_.UseProgram(p);
  // By rows, as GLSL has it by columns: transposed.
  const Mat3& R = d.R_EC;
  const float R_EC[9] = {float(R.row_x.x), float(R.row_x.y), float(R.row_x.z),
                         float(R.row_y.x), float(R.row_y.y), float(R.row_y.z),
                         float(R.row_z.x), float(R.row_z.y), float(R.row_z.z)};
  gl_.UniformMatrix3fv(at(p, "R_EC"), 1, 1, R_EC);
  set(p, "beta_C", d.beta_C);
  set(p, "to_sun", d.to_sun_E);
  set(p, "p", d.p);
  set(p, "stretch", d.stretch);
  set(p, "sun", d.sun);
  set(p, "scale_height", d.scale_height);
  set(p, "limb_reflectance", d.limb);
  set(p, "has_glint", int(d.glint));
  set(p, "cells", d.cells);
  set(p, "rays", 0);
  set(p, "surface", 1);
  bind(0, rays_);
  bind(1, surface_);
  gl_.DrawArrays(kTriangles, 0, 3);
  std::vector<std::pair<float, float>> out(rays.values.size());
  sky.read(&out.data()->first);
  return out;
}

void GlRenderer::add_points(ElectronImage& image, const std::vector<Point>& points,
                            double sigma_px) {
  if (points.empty()) return;
  const GlContext::Current current(*context_);
  const float half = static_cast<float>(std::ceil(5 * sigma_px)) + 0.5f;
  std::vector<float> corners;
  corners.reserve(points.size() * 30);
  for (const Point& point : points) {
    for (const int corner : {0, 1, 2, 2, 1, 3}) {
      const float du = corner % 2 == 0 ? -half : half, dv = corner / 2 == 0 ? -half : half;
      for (const float part : {std::round(point.u) + du, std::round(point.v) + dv, point.u, point.v,
                               point.electrons}) {
        corners.push_back(part);
      }
    }
  }
  gl_.BufferData(kArrayBuffer, static_cast<std::ptrdiff_t>(corners.size() * sizeof(float)),
                 corners.data(), kStreamDraw);
  attributes({2, 3});
  const Target target(*this, image.width_px, image.height_px, kR32f, kRed, 0, false);
  gl_.Enable(kBlend);
  gl_.UseProgram(point_program_);
  gl_.Uniform2f(at(point_program_, "size"), float(image.width_px), float(image.height_px));
  set(point_program_, "sigma", sigma_px);
  gl_.DrawArrays(kTriangles, 0, static_cast<int>(6 * points.size()));
  gl_.Disable(kBlend);
  std::vector<float> drawn(image.values.size());
  target.read(drawn.data());
  for (std::size_t k = 0; k < drawn.size(); ++k) image.values[k] += drawn[k];
}

GlRenderer::Name GlRenderer::shader(unsigned type, const char* text) {
  const Name shader = gl_.CreateShader(type);
  gl_.ShaderSource(shader, 1, &text, nullptr);
  gl_.CompileShader(shader);
  int is_good = 0;
  gl_.GetShaderiv(shader, kCompileStatus, &is_good);
  if (is_good != 0) return shader;
  char log[1000] = "";
  gl_.GetShaderInfoLog(shader, sizeof log, nullptr, log);
  throw std::runtime_error("camera: OpenGL refuses a shader: " + std::string(log));
}

GlRenderer::Name GlRenderer::program(const char* vertex, const char* fragment) {
  const Name program = gl_.CreateProgram();
  gl_.AttachShader(program, shader(kVertexShader, vertex));
  gl_.AttachShader(program, shader(kFragmentShader, fragment));
  gl_.LinkProgram(program);
  int is_good = 0;
  gl_.GetProgramiv(program, kLinkStatus, &is_good);
  if (is_good != 0) return program;
  char log[1000] = "";
  gl_.GetProgramInfoLog(program, sizeof log, nullptr, log);
  throw std::runtime_error("camera: OpenGL refuses a program: " + std::string(log));
}

// Of the buffer: as many floats for location 0, 1, ..., one vertex behind the other.
void GlRenderer::attributes(std::initializer_list<int> sizes) {
  const int stride = 4 * std::accumulate(sizes.begin(), sizes.end(), 0);
  unsigned location = 0;
  std::uintptr_t offset = 0;
  for (const int size : sizes) {
    gl_.VertexAttribPointer(location, size, kFloat, 0, stride,
                            reinterpret_cast<const void*>(offset));
    gl_.EnableVertexAttribArray(location);
    offset += static_cast<std::uintptr_t>(4 * size);
    ++location;
  }
}

int GlRenderer::at(Name program, const char* uniform) const {
  return gl_.GetUniformLocation(program, uniform);
}
void GlRenderer::set(Name program, const char* uniform, const Vec3& value) const {
  gl_.Uniform3f(at(program, uniform), float(value.x), float(value.y), float(value.z));
}
void GlRenderer::set(Name program, const char* uniform, double value) const {
  gl_.Uniform1f(at(program, uniform), float(value));
}
void GlRenderer::set(Name program, const char* uniform, int value) const {
  gl_.Uniform1i(at(program, uniform), value);
}

GlRenderer::Name GlRenderer::texture(int internal_format, int width, int height, unsigned format,
                                     const void* data) {
  Name name = 0;
  gl_.GenTextures(1, &name);
  gl_.BindTexture(kTexture2d, name);
  gl_.TexImage2D(kTexture2d, 0, internal_format, width, height, 0, format, kFloat, data);
  gl_.TexParameteri(kTexture2d, kMinFilter, kNearest);
  gl_.TexParameteri(kTexture2d, kMagFilter, kNearest);
  return name;
}

void GlRenderer::bind(int unit, Name texture) const {
  gl_.ActiveTexture(kTexture0 + static_cast<unsigned>(unit));
  gl_.BindTexture(kTexture2d, texture);
}

}  // namespace orrery
