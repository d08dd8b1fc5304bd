/// What a campaign shows while it flies.
#pragma once

#include <orrery/harness/gtest/run_record.hpp>

#include <array>
#include <chrono>
#include <cstdint>
#include <string>

namespace orrery {

/// One line on a terminal: how far, how fast, time left, what became of the runs. In a pipe
/// nothing.
class CampaignProgress {
 public:
  explicit CampaignProgress(bool quiet);
  /// How many will fly, those counted already included; 0: until there is a failure.
  void expect(std::uint32_t runs) { runs_ = runs; }
  ~CampaignProgress() { clear(); }
  void count(const RunRecord& run);
  /// At most ten times a second.
  void show();
  void clear();
  std::uint32_t done() const { return done_; }
  /// "passed 97, failed 2, crashed 1"
  std::string counts() const;
  double seconds() const;
  std::string line() const;

 private:
  using HostClock = std::chrono::steady_clock;
  std::uint32_t runs_ = 0, done_ = 0;
  std::array<std::uint32_t, kRunOutcomes> outcomes_{};
  bool visible_, shown_ = false;
  HostClock::time_point begin_ = HostClock::now(), last_{};
};

}  // namespace orrery
