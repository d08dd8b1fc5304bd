/// What the running program itself is linked with.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string>

namespace orrery::internal {

/// True if the program, or a library that it links, links this very file: its symbols are then one
/// for all that is loaded, whatever is copied.
bool program_links(const std::string& path);

/// The executable's file.
std::string program_path();

}  // namespace orrery::internal
