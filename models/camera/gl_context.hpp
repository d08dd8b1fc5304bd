/// OpenGL without a screen: on OSMesa, or on EGL without a surface. Not installed.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <memory>

namespace orrery {

/// The functions of OpenGL 3.3 that are used here, as the library in use has them. Types and
/// constants are those of the specification: nothing of OpenGL is needed to build.
struct GlFunctions {
  using Enum = unsigned;
  using Name = unsigned;  // of an object

  void (*ActiveTexture)(Enum unit);
  void (*AttachShader)(Name program, Name shader);
  void (*BindBuffer)(Enum target, Name buffer);
  void (*BindFramebuffer)(Enum target, Name framebuffer);
  void (*BindTexture)(Enum target, Name texture);
  void (*BindVertexArray)(Name array);
  void (*BlendFunc)(Enum source, Enum destination);
  void (*BufferData)(Enum target, std::ptrdiff_t size, const void* data, Enum usage);
  Enum (*CheckFramebufferStatus)(Enum target);
  void (*ClearBufferfv)(Enum buffer, int draw_buffer, const float* value);
  void (*CompileShader)(Name shader);
  Name (*CreateProgram)();
  Name (*CreateShader)(Enum type);
  void (*DeleteTextures)(int count, const Name* textures);
  void (*DepthFunc)(Enum function);
  void (*Disable)(Enum capability);
  void (*DrawArrays)(Enum mode, int first, int count);
  void (*Enable)(Enum capability);
  void (*EnableVertexAttribArray)(unsigned index);
  void (*FramebufferTexture2D)(Enum target, Enum attachment, Enum texture_target, Name texture,
                               int level);
  void (*GenBuffers)(int count, Name* buffers);
  void (*GenFramebuffers)(int count, Name* framebuffers);
  void (*GenTextures)(int count, Name* textures);
  void (*GenVertexArrays)(int count, Name* arrays);
  Enum (*GetError)();
  void (*GetProgramInfoLog)(Name program, int size, int* length, char* log);
  void (*GetProgramiv)(Name program, Enum what, int* value);
  void (*GetShaderInfoLog)(Name shader, int size, int* length, char* log);
  void (*GetShaderiv)(Name shader, Enum what, int* value);
  const unsigned char* (*GetString)(Enum what);
  int (*GetUniformLocation)(Name program, const char* name);
  void (*LinkProgram)(Name program);
  void (*PixelStorei)(Enum what, int value);
  void (*ReadPixels)(int x, int y, int width, int height, Enum format, Enum type, void* data);
  void (*ShaderSource)(Name shader, int count, const char* const* text, const int* lengths);
  void (*TexImage2D)(Enum target, int level, int internal_format, int width, int height, int border,
                     Enum format, Enum type, const void* data);
  void (*TexParameteri)(Enum target, Enum what, int value);
  void (*Uniform1f)(int location, float value);
  void (*Uniform1i)(int location, int value);
  void (*Uniform2f)(int location, float x, float y);
  void (*Uniform3f)(int location, float x, float y, float z);
  void (*UniformMatrix3fv)(int location, int count, unsigned char transpose, const float* values);
  void (*UseProgram)(Name program);
  void (*VertexAttribPointer)(unsigned index, int size, Enum type, unsigned char normalised,
                              int stride, const void* offset);
  void (*Viewport)(int x, int y, int width, int height);
};

enum class GlPlatform { kAny, kOsMesa, kEgl };

/// A context of OpenGL 3.3 (core). Software rendering is asked for (LIBGL_ALWAYS_SOFTWARE), in the
/// calling thread and without a cache of shaders on the disk (LP_NUM_THREADS 0,
/// MESA_SHADER_CACHE_DISABLE), each unless the environment says otherwise: threads of a driver
/// would not live on in a branch, which is a fork.
class GlContext {
 public:
  /// kAny: OSMesa, else EGL.
  /// @throws std::runtime_error  neither is there, or not in that version; says what to install.
  static std::unique_ptr<GlContext> make(GlPlatform platform);
  virtual ~GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  const GlFunctions& gl() const { return gl_; }

  /// The context belongs to this thread while it lives.
  class Current {
   public:
    explicit Current(GlContext& context) : context_(context) { context.make_current(); }
    ~Current() { context_.release(); }
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    GlContext& context_;
  };

 protected:
  GlContext() = default;
  virtual void make_current() = 0;
  virtual void release() = 0;
  using GetFunction = void (*(*)(const char* name))();
  /// @throws std::runtime_error  one is missing.
  void load_functions(GetFunction get);

 private:
  GlFunctions gl_{};
};

}  // namespace orrery
