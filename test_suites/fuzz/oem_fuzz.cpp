// parse_oem: whatever it takes is written, read back equal, and can be asked for states.
#include <orrery/models/ccsds/oem_interpolation.hpp>

#include <cmath>

#include "fuzz_check.hpp"

namespace orrery {
namespace {

void look_at(const Oem& oem, const CcsdsEpoch& epoch) {
  const TimeSystem system = oem.segments.front().metadata.time_system;
  try {
    const SimTime t = to_sim_time(epoch, system);
    fuzz_check(to_epoch(t, system) == epoch || system == TimeSystem::kTDB, "epochs convert back");
    const OemPoint point =
        interpolate(oem, t + 1s, OemInterpolation{InterpolationMethod::kHermite, 3});
    fuzz_check(point.segment < oem.segments.size(), "the segment exists");
  } catch (const std::logic_error&) {
    // Outside, overlapping, too few lines, years without leap seconds, ...: documented.
  }
}

}  // namespace
}  // namespace orrery

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orrery;
  const std::optional<Oem> oem = parsed_or_refused(parse_oem, data, size);
  if (!oem) return 0;
  const std::string written = write_oem(*oem);
  const Oem again = parse_oem(written, "written");
  fuzz_check(again == *oem, "what is written reads back equal");
  fuzz_check(write_oem(again) == written, "equal messages give equal bytes");
  for (const OemSegment& segment : oem->segments)
    for (const OemState& state : segment.states) look_at(*oem, state.epoch);
  return 0;
}
