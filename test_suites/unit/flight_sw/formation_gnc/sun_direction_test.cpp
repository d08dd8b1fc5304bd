#include "formation_gnc/control/sun_direction.hpp"

#include <erfa.h>
#include <gtest/gtest.h>

#include "../flight_test_support.hpp"

namespace formation_gnc {
namespace {

using flight_support::kSecond_ns;
using flight_support::StateEci;
using flight_support::Vec3;
using flight_support::vec3;

constexpr double kArcsec_rad = flight_support::kPi / 648000.0;
constexpr double kAu_m = 1.495978707e11, kLight_aupd = 173.1446326847;
// 2016-01-01 00:00 GPST: MJD 57388; the GPS epoch is MJD 44244.
constexpr std::int64_t kBegin_ns = (57388LL - 44244) * 86400 * kSecond_ns;

double angle_rad(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b));
}

// Apparent place by ERFA: the Earth's ephemeris, and the relativistic aberration of an observer at
// `r_m` that moves with `v_mps`, both relative to the Earth. ICRS: 0.02" off EME2000.
Vec3 erfa_sun(std::int64_t t_ns, const Vec3& r_m, const Vec3& v_mps) {
  const double day = static_cast<double>(t_ns / (86400 * kSecond_ns));
  const double tt = (flight_support::seconds(t_ns % (86400 * kSecond_ns)) + 51.184) / 86400.0;
  double heliocentric[2][3], barycentric[2][3];
  eraEpv00(2444244.5 + day, tt, heliocentric, barycentric);
  double natural[3], v[3], apparent[3], v2 = 0.0;
  for (int k = 0; k < 3; ++k) {
    natural[k] = -heliocentric[0][k] - r_m[k] / kAu_m;
    v[k] = barycentric[1][k] / kLight_aupd + v_mps[k] / 299792458.0;
    v2 += v[k] * v[k];
  }
  double distance_au, unit[3];
  eraPn(natural, &distance_au, unit);
  eraAb(unit, v, distance_au, std::sqrt(1.0 - v2), apparent);
  return vec3(apparent[0], apparent[1], apparent[2]);
}

// Steps of 9.7 days: every phase of the month, the year and of Jupiter's and Venus' synodic
// periods.
template <class Visit>
void every_ten_days_from_2016_to_2030(const Visit& visit) {
  for (int k = 0; k < 564; ++k) visit(kBegin_ns + k * (838079 * kSecond_ns + 123456789));
}

// Asked for is 10" (2 mm at 40 m). Terms left out 0.2" (root of the sum of squares), so 1" is
// the most to expect of 564 places; frame bias 0.02", second order of aberration 0.001". Observed
// 0.85".
TEST(SunDirectionTest, GeocentricPlaceAgreesWithErfaFrom2016To2030) {
  double worst_rad = 0.0;
  every_ten_days_from_2016_to_2030([&](std::int64_t t_ns) {
    const Vec3 found = sun_direction_EME2000(t_ns);
    EXPECT_NEAR(norm(found), 1.0, 1e-15);
    worst_rad = std::fmax(worst_rad, angle_rad(found, erfa_sun(t_ns, Vec3(), Vec3())));
  });
  RecordProperty("worst_arcsec", std::to_string(worst_rad / kArcsec_rad));
  EXPECT_LT(worst_rad, 1.5 * kArcsec_rad) << worst_rad / kArcsec_rad << " arcsec";
}

// Parallax 9.5" and aberration 5.2" of a spacecraft are each far above the tolerance.
TEST(SunDirectionTest, PlaceFromASpacecraftAgreesWithErfa) {
  double worst_rad = 0.0, least_effect_rad = 1.0;
  every_ten_days_from_2016_to_2030([&](std::int64_t t_ns) {
    const Vec3 sun = sun_direction_EME2000(t_ns);
    const Vec3 across = cross(sun, vec3(0, 0, 1));
    const StateEci observer{(6.928e6 / norm(across)) * across, (-7585.0 / norm(across)) * across};
    const Vec3 found = sun_direction_EME2000(t_ns, observer);
    worst_rad =
        std::fmax(worst_rad, angle_rad(found, erfa_sun(t_ns, observer.r_ECI, observer.v_ECI)));
    least_effect_rad = std::fmin(least_effect_rad, angle_rad(found, sun));
  });
  EXPECT_LT(worst_rad, 1.5 * kArcsec_rad) << worst_rad / kArcsec_rad << " arcsec";
  EXPECT_GT(least_effect_rad, 13.0 * kArcsec_rad);  // a sum, as chosen: 14.4" to 14.9"
}

}  // namespace
}  // namespace formation_gnc
