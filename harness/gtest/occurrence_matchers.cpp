// Matchers on when and how often something was recorded, and on the axes of vectors.
#include <orrery/harness/gtest/channel_matchers.hpp>
#include <orrery/harness/gtest/window_matcher.hpp>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace orrery {
namespace {

using namespace internal;
using testing::MatchResultListener;

class NoGap final : public OverWindow {
 public:
  NoGap(Duration gap, const TimeWindow& window)
      : OverWindow(window), gap_(checked("NoGapLongerThan", gap)) {}

 private:
  bool asks_for_times_only() const override { return true; }
  bool judge(const Channel& channel, const Points& points,
             MatchResultListener& out) const override {
    std::vector<SimTime> times = {channel.start() + window().from()};
    for (const Point& point : points) times.push_back(point.t);
    times.push_back(window().until() ? channel.start() + *window().until() : channel.end());
    std::sort(times.begin(), times.end());
    std::size_t longest = 1;
    for (std::size_t i = 2; i < times.size(); ++i) {
      if (times[i] - times[i - 1] > times[longest] - times[longest - 1]) longest = i;
    }
    const Duration gap = times[longest] - times[longest - 1];
    out << "the longest" << on_spacecraft(channel) << " is " << to_string(gap) << ", from "
        << when(channel, times[longest - 1]) << " to " << when(channel, times[longest]) << ", "
        << (gap > gap_ ? to_string(gap - gap_) + " too long" : to_string(gap_ - gap) + " to spare");
    return gap <= gap_;
  }
  std::string text() const override { return "without a gap longer than " + to_string(gap_); }

  Duration gap_;
};

// Not an OverWindow: of events, none is a count as well.
class Count final : public testing::MatcherInterface<const Channel&> {
 public:
  Count(int times, const TimeWindow& window) : times_(times), window_(window) {
    if (times >= 0) return;
    throw std::invalid_argument("HappensExactly: " + std::to_string(times) +
                                " times; accepted: 0 or more");
  }
  bool MatchAndExplain(const Channel& channel, MatchResultListener* out) const override {
    if (const std::string why = nothing_known(channel); !why.empty())
      return fails_anyway(*out, why);
    std::vector<SimTime> times;
    for (const Channel::Sample& sample : channel.samples()) {
      if (window_.contains(sample.t - channel.start())) times.push_back(sample.t);
    }
    std::sort(times.begin(), times.end());
    *out << "it happened " << times.size() << (times.size() == 1 ? " time" : " times")
         << on_spacecraft(channel) << instants(channel, times);
    return times.size() == static_cast<std::size_t>(times_);
  }
  void DescribeTo(std::ostream* out) const override {
    *out << "happens exactly " << times_ << (times_ == 1 ? " time" : " times") << window_.text();
  }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "happens other than " << times_ << (times_ == 1 ? " time" : " times") << window_.text();
  }

 private:
  std::string nothing_known(const Channel& channel) const {
    const std::string name = '"' + channel.name() + '"';
    if (window_.waits_in_vain()) return name + " has no window" + window_.text();
    if (const std::string why = forgotten(channel, window_); !why.empty()) return why;
    const bool sampled =
        channel.kind() == ChannelKind::kNumber || channel.kind() == ChannelKind::kVector;
    if (sampled && channel.empty()) return name + " has no sample, so nothing can be said of it";
    if (channel.end() - channel.start() >= window_.from()) return "";
    return name + " is known until " + when(channel, channel.end()) +
           " only, so nothing can be said of it" + window_.text();
  }
  // Up to five.
  static std::string instants(const Channel& channel, const std::vector<SimTime>& times) {
    std::string text;
    for (std::size_t i = 0; i < times.size() && i < 5; ++i) {
      text += (i == 0 ? ", at " : ", ") + when(channel, times[i]);
    }
    return times.size() > 5 ? text + " ... " + when(channel, times.back()) : text;
  }

  int times_;
  TimeWindow window_;
};

