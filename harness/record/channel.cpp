#include <orrery/harness/record/channel.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>
#include <stdexcept>
#include <utility>

namespace orrery {
namespace {

constexpr std::array<std::string_view, 30> kUnits = {
    "bytes", "deg", "degC", "degps", "dB", "dBHz", "g",     "Hz", "J",  "K",
    "kg",    "km",  "m",    "mps",   "ms", "N",    "Nm",    "Ns", "Pa", "T",
    "V",     "W",   "A",    "mps2",  "ns", "rad",  "radps", "s",  "us", "kmps"};

constexpr std::array<std::string_view, 7> kFrames = {"ECI", "ECEF", "RTN", "NED", "TEME", "B", "S"};

// The last word of a name, without what is before '_'; empty if it is the whole name.
std::string_view last_word(std::string_view name) {
  const std::size_t before = name.find_last_of("_/");
  if (before == std::string_view::npos || name[before] == '/') return {};
  return name.substr(before + 1);
}

template <class Words>
std::string_view if_among(const Words& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end() ? word : std::string_view{};
}

double norm_of(const Channel::Components& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

}  // namespace

std::string_view unit_of(std::string_view name) {
  return if_among(kUnits, last_word(name));
}

std::string_view frame_of(std::string_view name) {
  const std::string_view unit = unit_of(name);
  if (!unit.empty()) name.remove_suffix(unit.size() + 1);
  return if_among(kFrames, last_word(name));
}

const char* to_string(ChannelKind kind) {
  constexpr const char* kNames[] = {"numbers", "vectors", "states", "events"};
  return kNames[static_cast<int>(kind)];
}

Channel::Channel(std::string name, SimTime start)
    : Channel(std::move(name), ChannelKind::kNumber, start) {}

Channel::Channel(std::string name, std::string unit, SimTime start)
    : Channel(std::move(name), ChannelKind::kNumber, start) {
  unit_ = std::move(unit);
}

Channel::Channel(std::string name, ChannelKind kind, SimTime start)
    : name_(std::move(name)), kind_(kind), start_(start), end_(start), forgotten_until_(start) {
  if (kind_ == ChannelKind::kState || kind_ == ChannelKind::kEvent) return;
  unit_ = unit_of(name_);
  if (kind_ == ChannelKind::kVector) frame_ = frame_of(name_);
}

void Channel::add(SimTime t, double value) {
  require_kind(kind_ == ChannelKind::kNumber, "a number");
  add_sample(t, value);
}

void Channel::add(SimTime t, const Components& vector) {
  require_kind(kind_ == ChannelKind::kVector, "a vector");
  vectors_.push_back(vector);
  add_sample(t, norm_of(vector));
}

void Channel::add(SimTime t, std::string_view text) {
  require_kind(kind_ == ChannelKind::kState || kind_ == ChannelKind::kEvent, "a text");
  if (kind_ == ChannelKind::kState && !empty() && this->text(last()) == text) return extend_to(t);
  add_sample(t, index_of(text));
}

void Channel::add_sample(SimTime t, double value) {
  samples_.push_back({t, value});
  extend_to(t);
}

// When half of what there is may go: so each sample is moved once on average.
void Channel::forget_before(SimTime t) {
  const std::size_t half = samples_.size() / 2;
  if (half == 0 || samples_[half].t > t) return;
  const auto is_old = [t](const Sample& sample) { return sample.t < t; };
  auto gone = std::find_if_not(samples_.begin(), samples_.end(), is_old) - samples_.begin();
  if (kind_ == ChannelKind::kState && gone > 0) --gone;
  if (gone == 0) return;
  samples_.erase(samples_.begin(), samples_.begin() + gone);
  if (kind_ == ChannelKind::kVector) vectors_.erase(vectors_.begin(), vectors_.begin() + gone);
  forgotten_until_ = t;
}

// Few differ, so a search is short.
double Channel::index_of(std::string_view text) {
  auto found = std::find(texts_.begin(), texts_.end(), text);
  if (found == texts_.end()) found = texts_.insert(found, std::string(text));
  return static_cast<double>(found - texts_.begin());
}

std::string_view Channel::spacecraft() const {
  const std::size_t end = name_.find('/');
  return end == std::string::npos ? std::string_view{} : std::string_view(name_).substr(0, end);
}

std::string_view Channel::axis_name(std::size_t axis) const {
  const std::string_view names = frame_ == "RTN" ? "RTN" : frame_ == "NED" ? "NED" : "xyz";
  if (axis < 3) return names.substr(axis, 1);
  throw std::logic_error("Channel: axis " + std::to_string(axis) + " of \"" + name_ +
                         "\"; accepted: 0 to 2");
}

Channel Channel::along(std::size_t axis) const {
  require_kind(kind_ == ChannelKind::kVector, "an axis");
  Channel component(name_ + " along " + std::string(axis_name(axis)), unit_, start_);
  component.frame_ = frame_;
  for (std::size_t i = 0; i < samples_.size(); ++i) component.add(samples_[i].t, vectors_[i][axis]);
  component.extend_to(end_);
  component.forgotten_until_ = forgotten_until_;
  return component;
}

const std::string& Channel::text(const Sample& sample) const {
  require_kind(kind_ == ChannelKind::kState || kind_ == ChannelKind::kEvent, "a text");
  return texts_.at(static_cast<std::size_t>(sample.value));
}

Channel Channel::only(std::string_view wanted) const {
  require_kind(kind_ == ChannelKind::kState || kind_ == ChannelKind::kEvent, "a text");
  Channel kept(name_ + " " + std::string(wanted), ChannelKind::kEvent, start_);
  for (const Sample& sample : samples_) {
    if (text(sample) == wanted) kept.add(sample.t, wanted);
  }
  kept.extend_to(end_);
  kept.forgotten_until_ = forgotten_until_;
  return kept;
}

std::string_view Channel::state_at(SimTime t) const {
  require_kind(kind_ == ChannelKind::kState, "a state");
  const Sample* latest = nullptr;
  for (const Sample& sample : samples_) {
    if (sample.t <= t && (latest == nullptr || sample.t >= latest->t)) latest = &sample;
  }
  return latest == nullptr ? std::string_view{} : std::string_view(text(*latest));
}

double Channel::min() const {
  require_samples("min");
  double least = samples_.front().value;
  for (const Sample& sample : samples_) {
    if (std::isnan(sample.value)) return sample.value;
    least = std::min(least, sample.value);
  }
  return least;
}

double Channel::max() const {
  require_samples("max");
  double most = samples_.front().value;
  for (const Sample& sample : samples_) {
    if (std::isnan(sample.value)) return sample.value;
    most = std::max(most, sample.value);
  }
  return most;
}

const Channel::Sample& Channel::last() const {
  require_samples("last");
  return samples_.back();
}

std::optional<SimTime> Channel::first_time() const {
  std::optional<SimTime> first;
  for (const Sample& sample : samples_) first = std::min(first.value_or(sample.t), sample.t);
  return first;
}

void PrintTo(const Channel& channel, std::ostream* out) {
  *out << '"' << channel.name() << "\" (";
  const bool worded =
      channel.kind() == ChannelKind::kState || channel.kind() == ChannelKind::kEvent;
  const std::size_t count = channel.samples().size();
  if (channel.empty()) {
    *out << (worded ? std::string("no ") + to_string(channel.kind()) : "no samples") << ')';
  } else if (worded) {
    *out << count << ' ' << to_string(channel.kind()) << ", the last "
         << channel.text(channel.last()) << ')';
  } else {
    *out << count << (count == 1 ? " sample, " : " samples, ") << channel.min() << " to "
         << channel.max() << (channel.unit().empty() ? "" : " ") << channel.unit() << ')';
  }
}

void Channel::require_samples(const char* function) const {
  if (!samples_.empty()) return;
  throw std::logic_error("Channel::" + std::string(function) + ": nothing was recorded in \"" +
                         name_ + "\"");
}

void Channel::require_kind(bool fits, const char* what) const {
  if (fits) return;
  throw std::logic_error("Channel \"" + name_ + "\" records " + to_string(kind_) +
                         "; it was given or asked for " + what);
}

}  // namespace orrery
