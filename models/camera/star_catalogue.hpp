/// Stars, from catalogues that the user has: none is compiled in.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace orrery {

/// Axes are the catalogue's, ICRS or FK5 at J2000.0, which ECI follows within 0.03".
struct Star {
  int number = 0;                   // of the catalogue: HR, HIP
  Vec3 direction_ECI{0, 0, 1};      // unit vector, epoch J2000.0, seen from the Sun
  Vec3 proper_motion_ECI_radpyr{};  // per Julian year, normal to it; 0 where unknown
  double magnitude = 0;             // V
  std::optional<double> b_v = {};   // colour B-V
};

/// Formats     xplanet's BSC (Debian package xplanet): declination [deg], right ascension [h] and
///             magnitude, then name and numbers; positions to 0.2" by 2.7", no proper motion. CSV
///             with a header line: ra_deg_j2000, dec_deg_j2000 and vmag; where given
///             pm_ra_cosdec_mas_yr and pm_dec_mas_yr (or ..._arcsec_yr), b_v, and hip or hr. Other
///             columns are passed over; an empty field is an unknown value.
/// Errors      std::invalid_argument "StarCatalogue: <source>, line N: ..." for a number that is
///             none or out of range, a column that is missing, a file without stars.
/// Checked by  test_suites/unit/models/camera/star_catalogue_test.cpp
class StarCatalogue {
 public:
  StarCatalogue() = default;
  /// @throws std::invalid_argument  a direction that is no unit vector, or a magnitude outside
  ///                                -30 to 30.
  explicit StarCatalogue(std::vector<Star> stars);
  static StarCatalogue parse_csv(std::string_view text, std::string_view source_name);
  static StarCatalogue parse_xplanet(std::string_view text, std::string_view source_name);
  /// CSV where the name ends in .csv. @throws std::invalid_argument  also if it cannot be read.
  static StarCatalogue load(const std::string& path);
  /// The Bright Star Catalogue of Debian's package xplanet, to V 6.5. @throws std::runtime_error
  /// it is not installed; says what to install.
  static StarCatalogue bright_stars();

  const std::vector<Star>& stars() const& { return stars_; }  // brightest first
  std::vector<Star> stars() && { return std::move(stars_); }
  /// Those of V at most `magnitude`.
  StarCatalogue to_magnitude(double magnitude) const;

 private:
  std::vector<Star> stars_;
};

/// Where a star stands `years` Julian years after J2000.0: space motion taken as uniform along a
/// straight line across the sky, unit vector. Parallax left out (below 0.8").
Vec3 direction_ECI(const Star& star, double years);
/// Julian years from J2000.0.
double julian_years(SimTime t);

/// The direction in which an observer moving with `v_ECI` [m/s] relative to the Sun sees what
/// stands in direction `u` (unit vector) for one at rest: the exact Lorentz transformation.
Vec3 aberrated(const Vec3& u_ECI, const Vec3& v_ECI);
/// Velocity of the Earth's centre relative to the barycentre of the Solar System [m/s]: eraEpv00.
Vec3 earth_velocity_ECI(SimTime t);

}  // namespace orrery
