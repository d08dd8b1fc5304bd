#include <orrery/harness/gtest/channel_matchers.hpp>
#include <orrery/harness/gtest/window_matcher.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace orrery {
namespace {

using namespace internal;
using testing::MatchResultListener;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

std::string beside_limit(const Channel& channel, double margin) {
  if (margin == 0) return "at the limit";
  return quantity(channel, std::fabs(margin)) +
         (margin < 0 ? " beyond the limit" : " inside the limit");
}

void check_interval(const char* name, double lower, double upper) {
  if (checked(name, lower) <= checked(name, upper)) return;
  throw std::invalid_argument(std::string(name) + ": the interval [" + number(lower) + ", " +
                              number(upper) + "] is empty");
}

// AlwaysBelow and its kin: the sample nearest to a limit, or furthest beyond it, decides.
class Bounded final : public OverWindow {
 public:
  struct Limits {
    double lower = -kNoLimit, upper = kNoLimit;
    bool allowed = false;  // the limits themselves
  };
  Bounded(std::string text, const Limits& limits, const TimeWindow& window)
      : OverWindow(window), text_(std::move(text)), limits_(limits) {}

 private:
  // How far inside; negative: beyond.
  double margin(const Point& point) const {
    return std::min(limits_.upper - point.value, point.value - limits_.lower);
  }
  bool holds(const Point& point) const {
    return limits_.allowed ? margin(point) >= 0 : margin(point) > 0;
  }

  bool judge(const Channel& channel, const Points& points,
             MatchResultListener& out) const override {
    const auto nearer = [this](const Point& a, const Point& b) { return margin(a) < margin(b); };
    const Point& worst = *std::min_element(points.begin(), points.end(), nearer);
    out << placed(channel, worst);
    if (holds(worst)) {
      out << ", the nearest miss of " << counted(points.size()) << ", by "
          << quantity(channel, margin(worst));
      return true;
    }
    const auto offends = [this](const Point& point) { return !holds(point); };
    const auto offences = std::count_if(points.begin(), points.end(), offends);
    const Point& first = *std::find_if(points.begin(), points.end(), offends);
    out << ", " << quantity(channel, -margin(worst)) << " beyond the limit, the worst of "
        << offences << " of " << counted(points.size()) << "; the first is "
        << quantity(channel, first.value) << " at " << when(channel, first.t);
    return false;
  }
  std::string text() const override { return text_; }

  std::string text_;
  Limits limits_;
};

class Within final : public OverWindow {
 public:
  Within(double lower, double upper, const TimeWindow& window)
      : OverWindow(window), lower_(lower), upper_(upper) {
    check_interval("EventuallyWithin", lower, upper);
  }

 private:
  double outside(const Point& point) const {
    return std::max({lower_ - point.value, point.value - upper_, 0.0});
  }

  bool judge(const Channel& channel, const Points& points,
             MatchResultListener& out) const override {
    const auto nearest = std::min_element(
        points.begin(), points.end(),
        [this](const Point& a, const Point& b) { return outside(a) < outside(b); });
    out << placed(channel, *nearest);
    if (outside(*nearest) == 0) {
      out << ", the first of " << counted(points.size()) << " that is";
      return true;
    }
    out << ", the nearest of " << counted(points.size()) << ", off by "
        << quantity(channel, outside(*nearest));
    return false;
  }
  std::string text() const override {
    return "eventually within [" + number(lower_) + ", " + number(upper_) + "]";
  }

  double lower_, upper_;
};

class Settles final : public OverWindow {
 public:
  Settles(double limit, Duration within, const TimeWindow& window)
      : OverWindow(window),
        limit_(checked("SettlesBelow", limit)),
        within_(checked("SettlesBelow", within)) {}

 private:
  bool judge(const Channel& channel, const Points& points,
             MatchResultListener& out) const override {
    const SimTime begin = channel.start() + window().from(), deadline = begin + within_;
    const Point *last_above = nullptr, *worst_later = nullptr;
    for (const Point& point : points) {
      if (point.value >= limit_ && (last_above == nullptr || point.t > last_above->t)) {
        last_above = &point;
      }
      if (point.t <= deadline) continue;
      if (worst_later == nullptr || point.value > worst_later->value) worst_later = &point;
    }
    if (worst_later == nullptr) {
      return fails_anyway(out, '"' + channel.name() + "\" has no sample after " +
                                   when(channel, deadline) + ", so nothing says that it settled");
    }
    if (last_above == nullptr) {
      out << "it is below throughout";
    } else {
      out << placed(channel, *last_above) << " for the last time, "
          << to_string(last_above->t - begin) << " after the window's begin";
      if (last_above->t > deadline) out << ", " << to_string(last_above->t - deadline) << " late";
    }
    out << "; from " << when(channel, deadline) << " on it is at most "
        << quantity(channel, worst_later->value) << ", at " << when(channel, worst_later->t) << ", "
        << beside_limit(channel, limit_ - worst_later->value);
    return worst_later->value < limit_;
  }
  std::string text() const override {
    return "below " + number(limit_) + " from " + to_string(within_) + " after the begin on,";
  }

