// The four functions of the paper's Table 5 as calls of a flight library, one port each: so that
// they are timed where the library flies, on this processor or another. For table5.cpp.
//
// Epochs and ephemerides come as the package's own structs; `begin` answers with their sizes, which
// must be those of whoever sends.

#include <cstring>

#include "formation_gnc/navigation/navigation.hpp"
#include "orrery_flight.hpp"

namespace formation_gnc {
namespace {

using orrery_abi::Bytes;
using orrery_abi::Host;
using Port = orrery_abi::Port<class NavigationCalls>;

template <class Struct>
Struct taken(Bytes bytes) {
  Struct s;
  std::memcpy(static_cast<void*>(&s), bytes.data, sizeof s);
  return s;
}

class NavigationCalls {
 public:
  NavigationCalls(Host host, const orrery_boot&) : host_(host) {}

  std::int32_t ephemeris(std::int64_t, Bytes bytes) {
    if (bytes.size != sizeof(BroadcastEphemeris)) return ORRERY_REJECTED;
    const auto ephemeris = taken<BroadcastEphemeris>(bytes);
    navigation_.ephemeris(ephemeris);
    ephemerides_.add(ephemeris);
    return ORRERY_OK;
  }
  std::int32_t epoch_self(std::int64_t, Bytes bytes) { return epoch(Who::kSelf, bytes); }
  std::int32_t epoch_other(std::int64_t, Bytes bytes) { return epoch(Who::kOther, bytes); }
  /// From here on the filter is called function by function.
  std::int32_t begin(std::int64_t, Bytes) {
    const std::uint32_t sizes[2] = {sizeof(Measured), sizeof(BroadcastEphemeris)};
    filter_ = navigation_.filter();
    alone_ = true;
    return host_.output(8, Bytes{sizes, sizeof sizes});
  }
  std::int32_t time_update(std::int64_t, Bytes) {
    filter_.time_update(measured_[0].epoch.t_ns, none_);
    return ORRERY_OK;
  }
  std::int32_t graphic(std::int64_t, Bytes bytes) {
    const int k = bytes.size > 0 && *static_cast<const unsigned char*>(bytes.data) != 0;
    filter_.graphic_update(k == 0 ? Who::kSelf : Who::kOther, measured_[k].epoch, measured_[k].q_BI,
                           satellites_);
    return ORRERY_OK;
  }
  std::int32_t sdcp(std::int64_t, Bytes) {
    filter_.sdcp_update(measured_[0].epoch, measured_[0].q_BI, measured_[1].epoch,
                        measured_[1].q_BI, satellites_);
    return ORRERY_OK;
  }
  std::int32_t integers(std::int64_t, Bytes) {
    filter_.resolve_ambiguities();
    return ORRERY_OK;
  }
  std::int32_t tick(std::int64_t) { return ORRERY_OK; }

  static const Port (&ports())[9];

 private:
  struct Measured {
    GnssEpoch epoch;
    Quaternion q_BI;
  };

  std::int32_t epoch(Who who, Bytes bytes) {
    if (bytes.size != sizeof(Measured)) return ORRERY_REJECTED;
    Measured& m = measured_[static_cast<int>(who)];
    m = taken<Measured>(bytes);
    if (alone_) {
      satellites_.prepare(m.epoch, ephemerides_, {}, &earth_);
    } else if (who == Who::kSelf) {
      navigation_.own_epoch(m.epoch, m.q_BI);
    } else {
      navigation_.remote_epoch(m.epoch, m.q_BI);
    }
    return ORRERY_OK;
  }

  Host host_;
  Navigation navigation_;
  FormationFilter filter_;
  EphemerisStore ephemerides_;
  SatelliteTable satellites_;
  EarthAttitude earth_;
  ManeuverList none_;
  Measured measured_[2];
  bool alone_ = false;
};

const Port (&NavigationCalls::ports())[9] {
  static const Port kPorts[] = {
      {1, ORRERY_IN, ORRERY_PACKET, "ephemeris", 1000, &NavigationCalls::ephemeris},
      {2, ORRERY_IN, ORRERY_PACKET, "epoch_self", 4000, &NavigationCalls::epoch_self},
      {3, ORRERY_IN, ORRERY_PACKET, "epoch_other", 4000, &NavigationCalls::epoch_other},
      {4, ORRERY_IN, ORRERY_PACKET, "begin", 1, &NavigationCalls::begin},
      {5, ORRERY_IN, ORRERY_PACKET, "time_update", 1, &NavigationCalls::time_update},
      {6, ORRERY_IN, ORRERY_PACKET, "graphic", 1, &NavigationCalls::graphic},
      {7, ORRERY_IN, ORRERY_PACKET, "sdcp", 1, &NavigationCalls::sdcp},
      {9, ORRERY_IN, ORRERY_PACKET, "integers", 1, &NavigationCalls::integers},
      {8, ORRERY_OUT, ORRERY_PACKET, "sizes", 8, nullptr}};
  return kPorts;
}

}  // namespace
}  // namespace formation_gnc

using formation_gnc::NavigationCalls;
ORRERY_FLIGHT_LIBRARY(NavigationCalls, "navigation_calls", "1.0")
