/// Which run of a test this is.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>

namespace orrery {

/// Run `index` of a campaign or of Seeds(n). `seed` is base + index already and is used as it is.
struct RunId {
  std::uint64_t seed = 1;
  std::uint32_t index = 0;
};

}  // namespace orrery
