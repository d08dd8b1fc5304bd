/// Images as they arise in a camera: charge, then numbers.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace orrery {

/// Row by row, the first row at the top: at(u, v) is the pixel whose centre is (u, v).
template <class Value>
struct Image {
  int width_px = 0, height_px = 0;
  std::vector<Value> values = {};

  Image() = default;
  Image(int width, int height, Value value = {})
      : width_px(width),
        height_px(height),
        values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value) {}

  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_px) +
           static_cast<std::size_t>(u);
  }
  Value& at(int u, int v) { return values[index(u, v)]; }
  const Value& at(int u, int v) const { return values[index(u, v)]; }
  Value* row(int v) { return values.data() + index(0, v); }
  const Value* row(int v) const { return values.data() + index(0, v); }
  friend bool operator==(const Image&, const Image&) = default;
};

using ElectronImage = Image<float>;         // expected photo-electrons per pixel
using DigitalImage = Image<std::uint16_t>;  // [DN]

}  // namespace orrery
