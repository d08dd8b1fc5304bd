/// Every run must pass: INSTANTIATE_TEST_SUITE_P(Seeds, SwarmTest, orrery::Seeds(200)).
#pragma once

#include <orrery/harness/kernel/run_id.hpp>

#include <gtest/gtest.h>

#include <iosfwd>

namespace orrery {

/// RunIds 0 ... n-1 with seeds base, base+1 ... The base is --orrery_seed, else ORRERY_SEED, else
/// 1;
/// --orrery_runs replaces n; with --orrery_run=I run I is the only one, and the test's name ends in
/// /0. @throws std::invalid_argument  n < 1.
testing::internal::ParamGenerator<RunId> Seeds(int n);

/// "seed 17 (run 16)"
void PrintTo(const RunId& run, std::ostream* os);

}  // namespace orrery
