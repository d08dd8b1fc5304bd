/// How busy a processor was, over simulated time.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/series_envelope.hpp>

#include <cstddef>
#include <vector>

namespace orrery {

/// Busy time in cells of equal length, at first 1 s; when more than `most` are in use, each two
/// neighbours become one. Memory and time per span are bounded, and no busy time is lost.
class LoadHistory {
 public:
  /// @throws std::invalid_argument  most < 2.
  explicit LoadHistory(std::size_t most = 1500);

  /// Busy from `begin` to `end`, since the start; not before the end of the last span.
  void add(Duration begin, Duration end);
  /// The last span ends at `t` already, if it would have lasted longer: a reset.
  void cut(Duration t);
  bool empty() const { return total_ == Duration::zero() && last_end_ == last_begin_; }
  /// Per cent busy in each cell, up to `length`; a value at the beginning of each, the last one
  /// also at its end.
  SeriesEnvelope percent(Duration length) const;

 private:
  void keep(Duration begin, Duration end);
  void halve();

  std::size_t most_;
  Duration cell_ = 1s;
  std::vector<Duration> busy_;
  Duration total_{};
  Duration last_begin_{}, last_end_{};  // not in busy_ yet: it may be cut
};

}  // namespace orrery
