/// A long series, reduced for drawing: what it hides is never more than a pixel's detail.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cstddef>
#include <vector>

namespace orrery {

/// Keeps the smallest and the largest value of each span of time, so that no peak is lost.
///
/// Method  Samples fall into spans of equal length, at first one for each; when more than `most`
///         spans are in use, each two neighbours become one. Memory and time per sample are
///         constant, and the result depends on the samples alone.
class SeriesEnvelope {
 public:
  struct Span {
    Duration begin{};  // of the first sample in it, since the start
    Duration end{};    // of the last
    double least = 0, most = 0;
    double last = 0;
  };

  /// Up to 1500 spans, a screen's width.
  SeriesEnvelope() = default;
  /// @throws std::invalid_argument  most < 2.
  explicit SeriesEnvelope(std::size_t most);

  /// @param t  Since the start, not before the last one. Values that are not numbers are left out.
  void add(Duration t, double value);
  const std::vector<Span>& spans() const { return spans_; }
  bool empty() const { return spans_.empty(); }

 private:
  void halve();
  void find_cell_end();

  std::size_t most_ = 1500;
  Duration length_{1};
  Duration cell_end_{};  // of the last span: what is before falls into it
  std::vector<Span> spans_;
};

}  // namespace orrery
