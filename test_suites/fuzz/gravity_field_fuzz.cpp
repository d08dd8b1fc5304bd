// GravityField: whatever it takes is complete and within its limits, and can be summed.
#include <orrery/models/orbit/gravity.hpp>

#include <algorithm>
#include <cmath>

#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orrery;
  const auto parse = [](std::string_view text, std::string_view source) {
    return GravityField::parse(text, source);
  };
  const std::optional<GravityField> field = parsed_or_refused(parse, data, size);
  if (!field) return 0;
  fuzz_check(field->degree() >= 2 && field->degree() <= 360, "degree");
  fuzz_check(field->mu_m3ps2() > 0 && std::isfinite(field->mu_m3ps2()), "mu");
  fuzz_check(field->radius_m() > 0 && std::isfinite(field->radius_m()), "radius");
  fuzz_check(field->C(0, 0) == 1 && field->C(1, 0) == 0 && field->S(1, 1) == 0, "low degrees");
  for (int n = 2; n <= field->degree(); ++n) {
    for (int m = 0; m <= n; ++m)
      fuzz_check(std::abs(field->C(n, m)) <= 1 && std::abs(field->S(n, m)) <= 1, "coefficient");
  }
  const HarmonicGravity gravity(*field, std::min(field->degree(), 20));
  const double r = field->radius_m();
  if (r < 1e-100) return 0;  // its square is none
  fuzz_check(is_finite(gravity.perturbation_ECEF({r, 0.3 * r, -0.7 * r})), "acceleration");
  return 0;
}
