#include <orrery/models/camera/jpeg_file.hpp>

#include <array>
#include <cmath>
#include <dlfcn.h>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <vector>

namespace orrery {

namespace {

// The TurboJPEG API, loaded when a map is read: nothing else here needs it.
class TurboJpeg {
 public:
  TurboJpeg() {
    library_ = dlopen("libturbojpeg.so.0", RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) {
      throw std::runtime_error(
          "EarthSurface: no libturbojpeg.so.0: install Debian's package libturbojpeg0, or use "
          "EarthSurface::uniform()");
    }
    find(init_, "tjInitDecompress");
    find(header_, "tjDecompressHeader3");
    find(decompress_, "tjDecompress2");
    find(destroy_, "tjDestroy");
  }
  ~TurboJpeg() { dlclose(library_); }
  TurboJpeg(const TurboJpeg&) = delete;
  TurboJpeg& operator=(const TurboJpeg&) = delete;

  // 3 bytes per pixel, red first.
  std::vector<unsigned char> rgb(const std::vector<unsigned char>& file, int& width, int& height,
                                 const std::string& path) const {
    void* const handle = init_();
    int subsampling = 0, colours = 0;
    const auto size = static_cast<unsigned long>(file.size());
    bool is_good = handle != nullptr &&
                   header_(handle, file.data(), size, &width, &height, &subsampling, &colours) == 0;
    std::vector<unsigned char> pixels;
    if (is_good) {
      pixels.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
      is_good = decompress_(handle, file.data(), size, pixels.data(), width, 0, height,
                            /*TJPF_RGB*/ 0, /*TJFLAG_ACCURATEDCT*/ 4096) == 0;
    }
    if (handle != nullptr) destroy_(handle);
    if (!is_good) throw std::runtime_error("EarthSurface: " + path + " is no JPEG image");
    return pixels;
  }

 private:
  template <class Function>
  void find(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(dlsym(library_, name));
    if (function == nullptr) {
      throw std::runtime_error(std::string("EarthSurface: libturbojpeg.so.0 has no ") + name);
    }
  }

  void* library_ = nullptr;
  void* (*init_)() = nullptr;
  int (*header_)(void*, const unsigned char*, unsigned long, int*, int*, int*, int*) = nullptr;
  int (*decompress_)(void*, const unsigned char*, unsigned long, unsigned char*, int, int, int, int,
                     int) = nullptr;
  int (*destroy_)(void*) = nullptr;
};

float linear(int srgb) {
  const double s = srgb / 255.0;
  return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

}  // namespace

Image<float> read_jpeg_luminance(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    throw std::runtime_error("EarthSurface: no " + path +
                             ": install Debian's package xplanet-images, or use "
                             "EarthSurface::uniform()");
  }
  const std::vector<unsigned char> file{std::istreambuf_iterator<char>(stream), {}};
  int width = 0, height = 0;
  const std::vector<unsigned char> rgb = TurboJpeg().rgb(file, width, height, path);
  std::array<float, 256> curve;
  for (int k = 0; k < 256; ++k) curve[static_cast<std::size_t>(k)] = linear(k);
  Image<float> image(width, height);
  for (std::size_t k = 0; k < image.values.size(); ++k) {
    image.values[k] = 0.2126f * curve[rgb[3 * k]] + 0.7152f * curve[rgb[3 * k + 1]] +
                      0.0722f * curve[rgb[3 * k + 2]];
  }
  return image;
}

}  // namespace orrery
