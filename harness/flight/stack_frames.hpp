/// Names for the addresses of a captured stack.
#pragma once

#include <orrery/harness/flight/containment.hpp>

#include <string>
#include <vector>

namespace orrery::internal {

/// Without the harness's own frames at either end. These libraries are read for their symbols,
/// hidden ones included; of other files only what the loader tells.
std::vector<StackFrame> stack_frames(const CrashCapture& capture,
                                     const std::vector<std::string>& libraries);

}  // namespace orrery::internal
