/// A quantity recorded over simulated time.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// The unit that a name ends in, as names are formed here ("angle_rad": "rad", "dv_mps": "mps"),
/// or empty if its last word is no unit ("dsc/camera/stars").
std::string_view unit_of(std::string_view name);

/// A time series with a name and a unit, one double per sample, in the order of recording.
class Channel {
 public:
  struct Sample {
    SimTime t;
    double value = 0;
    friend bool operator==(const Sample&, const Sample&) = default;
  };

  /// @param start  The world's; windows of matchers count from it. The unit is that of the name.
  explicit Channel(std::string name, SimTime start = {});
  Channel(std::string name, std::string unit, SimTime start = {});

  /// Any double, NaN included. Times usually increase, but need not: what flight software says of
  /// an earlier instant may come late.
  void add(SimTime t, double value) { samples_.push_back({t, value}); }

  const std::string& name() const { return name_; }  // "dsc/sun_sensor/angle_rad"
  const std::string& unit() const { return unit_; }
  SimTime start() const { return start_; }
  const std::vector<Sample>& samples() const { return samples_; }
  bool empty() const { return samples_.empty(); }

  /// Smallest and largest value; NaN if any sample is NaN.
  /// @throws std::logic_error  there are no samples.
  double min() const;
  double max() const;
  /// The sample recorded last. @throws std::logic_error  there are no samples.
  const Sample& last() const;

 private:
  void require_samples(const char* function) const;

  std::string name_, unit_;
  SimTime start_;
  std::vector<Sample> samples_;
};

/// For GoogleTest's messages: "dsc/sun_sensor/angle_rad" (100 samples, -0.1 to 0.3 rad)
void PrintTo(const Channel& channel, std::ostream* out);

}  // namespace orrery
