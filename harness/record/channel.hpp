/// A quantity recorded over simulated time.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <array>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// The unit that a name ends in, as names are formed here ("angle_rad": "rad", "dv_mps": "mps"),
/// or empty if its last word is no unit ("dsc/camera/stars").
std::string_view unit_of(std::string_view name);
/// The frame that a name gives before its unit ("error_RTN_m": "RTN", "omega_BI_B_radps": "B"), or
/// empty: ECI, ECEF, RTN, NED, TEME, and the single letters B and S (body, sensor).
std::string_view frame_of(std::string_view name);

/// kNumber  a double per sample.
/// kVector  three components in the frame of the name; a sample's value is their norm.
/// kState   a discrete state by name, recorded when it changes and in force until the next.
/// kEvent   something that happened, with a text.
enum class ChannelKind { kNumber, kVector, kState, kEvent };
const char* to_string(ChannelKind kind);

/// A time series with a name, a kind, a unit and perhaps a frame, in the order of recording.
///
/// Names   "<spacecraft>/<source>/<quantity>[_<frame>][_<unit>]": "dsc/sun_sensor/angle_rad".
/// Times   Usually increase, but need not: what flight software says of an earlier instant may come
///         late.
/// Errors  std::logic_error  a sample of another kind than the channel's, or a figure of an empty
///         one; the message names the channel.
class Channel {
 public:
  using Components = std::array<double, 3>;
  struct Sample {
    SimTime t;
    double value = 0;  // of a state or an event: the index of its text
    friend bool operator==(const Sample&, const Sample&) = default;
  };

  /// @param start  The world's; windows of matchers count from it. Unit and frame are the name's.
  explicit Channel(std::string name, SimTime start = {});
  Channel(std::string name, std::string unit, SimTime start = {});
  Channel(std::string name, ChannelKind kind, SimTime start = {});

  /// Any double, NaN included.
  void add(SimTime t, double value);
  void add(SimTime t, const Components& vector);
  /// Of a state: the one that is in force from t on; nothing is added if it is already. Of an
  /// event: what happened.
  void add(SimTime t, std::string_view text);
  /// Says that all was recorded that there was up to t, be it nothing.
  void extend_to(SimTime t) { end_ = end_ < t ? t : end_; }
  /// Gives up samples recorded before the first at or after t, perhaps later on, in bulk; of a
  /// state the one in force at t stays. What is asked of an earlier time than forgotten_until()
  /// cannot be answered any more: matchers on such a window fail.
  void forget_before(SimTime t);
  /// start(), if nothing was given up.
  SimTime forgotten_until() const { return forgotten_until_; }

  const std::string& name() const { return name_; }
  ChannelKind kind() const { return kind_; }
  const std::string& unit() const { return unit_; }
  const std::string& frame() const { return frame_; }
  /// The name up to its first '/', or empty if it has none.
  std::string_view spacecraft() const;
  SimTime start() const { return start_; }
  /// Up to where it is known: the latest sample, or extend_to().
  SimTime end() const { return end_; }
  const std::vector<Sample>& samples() const { return samples_; }
  bool empty() const { return samples_.empty(); }

  /// Of a vector, beside samples().
  const std::vector<Components>& vectors() const { return vectors_; }
  /// "R", "T", "N" in RTN; "N", "E", "D" in NED; else "x", "y", "z".
  std::string_view axis_name(std::size_t axis) const;
  /// The components along one axis, as numbers: "dsc/navigation/error_RTN_m along T".
  Channel along(std::size_t axis) const;

  /// What a sample of a state or of an event says.
  const std::string& text(const Sample& sample) const;
  /// Those samples that say `text`, as events: entries into a state, events of one sort.
  Channel only(std::string_view text) const;
  /// The state in force at t: that of the latest sample at or before it; empty before the first.
  std::string_view state_at(SimTime t) const;

  /// Smallest and largest value; NaN if any sample is NaN. @throws std::logic_error  no samples.
  double min() const;
  double max() const;
  /// The sample recorded last. @throws std::logic_error  there are no samples.
  const Sample& last() const;
  /// The instant of the earliest sample; empty: there is none.
  std::optional<SimTime> first_time() const;

 private:
  void add_sample(SimTime t, double value);
  double index_of(std::string_view text);
  void require_samples(const char* function) const;
  void require_kind(bool fits, const char* what) const;

  std::string name_, unit_, frame_;
  ChannelKind kind_ = ChannelKind::kNumber;
  SimTime start_, end_, forgotten_until_;
  std::vector<Sample> samples_;
  std::vector<Components> vectors_;  // of kVector, one per sample
  std::vector<std::string> texts_;   // of kState and kEvent, each once
};

/// For GoogleTest's messages: "dsc/sun_sensor/angle_rad" (100 samples, -0.1 to 0.3 rad)
void PrintTo(const Channel& channel, std::ostream* out);

}  // namespace orrery
