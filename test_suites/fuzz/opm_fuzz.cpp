// parse_opm: whatever it takes is written and read back equal.
#include <orrery/models/ccsds/opm.hpp>

#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orrery;
  const std::optional<Opm> opm = parsed_or_refused(parse_opm, data, size);
  if (!opm) return 0;
  const std::string written = write_opm(*opm);
  const Opm again = parse_opm(written, "written");
  fuzz_check(again == *opm, "what is written reads back equal");
  fuzz_check(write_opm(again) == written, "equal messages give equal bytes");
  try {
    state_of(*opm);
  } catch (const std::invalid_argument&) {
    // Another frame, centre or time system: documented.
  }
  return 0;
}
