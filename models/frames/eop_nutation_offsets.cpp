#include <orrery/models/frames/eop_nutation_offsets.hpp>
#include <orrery/models/frames/vector.hpp>

#include <erfa.h>

#include <cmath>

namespace orrery::eop {

NutationOffsets offsets_to_iau1980(const JulianDate& tt, double dX_rad, double dY_rad) {
  double X = 0, Y = 0, P[3][3];
  eraXy06(tt.day, tt.fraction, &X, &Y);
  X += dX_rad;
  Y += dY_rad;
  double pole_gcrs[3] = {X, Y, std::sqrt(1 - X * X - Y * Y)};
  double pole_mean[3];  // in the mean equator and equinox of date, IAU 1976
  eraPmat76(tt.day, tt.fraction, P);
  eraRxp(P, pole_gcrs, pole_mean);

  // In ecliptic axes the true pole is (sin dpsi sin eps, cos dpsi sin eps, cos eps), eps being the
  // true obliquity: the third row of the nutation matrix turned by the mean one.
  const double mean_obliquity = eraObl80(tt.day, tt.fraction);
  const double s = std::sin(mean_obliquity), c = std::cos(mean_obliquity);
  const Vec3 pole{pole_mean[0], c * pole_mean[1] + s * pole_mean[2],
                  c * pole_mean[2] - s * pole_mean[1]};
  const double dpsi = std::atan2(pole.x, pole.y);
  const double obliquity = std::atan2(std::sqrt(pole.x * pole.x + pole.y * pole.y), pole.z);

  double dpsi_1980 = 0, deps_1980 = 0;
  eraNut80(tt.day, tt.fraction, &dpsi_1980, &deps_1980);
  return {dpsi - dpsi_1980, obliquity - mean_obliquity - deps_1980};
}

}  // namespace orrery::eop
