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

}  // namespace

std::string_view unit_of(std::string_view name) {
  const std::size_t before = name.find_last_of("_/");
  if (before == std::string_view::npos || name[before] == '/') return {};
  const std::string_view word = name.substr(before + 1);
  return std::find(kUnits.begin(), kUnits.end(), word) != kUnits.end() ? word : std::string_view{};
}

Channel::Channel(std::string name, SimTime start)
    : name_(std::move(name)), unit_(unit_of(name_)), start_(start) {}

Channel::Channel(std::string name, std::string unit, SimTime start)
    : name_(std::move(name)), unit_(std::move(unit)), start_(start) {}

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

void PrintTo(const Channel& channel, std::ostream* out) {
  *out << '"' << channel.name() << "\" (";
  if (channel.empty()) {
    *out << "no samples)";
    return;
  }
  const std::size_t count = channel.samples().size();
  *out << count << (count == 1 ? " sample, " : " samples, ") << channel.min() << " to "
       << channel.max() << (channel.unit().empty() ? "" : " ") << channel.unit() << ')';
}

void Channel::require_samples(const char* function) const {
  if (!samples_.empty()) return;
  throw std::logic_error("Channel::" + std::string(function) + ": nothing was recorded in \"" +
                         name_ + "\"");
}

}  // namespace orrery
