/// Same seed, same bits: a test flown twice under conditions that must not matter.
#pragma once

#include <orrery/harness/gtest/run_trace.hpp>

#include <gtest/gtest.h>

#include <functional>

namespace orrery {

/// Flies twice in this program: the second time with its heaps scattered and filled otherwise. The
/// callable makes its worlds, runs and destroys them.
///
///   EXPECT_TRUE(flies_equally([] { FormationWorld world(options); world.run_for(1h); }));
///
/// A failure names the first event that differs, with its spacecraft, in both runs.
/// @throws what the callable throws.
testing::AssertionResult flies_equally(const std::function<void()>& fly);

/// EXPECT_DETERMINISTIC({ FormationWorld world(options); world.run_for(1h); });
#define EXPECT_DETERMINISTIC(...) EXPECT_TRUE(::orrery::flies_equally([&] __VA_ARGS__))

/// What --orrery_verify_determinism does after each test that made a world: runs it again as a
/// child process with other heaps, own globals where they are shared, another environment, other
/// addresses, recording turned round and all logs on, and adds a failure to the test if anything
/// differs: the first event that does, and the cause, found by varying one thing at a time.
/// --orrery_shuffle_ties=N runs each test with events of equal time and different origin in an
/// order drawn from N, then again in the defined one; another result "depends on tie order".
namespace internal {

/// Before the test's fixture is made, and when the test has ended. The listener calls them.
void begin_determinism_check();
void end_determinism_check(const testing::TestInfo& test);

}  // namespace internal
}  // namespace orrery
