// Property: whatever the bytes, the reader of RINEX navigation files refuses them naming the
// source, or gives ephemerides whose satellites are in finite places.
#include <orrery/models/gnss/broadcast_orbit.hpp>
#include <orrery/models/gnss/rinex_navigation.hpp>

#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto nav = orrery::parsed_or_refused(orrery::RinexNavigation::parse, data, size);
  if (!nav) return 0;
  for (const orrery::BroadcastEphemeris& e : nav->ephemerides) {
    const auto state = orrery::broadcast_state(e, orrery::time_of_ephemeris(e));
    const double r_m = orrery::norm(state.r_ECEF);
    orrery::fuzz_check(r_m > 1.9e7 && r_m < 3.4e7, "a satellite is where GPS satellites are");
  }
  return 0;
}
