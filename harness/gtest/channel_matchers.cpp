#include <orrery/harness/gtest/channel_matchers.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace orrery {
namespace {

using Samples = std::vector<Channel::Sample>;

// Six digits, in no locale.
std::string number(double value) {
  std::array<char, 32> text;
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 6);
  return std::string(text.data(), end.ptr);
}

std::string quantity(const Channel& channel, double value) {
  return number(value) + (channel.unit().empty() ? "" : " " + channel.unit());
}

std::string when(const Channel& channel, SimTime t) {
  return to_string(t - channel.start());
}

std::string counted(std::size_t n) {
  return std::to_string(n) + (n == 1 ? " sample" : " samples");
}

double checked(const char* matcher, double limit) {
  if (std::isfinite(limit)) return limit;
  throw std::invalid_argument(std::string(matcher) + ": limit " + number(limit) +
                              " is not a finite number");
}

Duration checked(const char* matcher, Duration span) {
  if (span > Duration::zero()) return span;
  throw std::invalid_argument(std::string(matcher) + ": a span of " + to_string(span) +
                              "; accepted: above 0 s");
}

// What all matchers share: the window, what it holds, and that an empty one fails.
class OverWindow : public testing::MatcherInterface<const Channel&> {
 public:
  explicit OverWindow(const When& window)
      : window_(window.window()), window_text_(text_of(window)) {}

  bool MatchAndExplain(const Channel& channel, testing::MatchResultListener* out) const override {
    const Samples samples = in_window(channel);
    if (samples.empty()) {
      // A failure of its own, since Not() would make a pass of the answer.
      ADD_FAILURE() << '"' << channel.name() << "\" has no sample" << window_text_ << " ("
                    << channel.samples().size() << " in all), so nothing can be said of it";
      *out << "there is no sample";
      return false;
    }
    for (const Channel::Sample& sample : samples) {
      if (!std::isnan(sample.value)) continue;
      *out << "it is not a number at " << when(channel, sample.t);
      return false;
    }
    return judge(channel, samples, *out);
  }
  void DescribeTo(std::ostream* out) const override { *out << "is " << text() << window_text_; }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "is not " << text() << window_text_;
  }

 protected:
  virtual bool judge(const Channel& channel, const Samples& samples,
                     testing::MatchResultListener& out) const = 0;
  virtual std::string text() const = 0;
  const When::Window& window() const { return window_; }

  Samples in_window(const Channel& channel) const {
    Samples kept;
    for (const Channel::Sample& sample : channel.samples()) {
      if (window_.contains(sample.t - channel.start())) kept.push_back(sample);
    }
    return kept;
  }

 private:
  static std::string text_of(const When& window) {
    const std::string text = window.to_string();
    return text == "always" ? "" : " " + text;
  }

  When::Window window_;
  std::string window_text_;
};

// AlwaysBelow and its kin: the sample nearest to the limit, or furthest beyond it, decides.
class Bounded final : public OverWindow {
 public:
  enum class Side { kBelow, kAbove };
  Bounded(const char* name, Side side, bool limit_allowed, double limit, const When& window)
      : OverWindow(window),
        side_(side),
        limit_allowed_(limit_allowed),
        limit_(checked(name, limit)) {}

 private:
  // How far inside the limit; negative: beyond it.
  double margin(double value) const {
    return side_ == Side::kBelow ? limit_ - value : value - limit_;
  }
  bool holds(double value) const { return limit_allowed_ ? margin(value) >= 0 : margin(value) > 0; }

  bool judge(const Channel& channel, const Samples& samples,
             testing::MatchResultListener& out) const override {
    const auto nearer = [this](const Channel::Sample& a, const Channel::Sample& b) {
      return margin(a.value) < margin(b.value);
    };
    const Channel::Sample& worst = *std::min_element(samples.begin(), samples.end(), nearer);
    out << "it is " << quantity(channel, worst.value) << " at " << when(channel, worst.t);
    if (holds(worst.value)) {
      out << ", the nearest miss of " << counted(samples.size()) << ", by "
          << quantity(channel, margin(worst.value));
      return true;
    }
    const auto offends = [this](const Channel::Sample& s) { return !holds(s.value); };
    const auto offences = std::count_if(samples.begin(), samples.end(), offends);
    const auto first = std::find_if(samples.begin(), samples.end(), offends);
    out << ", " << quantity(channel, -margin(worst.value)) << " beyond the limit, the worst of "
        << offences << " of " << counted(samples.size()) << "; the first is "
        << quantity(channel, first->value) << " at " << when(channel, first->t);
    return false;
  }
  std::string text() const override {
    const std::string side = side_ == Side::kBelow ? "below " : "above ";
    const std::string other = side_ == Side::kBelow ? "above " : "below ";
    return (limit_allowed_ ? "never " + other : "always " + side) + number(limit_);
  }

