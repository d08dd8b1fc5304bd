// Property: whatever the bytes, the readers of almanacs refuse them naming the source, or give
// satellites of which a constellation can be made, in finite places.
#include <orrery/models/gnss/constellation.hpp>

#include "fuzz_check.hpp"

namespace orrery {
namespace {

void place(const GpsAlmanac& almanac) {
  const SimTime epoch = gps_midnight(2025, 3, 20);
  RandomStreams streams(1);
  GpsConstellation gps({.almanac = almanac}, epoch, streams);
  for (const GpsAlmanacEntry& entry : almanac) {
    const double r_m = norm(gps.at(epoch)[entry.prn].r_ECEF);
    fuzz_check(r_m > 1.9e7 && r_m < 3.4e7, "a satellite is where GPS satellites are");
  }
}

}  // namespace
}  // namespace orrery

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const auto parse : {orrery::parse_yuma, orrery::parse_sem, orrery::parse_almanac_table}) {
    if (const auto almanac = orrery::parsed_or_refused(parse, data, size)) orrery::place(*almanac);
  }
  return 0;
}
