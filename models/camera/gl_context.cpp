#include <orrery/models/camera/gl_context.hpp>

#include <cstdlib>
#include <dlfcn.h>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace orrery {

namespace {

constexpr const char* kPackages =
    "install Debian's package libosmesa6, or libegl1 with libgl1-mesa-dri, or render on the CPU";

// Stays loaded: drivers do not bear to be unloaded.
class GlLibrary {
 public:
  explicit GlLibrary(const char* name) : name_(name), handle_(dlopen(name, RTLD_NOW | RTLD_LOCAL)) {
    if (handle_ == nullptr) {
      throw std::runtime_error("camera: no " + std::string(name) + " for OpenGL: " + kPackages);
    }
  }
  template <class Function>
  void find(Function*& function, const char* name) const {
    function = reinterpret_cast<Function*>(dlsym(handle_, name));
    if (function == nullptr) throw std::runtime_error("camera: " + name_ + " has no " + name);
  }

 private:
  std::string name_;
  void* handle_;
};

[[noreturn]] void refuse(const char* library, const char* what) {
  throw std::runtime_error("camera: " + std::string(library) + " " + what + ": " + kPackages);
}

void prefer(const char* variable, const char* value) {
  setenv(variable, value, /*overwrite=*/0);
}

class OsMesaContext final : public GlContext {
 public:
  OsMesaContext() : library_("libOSMesa.so.8") {
    void* (*create)(const int*, void*) = nullptr;
    library_.find(create, "OSMesaCreateContextAttribs");
    library_.find(make_current_, "OSMesaMakeCurrent");
    library_.find(destroy_, "OSMesaDestroyContext");
    void (*(*get)(const char*))() = nullptr;
    library_.find(get, "OSMesaGetProcAddress");
    constexpr int kFormat = 0x22, kRgba = 0x1908, kProfile = 0x33, kCore = 0x34, kMajor = 0x36,
                  kMinor = 0x37;
    const int wanted[] = {kFormat, kRgba, kProfile, kCore, kMajor, 3, kMinor, 3, 0};
    context_ = create(wanted, nullptr);
    if (context_ == nullptr) refuse("libOSMesa.so.8", "makes no context of OpenGL 3.3");
    const Current current(*this);
    load_functions(get);
  }
  ~OsMesaContext() override { destroy_(context_); }

 private:
  void make_current() override {
    constexpr unsigned kUnsignedByte = 0x1401;
    if (make_current_(context_, pixels_, kUnsignedByte, 1, 1) == 0) {
      refuse("libOSMesa.so.8", "does not make its context current");
    }
  }
  void release() override { make_current_(nullptr, nullptr, 0, 0, 0); }

  GlLibrary library_;
  unsigned char (*make_current_)(void*, void*, unsigned, int, int) = nullptr;
  void (*destroy_)(void*) = nullptr;
  void* context_ = nullptr;
  unsigned char pixels_[4] = {};  // of the framebuffer that OSMesa wants and nobody draws to
};

class EglContext final : public GlContext {
 public:
  EglContext() : library_("libEGL.so.1") {
    void (*(*get)(const char*))() = nullptr;
    unsigned (*initialize)(void*, int*, int*) = nullptr;
    unsigned (*bind_api)(unsigned) = nullptr;
    void* (*create)(void*, void*, void*, const int*) = nullptr;
    library_.find(get, "eglGetProcAddress");
    library_.find(initialize, "eglInitialize");
    library_.find(bind_api, "eglBindAPI");
    library_.find(create, "eglCreateContext");
    library_.find(make_current_, "eglMakeCurrent");
    library_.find(destroy_, "eglDestroyContext");
    const auto get_display = reinterpret_cast<void* (*)(unsigned, void*, const int*)>(
        reinterpret_cast<void*>(get("eglGetPlatformDisplayEXT")));
    constexpr unsigned kSurfaceless = 0x31DD, kOpenGl = 0x30A2;
    if (get_display != nullptr) display_ = get_display(kSurfaceless, nullptr, nullptr);
    if (display_ == nullptr || !initialize(display_, nullptr, nullptr) || !bind_api(kOpenGl)) {
      refuse("libEGL.so.1", "has no platform without a surface");
    }
    constexpr int kMajor = 0x3098, kMinor = 0x30FB, kProfile = 0x30FD, kCore = 1, kEnd = 0x3038;
    const int wanted[] = {kMajor, 3, kMinor, 3, kProfile, kCore, kEnd};
    context_ = create(display_, nullptr, nullptr, wanted);
    if (context_ == nullptr) refuse("libEGL.so.1", "makes no context of OpenGL 3.3");
    const Current current(*this);
    load_functions(get);
  }
  ~EglContext() override { destroy_(display_, context_); }