  double limit_;
  Duration within_;
};

class Rms final : public OverWindow {
 public:
  Rms(double limit, const TimeWindow& window)
      : OverWindow(window), limit_(checked("RmsBelow", limit)) {}

 private:
  bool judge(const Channel& channel, const Points& points,
             MatchResultListener& out) const override {
    double sum = 0;
    for (const Point& point : points) sum += point.value * point.value;
    const double rms = std::sqrt(sum / static_cast<double>(points.size()));
    const auto largest = std::max_element(
        points.begin(), points.end(),
        [](const Point& a, const Point& b) { return std::fabs(a.value) < std::fabs(b.value); });
    out << "the RMS of " << counted(points.size()) << " is " << quantity(channel, rms) << ", "
        << beside_limit(channel, limit_ - rms) << "; at the largest " << placed(channel, *largest);
    return rms < limit_;
  }
  std::string text() const override { return "below " + number(limit_) + " in RMS"; }

  double limit_;
};

class Percentile final : public OverWindow {
 public:
  Percentile(double percent, double limit, const TimeWindow& window)
      : OverWindow(window), percent_(percent), limit_(limit) {}

 private:
  bool judge(const Channel& channel, const Points& points,
             MatchResultListener& out) const override {
    Points sorted = points;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Point& a, const Point& b) { return a.value < b.value; });
    const double rank = std::ceil(percent_ * static_cast<double>(sorted.size()) / 100);
    const Point& at_rank = sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
    out << "at that percentile of " << counted(points.size()) << " " << placed(channel, at_rank)
        << ", " << beside_limit(channel, limit_ - at_rank.value);
    return at_rank.value < limit_;
  }
  std::string text() const override {
    return "below " + number(limit_) + " in " + number(percent_) + " % of the samples";
  }

  double percent_, limit_;
};

}  // namespace

ChannelMatcher AlwaysBelow(double limit, const TimeWindow& window) {
  return ChannelMatcher(new Bounded("always below " + number(limit),
                                    {.upper = checked("AlwaysBelow", limit)}, window));
}

ChannelMatcher NeverAbove(double limit, const TimeWindow& window) {
  return ChannelMatcher(new Bounded("never above " + number(limit),
                                    {.upper = checked("NeverAbove", limit), .allowed = true},
                                    window));
}

ChannelMatcher AlwaysAbove(double limit, const TimeWindow& window) {
  return ChannelMatcher(new Bounded("always above " + number(limit),
                                    {.lower = checked("AlwaysAbove", limit)}, window));
}

ChannelMatcher NeverBelow(double limit, const TimeWindow& window) {
  return ChannelMatcher(new Bounded("never below " + number(limit),
                                    {.lower = checked("NeverBelow", limit), .allowed = true},
                                    window));
}

ChannelMatcher AlwaysWithin(double lower, double upper, const TimeWindow& window) {
  check_interval("AlwaysWithin", lower, upper);
  return ChannelMatcher(new Bounded("always within [" + number(lower) + ", " + number(upper) + "]",
                                    {.lower = lower, .upper = upper, .allowed = true}, window));
}

ChannelMatcher EventuallyWithin(double lower, double upper, const TimeWindow& window) {
  return ChannelMatcher(new Within(lower, upper, window));
}

ChannelMatcher SettlesBelow(double limit, Duration within, const TimeWindow& window) {
  return ChannelMatcher(new Settles(limit, within, window));
}

ChannelMatcher RmsBelow(double limit, const TimeWindow& window) {
  return ChannelMatcher(new Rms(limit, window));
}

PercentileBelow::PercentileBelow(double percent, double limit, const TimeWindow& window)
    : percent_(percent), limit_(checked("PercentileBelow", limit)), window_(window) {
  if (percent > 0 && percent <= 100) return;
  throw std::invalid_argument("PercentileBelow: " + number(percent) +
                              " %; accepted: above 0, at most 100");
}

PercentileBelow::operator ChannelMatcher() const {
  return ChannelMatcher(new Percentile(percent_, limit_, window_));
}

}  // namespace orrery
