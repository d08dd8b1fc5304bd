/// An array on pages of its own: what a heap keeps beside its arena must not come from malloc,
/// which it may be serving at that moment.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <sys/mman.h>
#include <type_traits>

namespace orrery::internal {

/// Zero where it was never written. No memory is committed for what was never touched.
template <class T>
class PageArray {
  static_assert(std::is_trivial_v<T>);

 public:
  PageArray() = default;
  ~PageArray() {
    if (data_ != nullptr) munmap(data_, bytes_);
  }
  PageArray(const PageArray&) = delete;
  PageArray& operator=(const PageArray&) = delete;

  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  std::size_t size() const { return bytes_ / sizeof(T); }

  /// Makes room for at least `count` and keeps what there is. A program that is out of address
  /// space ends.
  void grow(std::size_t count) {
    const std::size_t bytes = (count * sizeof(T) + kPage_bytes - 1) / kPage_bytes * kPage_bytes;
    if (bytes <= bytes_) return;
    void* grown = data_ == nullptr ? mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                                          MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)
                                   : mremap(data_, bytes_, bytes, MREMAP_MAYMOVE);
    if (grown == MAP_FAILED) {
      std::fprintf(stderr, "orrery: no memory for %zu bytes of a heap's free list\n", bytes);
      std::abort();
    }
    data_ = static_cast<T*>(grown);
    bytes_ = bytes;
  }

 private:
  static constexpr std::size_t kPage_bytes = 4096;
  T* data_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace orrery::internal
