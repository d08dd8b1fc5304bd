// parse_sp3: whatever it takes is complete, in order and finite.
#include <orrery/models/ephemeris/sp3.hpp>

#include "fuzz_check.hpp"

namespace orrery {
namespace {

void look_at(const Sp3& sp3, const Sp3Satellite& satellite) {
  fuzz_check(&sp3.satellite(satellite.id) == &satellite, "satellites are found by name");
  fuzz_check(satellite.records.size() <= sp3.epochs.size(), "one record an epoch at most");
  SimTime last = sp3.start - 1ns;
  for (const Sp3Record& record : satellite.records) {
    fuzz_check(record.t > last, "records are in order of time");
    fuzz_check(is_finite(record.r_ECEF) && norm(record.r_ECEF) < 2e9, "positions");
    fuzz_check(!record.v_ECEF || (sp3.has_velocities && is_finite(*record.v_ECEF)), "velocities");
    last = record.t;
  }
}

}  // namespace
}  // namespace orrery

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orrery;
  for (const bool excerpt : {false, true}) {
    const auto parse = [&](std::string_view text, std::string_view source) {
      return parse_sp3(text, source, {.excerpt = excerpt});
    };
    const std::optional<Sp3> sp3 = parsed_or_refused(parse, data, size);
    if (!sp3) continue;
    fuzz_check(!sp3->epochs.empty() && !sp3->satellites.empty(), "there is something");
    for (const Sp3Satellite& satellite : sp3->satellites) look_at(*sp3, satellite);
  }
  return 0;
}
