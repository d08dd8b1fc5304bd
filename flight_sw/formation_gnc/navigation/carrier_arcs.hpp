/// The carrier-phase arcs of one receiver: which channel of the filter belongs to which satellite,
/// and where an arc ends.
#pragma once

#include <cstdint>

#include "formation_gnc/navigation/gnss_epoch.hpp"

namespace formation_gnc {

struct CarrierArc {
  std::uint8_t prn = 0;  ///< 0: channel free
  bool half_cycle = false;
  std::uint8_t rejections = 0;    ///< in a row
  float lock_s = 0.0f;            ///< as last reported
  std::int64_t begin_ns = 0;      ///< first epoch of the arc
  std::int64_t last_ns = 0;       ///< latest epoch
  std::int64_t walked_ns = 0;     ///< until when its process noise is in the covariance
  double base_cycles = 0.0;       ///< an integer, taken off the phase to keep numbers small
  double ambiguity_cycles = 0.0;  ///< the filter's estimate, of phase less base
};

/// Satellites that an epoch adds, and those that continue.
class CarrierArcs {
 public:
  /// Channel of a satellite, or -1.
  int find(int prn) const;
  /// True: the satellite has a channel, and its latest epoch is this one.
  bool seen(int prn, std::int64_t t_ns) const;
  const CarrierArc& operator[](int channel) const { return arc_[channel]; }
  CarrierArc& operator[](int channel) { return arc_[channel]; }

  /// True: the observation continues the arc of `channel`: lock time grew with time (0.1 s short of
  /// it at most, as it is sent rounded), parity as before, seen within 10 min.
  bool continues(int channel, const Observation& observation, std::int64_t t_ns) const;
  /// A channel for a new arc: the satellite's own, a free one, or that seen longest ago.
  int channel_for(int prn) const;

 private:
  CarrierArc arc_[kChannels];
};

}  // namespace formation_gnc
