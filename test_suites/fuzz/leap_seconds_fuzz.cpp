// LeapSecondTable: whatever it takes has a value from its first day on.
#include <orrery/models/frames/eop_leap_seconds.hpp>

#include <cmath>

#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orrery;
  const std::optional<LeapSecondTable> table =
      parsed_or_refused(LeapSecondTable::parse, data, size);
  if (!table) return 0;
  for (const int mjd : table->steps_mjd())
    fuzz_check(std::isfinite(table->tai_minus_utc_s(mjd)), "TAI - UTC is finite");
  return 0;
}
