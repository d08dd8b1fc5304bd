/// A heap over simulated time, and whether it grows.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace orrery {

/// A heap around one call of flight code. Sizes are of whole blocks, as in HeapFigures.
struct HeapSample {
  SimTime t;
  std::uint64_t resting_bytes = 0;         // live when the call returned
  std::uint64_t transient_peak_bytes = 0;  // most live at once within the call
  std::uint64_t heap_bytes = 0;
  std::uint64_t largest_free_bytes = 0;
  std::uint64_t free_list_length = 0;
  std::uint64_t allocations = 0;  // within the call
};

/// A sample per call, or, once there are more than kMost, per 2, 4, 8 ... calls: then the state is
/// that after the last of them, the peak the highest and the allocations their sum. So a soak of
/// months takes 0.66 MB.
class HeapHistory {
 public:
  static constexpr std::size_t kMost = 16'384;

  /// Address space for all samples is taken here, memory as they come: add() allocates nothing.
  explicit HeapHistory(SimTime start = {}) : start_(start) { rows_.reserve(kMost); }
  void add(const HeapSample& call);

  SimTime start() const { return start_; }
  /// The last may stand for fewer calls than the others.
  std::vector<HeapSample> samples() const;
  std::size_t size() const { return rows_.size(); }
  HeapSample sample(std::size_t i) const;
  std::uint64_t calls_per_sample() const { return calls_per_sample_; }
  std::uint64_t calls() const { return calls_; }

 private:
  // An arena has less than 4 GiB, so 32 bits hold any size in it.
  struct Row {
    SimTime t;
    std::uint64_t allocations;
    std::uint32_t resting_bytes, transient_peak_bytes, heap_bytes, largest_free_bytes,
        free_list_length;
  };
  static Row row_of(const HeapSample& sample);
  static Row merged(const Row& earlier, const Row& later);

  SimTime start_;
  std::vector<Row> rows_;
  std::uint64_t calls_per_sample_ = 1, calls_ = 0, calls_in_last_ = 0;
};

/// Straight lines through a history, by least squares.
///
/// A heap that breathes with the orbit has a slope of its own over a window that is not a whole
/// number of periods: at most 6 A / (pi n T) for an amplitude A, n periods and a length T.
struct HeapTrend {
  std::size_t samples = 0;
  Duration span{};  // from the first to the last
  double resting_bytes_per_day = 0;
  double resting_sigma_bytes_per_day = 0;  // of the slope, from the scatter about the line
  double heap_bytes_per_day = 0;           // of the heap's size: live or not, it was needed
};

/// Over the samples of [from, until), since the history's start.
/// @throws std::invalid_argument  fewer than 3 samples in the window, or all at one instant.
HeapTrend heap_trend(const HeapHistory& history, Duration from = Duration::zero(),
                     Duration until = Duration::max());

}  // namespace orrery
