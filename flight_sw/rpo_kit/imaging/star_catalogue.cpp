#include "rpo_kit/imaging/star_catalogue.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rpo_kit {
namespace {

using flight_support::Vec3;

// Well conditioned at small angles, where acos is not.
double angle_between(const Vec3& a, const Vec3& b) {
  return 2.0 * std::asin(std::min(1.0, 0.5 * norm(a - b)));
}

bool nearer(const StarPair& p, const StarPair& q) {
  if (p.angle_rad != q.angle_rad) return p.angle_rad < q.angle_rad;
  return p.a != q.a ? p.a < q.a : p.b < q.b;
}

}  // namespace

StarCatalogue::StarCatalogue(std::vector<Star> stars, double pair_magnitude,
                             double max_pair_angle_rad)
    : stars_(std::move(stars)) {
  std::stable_sort(stars_.begin(), stars_.end(),
                   [](const Star& a, const Star& b) { return a.magnitude < b.magnitude; });
  if (stars_.size() > kMostStars) stars_.resize(kMostStars);
  const double least_cosine = std::cos(max_pair_angle_rad);
  const auto near = [&](std::size_t a, std::size_t b) {
    return dot(stars_[a].direction_ECI, stars_[b].direction_ECI) >= least_cosine;
  };
  std::size_t bright = 0, count = 0;
  for (; bright < stars_.size() && stars_[bright].magnitude <= pair_magnitude; ++bright) {
    for (std::size_t b = 0; b < bright; ++b) count += near(bright, b) ? 1 : 0;
  }
  pairs_.reserve(count);  // to the pair: a list that grows by doubling would take twice as much
  for (std::size_t a = 0; a < bright; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      if (!near(a, b)) continue;
      const double angle = angle_between(stars_[a].direction_ECI, stars_[b].direction_ECI);
      pairs_.push_back({static_cast<float>(angle), static_cast<std::uint16_t>(b),
                        static_cast<std::uint16_t>(a)});
    }
  }
  std::sort(pairs_.begin(), pairs_.end(), nearer);
  const std::size_t steps = pairs_.size() / 4 + 1;
  step_rad_ = max_pair_angle_rad / static_cast<double>(steps);
  index_.reserve(steps + 1);
  std::size_t below = 0;
  for (std::size_t k = 0; k <= steps; ++k) {
    const double limit = step_rad_ * static_cast<double>(k);
    while (below < pairs_.size() && pairs_[below].angle_rad < limit) ++below;
    index_.push_back(static_cast<std::uint32_t>(below));
  }
}

StarPairRange StarCatalogue::pairs_between(double low_rad, double high_rad) const {
  const double last = static_cast<double>(index_.size() - 1);
  const auto step = [&](double angle) {
    return static_cast<std::size_t>(std::clamp(std::floor(angle / step_rad_), 0.0, last));
  };
  std::size_t begin = index_[step(low_rad - 1e-7)];
  std::size_t end = begin;
  while (begin < pairs_.size() && pairs_[begin].angle_rad < low_rad - 1e-7) ++begin;
  end = std::max(begin, static_cast<std::size_t>(index_[step(high_rad + 1e-7)]));
  while (end < pairs_.size() && pairs_[end].angle_rad <= high_rad + 1e-7) ++end;
  return {pairs_.data() + begin, pairs_.data() + end};
}

}  // namespace rpo_kit