  Side side_;
  bool limit_allowed_;
  double limit_;
};

class Within final : public OverWindow {
 public:
  Within(double lower, double upper, const When& window)
      : OverWindow(window),
        lower_(checked("EventuallyWithin", lower)),
        upper_(checked("EventuallyWithin", upper)) {
    if (lower_ <= upper_) return;
    throw std::invalid_argument("EventuallyWithin: the interval [" + number(lower) + ", " +
                                number(upper) + "] is empty");
  }

 private:
  double outside(double value) const { return std::max({lower_ - value, value - upper_, 0.0}); }

  bool judge(const Channel& channel, const Samples& samples,
             testing::MatchResultListener& out) const override {
    const auto nearest = std::min_element(
        samples.begin(), samples.end(), [this](const Channel::Sample& a, const Channel::Sample& b) {
          return outside(a.value) < outside(b.value);
        });
    out << "it is " << quantity(channel, nearest->value) << " at " << when(channel, nearest->t);
    if (outside(nearest->value) == 0) return true;
    out << ", the nearest of " << counted(samples.size()) << ", off by "
        << quantity(channel, outside(nearest->value));
    return false;
  }
  std::string text() const override {
    return "eventually within [" + number(lower_) + ", " + number(upper_) + "]";
  }

  double lower_, upper_;
};

class Settles final : public OverWindow {
 public:
  Settles(double limit, Duration within, const When& window)
      : OverWindow(window),
        limit_(checked("SettlesBelow", limit)),
        within_(checked("SettlesBelow", within)) {}

 private:
  bool judge(const Channel& channel, const Samples& samples,
             testing::MatchResultListener& out) const override {
    const SimTime deadline = channel.start() + window().from + within_;
    const Channel::Sample* last_above = nullptr;
    std::size_t later = 0;
    for (const Channel::Sample& sample : samples) {
      if (sample.t > deadline) ++later;
      const bool above = sample.value >= limit_;
      if (above && (last_above == nullptr || sample.t > last_above->t)) last_above = &sample;
    }
    if (later == 0) {
      out << "nothing was recorded after " << when(channel, deadline);
      return false;
    }
    if (last_above == nullptr) {
      out << "it is below throughout";
      return true;
    }
    out << "it is " << quantity(channel, last_above->value) << " at "
        << when(channel, last_above->t) << " for the last time, "
        << to_string(last_above->t - (deadline - within_)) << " after the window's begin";
    return last_above->t <= deadline;
  }
  std::string text() const override {
    return "below " + number(limit_) + " from " + to_string(within_) + " after the begin on,";
  }

  double limit_;
  Duration within_;
};

class Rms final : public OverWindow {
 public:
  Rms(double limit, const When& window) : OverWindow(window), limit_(checked("RmsBelow", limit)) {}

 private:
  bool judge(const Channel& channel, const Samples& samples,
             testing::MatchResultListener& out) const override {
    double sum = 0;
    for (const Channel::Sample& sample : samples) sum += sample.value * sample.value;
    const double rms = std::sqrt(sum / static_cast<double>(samples.size()));
    const auto largest = std::max_element(samples.begin(), samples.end(),
                                          [](const Channel::Sample& a, const Channel::Sample& b) {
                                            return std::fabs(a.value) < std::fabs(b.value);
                                          });
    out << "the RMS of " << counted(samples.size()) << " is " << quantity(channel, rms)
        << ", the largest " << quantity(channel, largest->value) << " at "
        << when(channel, largest->t);
    return rms < limit_;
  }
  std::string text() const override { return "below " + number(limit_) + " in RMS"; }

  double limit_;
};

class Percentile final : public OverWindow {
 public:
  Percentile(double percent, double limit, const When& window)
      : OverWindow(window), percent_(percent), limit_(checked("PercentileBelow", limit)) {
    if (percent > 0 && percent <= 100) return;
    throw std::invalid_argument("PercentileBelow: " + number(percent) +
                                " %; accepted: above 0, at most 100");
  }

 private:
  bool judge(const Channel& channel, const Samples& samples,
             testing::MatchResultListener& out) const override {
    std::vector<double> values;
    for (const Channel::Sample& sample : samples) values.push_back(sample.value);
    const double rank = std::ceil(percent_ * static_cast<double>(values.size()) / 100);
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(std::max(rank, 1.0)) - 1;
    std::nth_element(values.begin(), place, values.end());
    out << "that percentile of " << counted(samples.size()) << " is " << quantity(channel, *place);
    return *place < limit_;
  }
  std::string text() const override {
    return "below " + number(limit_) + " in " + number(percent_) + " % of the samples";
  }

  double percent_, limit_;
};

class NoGap final : public OverWindow {
 public:
  NoGap(Duration gap, const When& window)
      : OverWindow(window), gap_(checked("NoGapLongerThan", gap)) {}

