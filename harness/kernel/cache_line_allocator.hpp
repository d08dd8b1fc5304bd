/// Allocator for vectors whose elements are meant to fall on given places of a cache line.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <new>

namespace orrery {

template <class T>
struct CacheLineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kAlignment{64};

  CacheLineAllocator() = default;
  template <class U>
  CacheLineAllocator(const CacheLineAllocator<U>&) noexcept {}  // NOLINT: as the standard has it

  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kAlignment));
  }
  void deallocate(T* block, std::size_t) noexcept { ::operator delete(block, kAlignment); }
  friend bool operator==(const CacheLineAllocator&, const CacheLineAllocator&) = default;
};

}  // namespace orrery
