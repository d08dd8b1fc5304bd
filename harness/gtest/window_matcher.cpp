#include <orrery/harness/gtest/window_matcher.hpp>

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace orrery::internal {
namespace {

std::string components_text(const Channel& channel, const Channel::Components& v) {
  std::string text = " (";
  std::size_t largest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    text += std::string(channel.axis_name(axis)) + " " + number(v[axis]) + (axis < 2 ? ", " : "");
    if (std::fabs(v[axis]) > std::fabs(v[largest])) largest = axis;
  }
  return text + "; most along " + std::string(channel.axis_name(largest)) + ")";
}

}  // namespace

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

std::string on_spacecraft(const Channel& channel) {
  return channel.spacecraft().empty() ? "" : " on " + std::string(channel.spacecraft());
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

bool fails_anyway(testing::MatchResultListener& out, const std::string& why) {
  if (!out.IsInterested()) ADD_FAILURE() << why;
  out << why;
  return false;
}

std::string forgotten(const Channel& channel, const TimeWindow& window) {
  if (channel.start() + window.from() >= channel.forgotten_until() ||
      channel.forgotten_until() == channel.start()) {
    return {};
  }
  return '"' + channel.name() + "\" is remembered from " +
         when(channel, channel.forgotten_until()) +
         " on only (WorldOptions::channel_memory), so nothing can be said of it" + window.text();
}

std::string placed(const Channel& channel, const Point& point) {
  std::string text = point.vector != nullptr ? "its norm is " : "it is ";
  text += quantity(channel, point.value) + " at " + when(channel, point.t) + on_spacecraft(channel);
  return point.vector == nullptr ? text : text + components_text(channel, *point.vector);
}

bool OverWindow::MatchAndExplain(const Channel& channel, testing::MatchResultListener* out) const {
  const std::string name = '"' + channel.name() + '"';
  const bool numeric =
      channel.kind() == ChannelKind::kNumber || channel.kind() == ChannelKind::kVector;
  if (!numeric && !asks_for_times_only()) {
    return fails_anyway(*out, name + " records " + to_string(channel.kind()) + ", not numbers");
  }
  if (const std::string why = forgotten(channel, window_); !why.empty()) {
    return fails_anyway(*out, why);
  }
  const Points points = in_window(channel);
  if (points.empty()) {
    return fails_anyway(*out, name + " has no sample" + window_.text() + " (" +
                                  std::to_string(channel.samples().size()) +
                                  " in all), so nothing can be said of it");
  }
  for (const Point& point : points) {
    if (std::isnan(point.value)) {
      return fails_anyway(*out, name + " is not a number at " + when(channel, point.t));
    }
  }
  return judge(channel, points, *out);
}

Points OverWindow::in_window(const Channel& channel) const {
  Points kept;
  if (window_.waits_in_vain()) return kept;
  const bool vector = channel.kind() == ChannelKind::kVector;
  for (std::size_t i = 0; i < channel.samples().size(); ++i) {
    const Channel::Sample& sample = channel.samples()[i];
    if (!window_.contains(sample.t - channel.start())) continue;
    kept.push_back({sample.t, sample.value, vector ? &channel.vectors()[i] : nullptr});
  }
  return kept;
}

}  // namespace orrery::internal
