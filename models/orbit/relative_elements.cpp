#include <orrery/models/orbit/relative_elements.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {

RelativeElements relative_elements(const QuasiNonsingularElements& chief,
                                   const QuasiNonsingularElements& deputy) {
  const double du = wrap_to_pi(deputy.u_rad - chief.u_rad);
  const double draan = wrap_to_pi(deputy.raan_rad - chief.raan_rad);
  return {(deputy.a_m - chief.a_m) / chief.a_m,
          wrap_to_pi(du + draan * std::cos(chief.i_rad)),
          deputy.ex - chief.ex,
          deputy.ey - chief.ey,
          deputy.i_rad - chief.i_rad,
          draan * std::sin(chief.i_rad)};
}

QuasiNonsingularElements deputy_elements(const QuasiNonsingularElements& chief,
                                         const RelativeElements& relative) {
  const double sin_i = std::sin(chief.i_rad);
  if (!(std::abs(sin_i) > 1e-9)) {
    throw std::invalid_argument("deputy_elements: chief's inclination = " +
                                std::to_string(chief.i_rad) + " rad; accepted: not equatorial");
  }
  const double draan = relative.diy / sin_i;
  const QuasiNonsingularElements deputy{
      chief.a_m * (1 + relative.da), chief.ex + relative.dex,
      chief.ey + relative.dey,       chief.i_rad + relative.dix,
      chief.raan_rad + draan,        chief.u_rad + relative.dl - draan * std::cos(chief.i_rad)};
  to_keplerian(deputy);  // for its checks
  return deputy;
}

double minimum_radial_normal_distance(const RelativeElements& x) {
  const double e2 = x.dex * x.dex + x.dey * x.dey;
  const double i2 = x.dix * x.dix + x.diy * x.diy;
  const double dot = x.dex * x.dix + x.dey * x.diy;
  // |de + di|^2 |de - di|^2, without forming the vectors.
  const double product = std::sqrt(std::max(0.0, (e2 + i2) * (e2 + i2) - 4 * dot * dot));
  const double below = e2 + i2 + product;
  return below == 0 ? 0 : std::sqrt(2 / below) * std::abs(dot);
}

}  // namespace orrery
