/// Prints what a failure needs besides its assertion, and keeps a program that ran nothing from
/// passing.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <functional>

namespace testing {
class TestInfo;
}

namespace orrery {

/// Calls back when a test has ended, its fixture destroyed and its result known. For rooms that
/// this one does not know.
void at_test_end(std::function<void(const testing::TestInfo&)> callback);

/// Appends the listener to GoogleTest's, once. Init does it.
void install_listener();

/// RUN_ALL_TESTS() with Orrery's exit codes: 0 passed, 1 failed, 2 nothing ran (listing, and empty
/// shards of an unfiltered run, excepted), 3 the allocator's hooks are not taken.
int run_all_tests();

}  // namespace orrery
