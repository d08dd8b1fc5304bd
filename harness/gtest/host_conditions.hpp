/// What of the host the runs of a test program must not depend on.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

namespace orrery::internal {

/// Locale C and time zone UTC, for children too; and, by executing the program once more, addresses
/// that are not randomised. Children inherit that, so the price (a millisecond or two) is paid by
/// the first. Not again where it is so already, where tests are only listed, under a debugger,
/// which decides for itself, or under valgrind, which would lose the program. A refusal, as of many
/// containers, is one line on standard error, and "aslr": "on" in manifest.json.
void fix_host_conditions(char** arguments);

}  // namespace orrery::internal
