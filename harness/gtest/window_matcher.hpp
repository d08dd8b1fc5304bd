/// What the matchers on channels share. Not for test authors.
#pragma once

#include <orrery/harness/gtest/channel_matchers.hpp>

#include <ostream>
#include <string>
#include <vector>

namespace orrery::internal {

/// Six digits, in no locale.
std::string number(double value);
std::string quantity(const Channel& channel, double value);
/// "12.5 s", from the channel's start.
std::string when(const Channel& channel, SimTime t);
/// " on dsc", or nothing.
std::string on_spacecraft(const Channel& channel);
std::string counted(std::size_t n);
/// @throws std::invalid_argument  not finite; not positive.
double checked(const char* matcher, double limit);
Duration checked(const char* matcher, Duration span);

/// Fails the test, whatever becomes of the matcher's answer: Not() would make a pass of it. Once
/// per assertion: GoogleTest asks silently first, and again for the words.
bool fails_anyway(testing::MatchResultListener& out, const std::string& why);

/// Empty; or that the channel does not remember the window's begin.
std::string forgotten(const Channel& channel, const TimeWindow& window);

/// A sample, with its components if it has such.
struct Point {
  SimTime t;
  double value = 0;
  const Channel::Components* vector = nullptr;
};
using Points = std::vector<Point>;

/// "it is 4 m at 2 s on dsc"; "its norm is 5 m at 2 s on dsc (R 3, T 4, N 0; most along T)"
std::string placed(const Channel& channel, const Point& point);

/// The window, what it holds, and that an empty one fails.
class OverWindow : public testing::MatcherInterface<const Channel&> {
 public:
  explicit OverWindow(const TimeWindow& window) : window_(window) {}

  bool MatchAndExplain(const Channel& channel, testing::MatchResultListener* out) const override;
  void DescribeTo(std::ostream* out) const override { *out << "is " << text() << window_.text(); }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "is not " << text() << window_.text();
  }

 protected:
  virtual bool judge(const Channel& channel, const Points& points,
                     testing::MatchResultListener& out) const = 0;
  virtual std::string text() const = 0;
  /// Of events and states as well.
  virtual bool asks_for_times_only() const { return false; }
  const TimeWindow& window() const { return window_; }

 private:
  Points in_window(const Channel& channel) const;

  TimeWindow window_;
};

}  // namespace orrery::internal
