/// Raw bytes, as they cross from devices to flight software and between spacecraft.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace orrery {

using Bytes = std::span<const std::byte>;
using ByteBuffer = std::vector<std::byte>;

}  // namespace orrery
