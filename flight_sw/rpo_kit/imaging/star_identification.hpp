/// Which star is which: lost in space and from a predicted attitude, and the attitude from it.
///
/// Method      Pyramid (Mortari, Samaan, Bruccoleri & Junkins, Navigation 51(3), 2004): triads in
///             the order that leaves a false star soonest; pairs by k-vector, triangles where three
///             pairs close with the right handedness; the attitude that a triangle gives must then
///             show further stars where they are. Tracking: nearest star of the predicted field,
///             if no other is near.
/// Chance      A wrong triangle shows one more star by chance with 4e-4 (40 stars, 15 deg, 1
///             arcmin); two more are asked for, unless only four sources are seen.
/// Aberration  Catalogue directions are shifted by the observer's velocity, so that the attitude
///             is of EME2000 and a target's direction geometric.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/star_identification_test.cpp
#pragma once

#include <vector>

#include "rpo_kit/imaging/attitude.hpp"
#include "rpo_kit/imaging/star_catalogue.hpp"

namespace rpo_kit {

/// A source as seen: unit vector and 1-sigma per axis. Brightest first.
struct SeenSource {
  flight_support::Vec3 direction_C;
  double sigma_rad = 0.0;
};

struct IdentificationOptions {
  double sigmas = 4.0;            ///< of separations and of places
  double systematic_rad = 1e-5;   ///< added to every 1-sigma: distortion, catalogue
  int brightest = 12;             ///< sources of which triads are made
  int needed = 5;                 ///< identified stars, 4 if no more are seen
  double field_radius_rad = 0.2;  ///< from the boresight to a corner
};

struct Identification {
  Attitude attitude;
  std::vector<int> star;  ///< per source: place in the catalogue, -1 for none
  int identified = 0;
};

class StarIdentifier {
 public:
  /// @param catalogue  Outlives this object.
  explicit StarIdentifier(const StarCatalogue& catalogue, const IdentificationOptions& options = {})
      : catalogue_(catalogue), options_(options) {}

  /// @param v_ECI  Of the camera relative to the solar system's barycentre [m/s]; 2 km/s off is
  ///               1.4 arcsec off.
  bool lost_in_space(const std::vector<SeenSource>& seen, const flight_support::Vec3& v_ECI,
                     Identification* result);
  /// @param predicted_error_rad  How far off `R_CI` may be; below the distance of neighbours.
  bool track(const std::vector<SeenSource>& seen, const flight_support::Vec3& v_ECI,
             const flight_support::Mat3& R_CI, double predicted_error_rad, Identification* result);

 private:
  struct Neighbour {
    std::uint16_t star, other;
  };
  struct Triad {
    int source[3];
  };

  double tolerance_rad(const SeenSource& a, const SeenSource& b) const;
  void neighbours_of_pair(const SeenSource& a, const SeenSource& b, std::vector<Neighbour>* list);
  bool try_triad(const std::vector<SeenSource>& seen, const Triad& triad,
                 const flight_support::Vec3& v_ECI, Identification* best);
  bool right_handed(const std::vector<SeenSource>& seen, const Triad& triad,
                    const int star[3]) const;
  void attitude_of(const std::vector<SeenSource>& seen, const flight_support::Vec3& v_ECI,
                   Identification* result) const;
  void collect_field(const flight_support::Mat3& R_CI);
  bool match(const std::vector<SeenSource>& seen, const flight_support::Vec3& v_ECI,
             const flight_support::Mat3& R_CI, double reach_rad, Identification* result);
  bool refine(const std::vector<SeenSource>& seen, const flight_support::Vec3& v_ECI,
              const flight_support::Mat3& R_CI, double reach_rad, Identification* result);
  int needed(std::size_t seen) const;

  const StarCatalogue& catalogue_;
  IdentificationOptions options_;
  std::vector<Neighbour> pairs_[3];
  std::vector<int> field_;
};

}  // namespace rpo_kit
