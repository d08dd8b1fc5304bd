/// Which tests verify which requirements.
///
/// XML, JSON  GoogleTest's own files get a property `requirement` per test, "GNC-042, GNC-043".
/// Tables     With --orrery_out=DIR: DIR/requirements.csv has a row per requirement, test and base
///            seed with its latest result (passed, failed, skipped, or incomplete: the program
///            ended within the test); DIR/requirements.md says per requirement whether it is
///            verified and by what. Programs that run side by side add to the same tables, under a
///            lock; each replaces its own rows alone, and readers never see half a table.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <gtest/gtest.h>

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// The running test verifies these; in its body or in its fixture, as often as is useful.
/// @throws std::invalid_argument  an id that is empty or has another character than letters, digits
///                                and - _ . / :
///         std::logic_error       no test is running.
void verifies_requirements(std::initializer_list<std::string_view> ids);

/// TEST_REQUIREMENT("GNC-042"); or TEST_REQUIREMENT("GNC-042", "GNC-043");
#define TEST_REQUIREMENT(...) ::orrery::verifies_requirements({__VA_ARGS__})

namespace internal {

/// A row of requirements.csv.
struct RequirementRow {
  std::string requirement, test;
  std::string seed;
  std::string result;
};
/// Puts rows into the tables of a folder, in place of those of the same requirement, test and seed.
/// @throws std::runtime_error  a file cannot be read or written.
void update_requirements(const std::filesystem::path& folder,
                         const std::vector<RequirementRow>& rows);

/// The listener calls them when a test starts and has ended.
void begin_requirements();
void end_requirements(const testing::TestInfo& test);

}  // namespace internal
}  // namespace orrery
