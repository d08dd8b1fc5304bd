/// The processor's floating-point control registers, which flight code must not change for others.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace orrery::internal {

/// Rounding, flush-to-zero, precision and exception masks. Loading a library that was linked with
/// -ffast-math is enough to change them.
class FloatingPointControl {
 public:
#if defined(__SSE__)
  static FloatingPointControl read() {
    FloatingPointControl now;
    now.mxcsr_ = _mm_getcsr() & ~kStatusFlags;
    __asm__ volatile("fnstcw %0" : "=m"(now.x87_));
    return now;
  }
  void restore() const {
    _mm_setcsr(mxcsr_);
    __asm__ volatile("fldcw %0" : : "m"(x87_));
  }
#else
  static FloatingPointControl read() {
    return {};
  }
  void restore() const {}
#endif
  friend bool operator==(const FloatingPointControl&, const FloatingPointControl&) = default;

 private:
  static constexpr std::uint32_t kStatusFlags = 0x3F;  // sticky, and of no effect
  std::uint32_t mxcsr_ = 0;
  std::uint16_t x87_ = 0;
};

}  // namespace orrery::internal
