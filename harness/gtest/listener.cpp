#include <orrery/harness/gtest/determinism.hpp>
#include <orrery/harness/gtest/listener.hpp>
#include <orrery/harness/gtest/requirements.hpp>
#include <orrery/harness/gtest/run_context.hpp>
#include <orrery/harness/gtest/run_record.hpp>
#include <orrery/harness/heap/interposition.hpp>

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace orrery {
namespace {

using EndOfTest = std::function<void(const testing::TestInfo&)>;

std::vector<EndOfTest>& ends_of_tests() {
  static std::vector<EndOfTest> callbacks;
  return callbacks;
}

class Listener : public testing::EmptyTestEventListener {
  void OnTestStart(const testing::TestInfo& test) override {
    explained_ = false;
    set_current_test(std::string(test.test_suite_name()) + "." + test.name());
    internal::begin_determinism_check();
    internal::begin_requirements();
    internal::begin_run_record(test);
  }
  // Before GoogleTest's own printer, so that a failure that is added here is the test's.
  void OnTestEnd(const testing::TestInfo& test) override {
    explained_ = true;  // what fails from here on brings its own commands
    internal::end_determinism_check(test);
    for (const EndOfTest& end : ends_of_tests()) end(test);
    internal::check_settings(test);
    internal::end_requirements(test);
    internal::end_run_record(test);
    set_current_test({});
  }

  void OnTestPartResult(const testing::TestPartResult& result) override {
    if (!result.failed()) return;
    internal::note_failure(result.file_name(), result.line_number(), result.message());
    if (explained_) return;
    const std::string runs = describe_live_runs();
    if (runs.empty() && !world_was_noted()) return;  // none of ours
    explained_ = true;
    if (runs.empty()) {
      std::printf("[ orrery   ] no run is alive: its world could not be made, or has ended\n");
    } else {
      std::printf("[ orrery   ] where this run stands:\n%s", runs.c_str());
    }
    std::printf("  replay: %s\n", replay_command().c_str());
    std::printf("  debug: %s\n", debug_command(live_run_elapsed()).c_str());
    std::fflush(stdout);
  }

  bool explained_ = false;  // once per test: the first failure is the one to look at
};

bool is_unfiltered_shard() {
  const char* shards = std::getenv("GTEST_TOTAL_SHARDS");
  return shards != nullptr && testing::GTEST_FLAG(filter) == "*";
}

}  // namespace

void at_test_end(std::function<void(const testing::TestInfo&)> callback) {
  ends_of_tests().push_back(std::move(callback));
}

void install_listener() {
  static const bool installed = [] {
    testing::UnitTest::GetInstance()->listeners().Append(new Listener);  // GoogleTest owns it
    return true;
  }();
  (void)installed;
}

int run_all_tests() {
  if (const std::string lost = verify_interposition(); !lost.empty()) {
    std::fprintf(stderr, "orrery: %s\n", lost.c_str());
    return 3;
  }
  const int failed = RUN_ALL_TESTS();
  if (failed != 0) return 1;
  if (testing::GTEST_FLAG(list_tests)) return 0;
  const testing::UnitTest& unit = *testing::UnitTest::GetInstance();
  if (unit.test_to_run_count() > 0 || is_unfiltered_shard()) return 0;
  std::fprintf(stderr, "orrery: no test ran (--gtest_filter=%s matches none of %d)\n",
               testing::GTEST_FLAG(filter).c_str(), unit.total_test_count());
  return 2;
}

}  // namespace orrery
