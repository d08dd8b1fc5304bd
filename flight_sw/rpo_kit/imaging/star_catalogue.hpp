/// Stars that the camera can see, and which pairs of them are how far apart.
///
/// Method      Pairs sorted by separation, with a k-vector (Mortari & Neta 2000): an index of
///             equal steps in angle that leads to a range of separations without a search.
/// Frame       EME2000, J2000 with proper motion applied by who makes the catalogue; aberration is
///             the identifier's, since it depends on the velocity.
/// Memory      8 bytes a pair and 32 a star: 1 MB for 2900 stars (V < 5.5) and 18 deg.
#pragma once

#include <cstdint>
#include <vector>

#include "support/matrix.hpp"

namespace rpo_kit {

struct Star {
  flight_support::Vec3 direction_ECI;  ///< unit vector
  double magnitude = 0.0;
};

/// Two stars and their separation.
struct StarPair {
  float angle_rad;
  std::uint16_t a, b;
};

struct StarPairRange {
  const StarPair* begin;
  const StarPair* end;
};

class StarCatalogue {
 public:
  static constexpr int kMostStars = 65535;

  /// @param stars  Unit vectors; those beyond kMostStars are left out, the faintest first.
  /// @param pair_magnitude  Fainter stars are in no pair: they only confirm.
  /// @param max_pair_angle_rad  The diagonal of the field, say.
  StarCatalogue(std::vector<Star> stars, double pair_magnitude, double max_pair_angle_rad);

  /// By magnitude, brightest first.
  const std::vector<Star>& stars() const { return stars_; }
  std::size_t pair_count() const { return pairs_.size(); }
  /// All pairs with a separation in [low, high] rad, to 1e-7 rad (pairs are kept as floats).
  StarPairRange pairs_between(double low_rad, double high_rad) const;

 private:
  std::vector<Star> stars_;
  std::vector<StarPair> pairs_;
  std::vector<std::uint32_t> index_;  // pairs below each step
  double step_rad_;
};

}  // namespace rpo_kit