 private:
  void make_current() override {
    if (!make_current_(display_, nullptr, nullptr, context_)) {
      refuse("libEGL.so.1", "does not make its context current");
    }
  }
  void release() override { make_current_(display_, nullptr, nullptr, nullptr); }

  GlLibrary library_;
  unsigned (*make_current_)(void*, void*, void*, void*) = nullptr;
  unsigned (*destroy_)(void*, void*) = nullptr;
  void *display_ = nullptr, *context_ = nullptr;
};

}  // namespace

std::unique_ptr<GlContext> GlContext::make(GlPlatform platform) {
  prefer("LIBGL_ALWAYS_SOFTWARE", "true");
  prefer("LP_NUM_THREADS", "0");
  prefer("MESA_SHADER_CACHE_DISABLE", "true");
  if (platform == GlPlatform::kEgl) return std::make_unique<EglContext>();
  if (platform == GlPlatform::kOsMesa) return std::make_unique<OsMesaContext>();
  try {
    return std::make_unique<OsMesaContext>();
  } catch (const std::runtime_error&) {
    return std::make_unique<EglContext>();
  }
}

void GlContext::load_functions(GetFunction get) {
  const auto load = [get](auto*& function, const char* name) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(get(name));
    if (function == nullptr) refuse("OpenGL", ("has no " + std::string(name)).c_str());
  };
  load(gl_.ActiveTexture, "glActiveTexture");
  load(gl_.AttachShader, "glAttachShader");
  load(gl_.BindBuffer, "glBindBuffer");
  load(gl_.BindFramebuffer, "glBindFramebuffer");
  load(gl_.BindTexture, "glBindTexture");
  load(gl_.BindVertexArray, "glBindVertexArray");
  load(gl_.BlendFunc, "glBlendFunc");
  load(gl_.BufferData, "glBufferData");
  load(gl_.CheckFramebufferStatus, "glCheckFramebufferStatus");
  load(gl_.ClearBufferfv, "glClearBufferfv");
  load(gl_.CompileShader, "glCompileShader");
  load(gl_.CreateProgram, "glCreateProgram");
  load(gl_.CreateShader, "glCreateShader");
  load(gl_.DeleteTextures, "glDeleteTextures");
  load(gl_.DepthFunc, "glDepthFunc");
  load(gl_.Disable, "glDisable");
  load(gl_.DrawArrays, "glDrawArrays");
  load(gl_.Enable, "glEnable");
  load(gl_.EnableVertexAttribArray, "glEnableVertexAttribArray");
  load(gl_.FramebufferTexture2D, "glFramebufferTexture2D");
  load(gl_.GenBuffers, "glGenBuffers");
  load(gl_.GenFramebuffers, "glGenFramebuffers");
  load(gl_.GenTextures, "glGenTextures");
  load(gl_.GenVertexArrays, "glGenVertexArrays");
  load(gl_.GetError, "glGetError");
  load(gl_.GetProgramInfoLog, "glGetProgramInfoLog");
  load(gl_.GetProgramiv, "glGetProgramiv");
  load(gl_.GetShaderInfoLog, "glGetShaderInfoLog");
  load(gl_.GetShaderiv, "glGetShaderiv");
  load(gl_.GetString, "glGetString");
  load(gl_.GetUniformLocation, "glGetUniformLocation");
  load(gl_.LinkProgram, "glLinkProgram");
  load(gl_.PixelStorei, "glPixelStorei");
  load(gl_.ReadPixels, "glReadPixels");
  load(gl_.ShaderSource, "glShaderSource");
  load(gl_.TexImage2D, "glTexImage2D");
  load(gl_.TexParameteri, "glTexParameteri");
  load(gl_.Uniform1f, "glUniform1f");
  load(gl_.Uniform1i, "glUniform1i");
  load(gl_.Uniform2f, "glUniform2f");
  load(gl_.Uniform3f, "glUniform3f");
  load(gl_.UniformMatrix3fv, "glUniformMatrix3fv");
  load(gl_.UseProgram, "glUseProgram");
  load(gl_.VertexAttribPointer, "glVertexAttribPointer");
  load(gl_.Viewport, "glViewport");
}

}  // namespace orrery
