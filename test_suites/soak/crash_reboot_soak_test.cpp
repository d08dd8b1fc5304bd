// Property: crash and reboot leave nothing behind. With ORRERY_SOAK set, a million cycles of a
// shared library and 20,000 of a private copy; else 2,000 and 500.

#include <orrery/harness/flight/flight_computer.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <unistd.h>

namespace orrery {
namespace {

constexpr SimTime kStart = from_ns(1'000'000'000'000);

std::int64_t resident_bytes() {
  std::int64_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

bool in_full() {
  return std::getenv("ORRERY_SOAK") != nullptr;
}

struct Cycles {
  const char* name;
  Isolation isolation;
  int in_full, briefly;
};

class CrashRebootSoakTest : public testing::TestWithParam<Cycles> {};

// 7 s apart, so that no boot loop is seen: 9 boots a minute.
TEST_P(CrashRebootSoakTest, GrowsByLessThanAMegabyte) {
  if (!heap_simulation_available()) GTEST_SKIP() << "under a sanitizer dead libraries stay loaded";
  EventLoop loop(kStart);
  const OwnerId owner = loop.add_owner("dsc");
  std::unique_ptr<FlightComputer> computer;
  FlightComputer::Hooks hooks;
  hooks.on_crash = [&](const CrashReport&) {
    computer->reboot(loop.now(), 1s, ResetCause::kCrash);
  };
  computer = std::make_unique<FlightComputer>(loop, owner,
                                              FlightProcessOptions{
                                                  .spacecraft = "dsc",
                                                  .library = "flight_test_subject",
                                                  .isolation = GetParam().isolation,
                                              },
                                              hooks);
  computer->boot();
  const std::byte crash[] = {std::byte{'!'}, std::byte{'s'}};
  const auto cycle = [&](int count) {
    for (int i = 0; i < count; ++i) {
      computer->deliver("do", crash, owner);
      loop.run_until(loop.now() + 7s);
    }
  };
  constexpr int kWarmUp = 200;
  cycle(kWarmUp);
  const std::int64_t before = resident_bytes();
  const int count = in_full() ? GetParam().in_full : GetParam().briefly;
  cycle(count);
  const std::int64_t grown = resident_bytes() - before;
  std::printf("  %d cycles: grown by %lld bytes\n", count, static_cast<long long>(grown));
  EXPECT_EQ(computer->crashes(), static_cast<std::uint64_t>(kWarmUp + count));
  EXPECT_TRUE(computer->alive());
  EXPECT_LT(grown, 1'000'000);
}

INSTANTIATE_TEST_SUITE_P(Isolations, CrashRebootSoakTest,
                         testing::Values(Cycles{"Shared", Isolation::kShared, 1'000'000, 2000},
                                         Cycles{"Copy", Isolation::kCopy, 20'000, 500}),
                         [](const auto& cycles) { return std::string(cycles.param.name); });

}  // namespace
}  // namespace orrery