 private:
  bool judge(const Channel& channel, const Samples& samples,
             testing::MatchResultListener& out) const override {
    std::vector<SimTime> times = {channel.start() + window().from};
    for (const Channel::Sample& sample : samples) times.push_back(sample.t);
    if (window().until) times.push_back(channel.start() + *window().until);
    std::sort(times.begin(), times.end());
    std::size_t longest = 1;
    for (std::size_t i = 2; i < times.size(); ++i) {
      if (times[i] - times[i - 1] > times[longest] - times[longest - 1]) longest = i;
    }
    const Duration gap = times[longest] - times[longest - 1];
    out << "the longest is " << to_string(gap) << ", from " << when(channel, times[longest - 1])
        << " to " << when(channel, times[longest]);
    return gap <= gap_;
  }
  std::string text() const override { return "without a gap longer than " + to_string(gap_); }

  Duration gap_;
};

// Not an OverWindow: zero is a count, too.
class Count final : public testing::MatcherInterface<const Channel&> {
 public:
  Count(int times, const When& window)
      : times_(times), window_(window.window()), text_(window.to_string()) {
    if (times >= 0) return;
    throw std::invalid_argument("HappensExactly: " + std::to_string(times) +
                                " times; accepted: 0 or more");
  }
  bool MatchAndExplain(const Channel& channel, testing::MatchResultListener* out) const override {
    int happened = 0;
    const Channel::Sample* last = nullptr;
    for (const Channel::Sample& sample : channel.samples()) {
      if (!window_.contains(sample.t - channel.start())) continue;
      ++happened;
      last = &sample;
    }
    *out << "it happened " << happened << " times";
    if (last != nullptr) *out << ", the last at " << when(channel, last->t);
    return happened == times_;
  }
  void DescribeTo(std::ostream* out) const override {
    *out << "happens exactly " << times_ << " times, " << text_;
  }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "happens other than " << times_ << " times, " << text_;
  }

 private:
  int times_;
  When::Window window_;
  std::string text_;
};

class Before final : public testing::MatcherInterface<const Channel&> {
 public:
  explicit Before(const Channel& other) : other_(other) {}
  bool MatchAndExplain(const Channel& channel, testing::MatchResultListener* out) const override {
    if (channel.empty() || other_.empty()) {
      *out << (channel.empty() ? "it" : "\"" + other_.name() + "\"") << " never happened";
      return false;
    }
    const SimTime mine = first(channel), others = first(other_);
    *out << "it first happened at " << when(channel, mine) << ", \"" << other_.name() << "\" at "
         << when(other_, others);
    return mine < others;
  }
  void DescribeTo(std::ostream* out) const override {
    *out << "happens before \"" << other_.name() << "\"";
  }
  void DescribeNegationTo(std::ostream* out) const override {
    *out << "does not happen before \"" << other_.name() << "\"";
  }

 private:
  static SimTime first(const Channel& channel) {
    SimTime t = channel.samples().front().t;
    for (const Channel::Sample& sample : channel.samples()) t = std::min(t, sample.t);
    return t;
  }

  const Channel& other_;
};

}  // namespace

ChannelMatcher AlwaysBelow(double limit, const When& window) {
  return ChannelMatcher(new Bounded("AlwaysBelow", Bounded::Side::kBelow, false, limit, window));
}

ChannelMatcher NeverAbove(double limit, const When& window) {
  return ChannelMatcher(new Bounded("NeverAbove", Bounded::Side::kBelow, true, limit, window));
}

ChannelMatcher AlwaysAbove(double limit, const When& window) {
  return ChannelMatcher(new Bounded("AlwaysAbove", Bounded::Side::kAbove, false, limit, window));
}

ChannelMatcher NeverBelow(double limit, const When& window) {
  return ChannelMatcher(new Bounded("NeverBelow", Bounded::Side::kAbove, true, limit, window));
}

ChannelMatcher EventuallyWithin(double lower, double upper, const When& window) {
  return ChannelMatcher(new Within(lower, upper, window));
}

ChannelMatcher SettlesBelow(double limit, Duration within, const When& window) {
  return ChannelMatcher(new Settles(limit, within, window));
}

ChannelMatcher RmsBelow(double limit, const When& window) {
  return ChannelMatcher(new Rms(limit, window));
}

ChannelMatcher PercentileBelow(double percent, double limit, const When& window) {
  return ChannelMatcher(new Percentile(percent, limit, window));
}

ChannelMatcher NoGapLongerThan(Duration gap, const When& window) {
  return ChannelMatcher(new NoGap(gap, window));
}

ChannelMatcher HappensExactly(int times, const When& window) {
  return ChannelMatcher(new Count(times, window));
}

ChannelMatcher HappensBefore(const Channel& other) {
  return ChannelMatcher(new Before(other));
}

}  // namespace orrery
