/// Memory of flight code, looked at on its behalf.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstring>

namespace orrery::internal {

/// What flight code points to may be anything, null included; then this faults, as flight code.
__attribute__((noinline, no_sanitize("undefined"))) inline void copy_between(void* to,
                                                                             const void* from,
                                                                             std::size_t bytes) {
  if (bytes > 0) std::memcpy(to, from, bytes);
}

}  // namespace orrery::internal