class Before final : public testing::MatcherInterface<const Channel&> {
 public:
  explicit Before(const Channel& other)
      : name_('"' + other.name() + '"'),
        first_(other.first_time()),
        forgotten_(forgotten(other, always())) {}
  bool MatchAndExplain(const Channel& channel, MatchResultListener* out) const override {
    for (const std::string& why : {forgotten(channel, always()), forgotten_}) {
      if (!why.empty()) return fails_anyway(*out, why);
    }
    const std::optional<SimTime> mine = channel.first_time();
    if (!mine) return fails_anyway(*out, '"' + channel.name() + "\" never happened");
    if (!first_) return fails_anyway(*out, name_ + " never happened");
    *out << "it first happened at " << when(channel, *mine) << on_spacecraft(channel) << ", "
         << (*mine < *first_    ? to_string(*first_ - *mine) + " before "
             : *mine == *first_ ? "at the same instant as "
                                : to_string(*mine - *first_) + " after ")
         << name_;
    return *mine < *first_;
  }
  void DescribeTo(std::ostream* out) const override { *out << "happens before " << name_; }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "does not happen before " << name_;
  }

 private:
  std::string name_;
  std::optional<SimTime> first_;
  std::string forgotten_;
};

// `axis` empty: each of the three.
class OnAxes final : public testing::MatcherInterface<const Channel&> {
 public:
  OnAxes(std::string axis, ChannelMatcher matcher)
      : axis_(std::move(axis)), matcher_(std::move(matcher)) {}

  bool MatchAndExplain(const Channel& channel, MatchResultListener* out) const override {
    if (channel.kind() != ChannelKind::kVector) {
      return fails_anyway(*out, '"' + channel.name() + "\" records " + to_string(channel.kind()) +
                                    ", which have no axes");
    }
    bool found = false, holds = true;
    std::string passes, failures;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!axis_.empty() && axis_ != channel.axis_name(axis)) continue;
      found = true;
      testing::StringMatchResultListener words;
      const Channel component = channel.along(axis);
      // Silently where GoogleTest asks silently: what fails anyway is to fail once.
      const bool matches = out->IsInterested() ? matcher_.MatchAndExplain(component, &words)
                                               : matcher_.Matches(component);
      if (!matches && !out->IsInterested()) return false;
      std::string& texts = matches ? passes : failures;
      texts += (texts.empty() ? "along " : "; along ") + std::string(channel.axis_name(axis)) +
               " " + words.str();
      holds = holds && matches;
    }
    if (!found) {
      return fails_anyway(*out, '"' + channel.name() + "\" has no axis " + axis_ + "; it has " +
                                    std::string(channel.axis_name(0)) + ", " +
                                    std::string(channel.axis_name(1)) + ", " +
                                    std::string(channel.axis_name(2)));
    }
    *out << (holds ? passes : failures);
    return holds;
  }
  void DescribeTo(std::ostream* out) const override {
    matcher_.DescribeTo(out);
    *out << where();
  }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "not: ";
    DescribeTo(out);
  }

 private:
  std::string where() const { return axis_.empty() ? " along each axis" : " along " + axis_; }

  std::string axis_;
  ChannelMatcher matcher_;
};

}  // namespace

ChannelMatcher NoGapLongerThan(Duration gap, const TimeWindow& window) {
  return ChannelMatcher(new NoGap(gap, window));
}

ChannelMatcher HappensExactly(int times, const TimeWindow& window) {
  return ChannelMatcher(new Count(times, window));
}

ChannelMatcher HappensBefore(const Channel& other) {
  return ChannelMatcher(new Before(other));
}

ChannelMatcher Along(std::string axis, ChannelMatcher matcher) {
  if (axis.empty()) throw std::invalid_argument("Along: an axis without a name");
  return ChannelMatcher(new OnAxes(std::move(axis), std::move(matcher)));
}

ChannelMatcher AlongEachAxis(ChannelMatcher matcher) {
  return ChannelMatcher(new OnAxes("", std::move(matcher)));
}

}  // namespace orrery
