/// Counts what a piece of a test allocates: this test program replaces operator new.
#pragma once

#include <cstdint>

namespace orrery::test {

/// Calls of operator new so far, in all of its forms.
std::uint64_t allocations();

}  // namespace orrery::test
