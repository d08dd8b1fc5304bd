// EarthOrientationTable: whatever it takes gives plausible numbers over all that it covers.
#include <orrery/models/frames/eop_table.hpp>

#include <cmath>

#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orrery;
  const std::optional<EarthOrientationTable> table =
      parsed_or_refused(EarthOrientationTable::parse, data, size);
  if (!table) return 0;
  fuzz_check(table->first() < table->last(), "the table covers something");
  fuzz_check(table->first() <= table->last_observed() && table->last_observed() <= table->last(),
             "observations lie within it");
  const Duration step = (table->last() - table->first()) / 7;
  for (int i = 0; i <= 7; ++i) {
    const EarthOrientationParameters p = table->at(table->first() + i * step);
    // Cubics through values within the readers' limits: weights sum to at most 1.7 in the table.
    fuzz_check(std::abs(p.ut1_minus_utc_s) < 5, "UT1-UTC");
    fuzz_check(std::abs(p.x_pole_rad) < 1e-4 && std::abs(p.y_pole_rad) < 1e-4, "pole");
    fuzz_check(std::abs(p.dpsi_rad) < 1e-4 && std::abs(p.deps_rad) < 1e-4, "offsets");
    fuzz_check(std::isfinite(p.length_of_day_s), "length of day");
  }
  return 0;
}
