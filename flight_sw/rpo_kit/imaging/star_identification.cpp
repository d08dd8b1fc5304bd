#include "rpo_kit/imaging/star_identification.hpp"

#include <algorithm>
#include <cmath>

namespace rpo_kit {
namespace {

using flight_support::Mat3;
using flight_support::transpose;
using flight_support::Vec3;

constexpr double kLight_mps = 299792458.0;

double angle_between(const Vec3& a, const Vec3& b) {
  return 2.0 * std::asin(std::min(1.0, 0.5 * norm(a - b)));
}

// First order in v/c: 5e-9 rad left.
Vec3 aberrated(const Vec3& direction, const Vec3& v_ECI) {
  const Vec3 shifted = direction + (1.0 / kLight_mps) * v_ECI;
  return (1.0 / norm(shifted)) * shifted;
}

// How far the attitude's error may move a source at the edge of the field: the turn about the
// boresight counts by the field's radius, the others in full.
double reach_of(const Mat3& covariance_C, double field_radius_rad) {
  const double across = std::max(covariance_C(0, 0), covariance_C(1, 1));
  return std::sqrt(across + field_radius_rad * field_radius_rad * covariance_C(2, 2));
}

}  // namespace

int StarIdentifier::needed(std::size_t seen) const {
  return std::max(4, std::min(options_.needed, static_cast<int>(seen)));
}

double StarIdentifier::tolerance_rad(const SeenSource& a, const SeenSource& b) const {
  const double s = options_.systematic_rad;
  // Aberration moves a separation by up to 2 sin(angle/2) v/c: 1e-4 of the angle, 3e-5 rad.
  return options_.sigmas *
             std::sqrt(a.sigma_rad * a.sigma_rad + b.sigma_rad * b.sigma_rad + 2.0 * s * s) +
         1.05e-4 * angle_between(a.direction_C, b.direction_C);
}

// Catalogue pairs as far apart as these two, both ways round, sorted by the first star.
void StarIdentifier::neighbours_of_pair(const SeenSource& a, const SeenSource& b,
                                        std::vector<Neighbour>* list) {
  const double angle = angle_between(a.direction_C, b.direction_C);
  const double tolerance = tolerance_rad(a, b);
  const StarPairRange range = catalogue_.pairs_between(angle - tolerance, angle + tolerance);
  list->clear();
  for (const StarPair* pair = range.begin; pair != range.end; ++pair) {
    list->push_back({pair->a, pair->b});
    list->push_back({pair->b, pair->a});
  }
  std::sort(list->begin(), list->end(), [](const Neighbour& p, const Neighbour& q) {
    return p.star != q.star ? p.star < q.star : p.other < q.other;
  });
}

bool StarIdentifier::right_handed(const std::vector<SeenSource>& seen, const Triad& triad,
                                  const int star[3]) const {
  const auto volume = [](const Vec3& a, const Vec3& b, const Vec3& c) {
    return dot(a, cross(b, c));
  };
  const auto source = [&](int k) { return seen[static_cast<std::size_t>(triad.source[k])]; };
  const auto place = [&](int k) {
    return catalogue_.stars()[static_cast<std::size_t>(star[k])].direction_ECI;
  };
  return volume(source(0).direction_C, source(1).direction_C, source(2).direction_C) *
             volume(place(0), place(1), place(2)) >
         0.0;
}

// Of all sources that have a star.
void StarIdentifier::attitude_of(const std::vector<SeenSource>& seen, const Vec3& v_ECI,
                                 Identification* result) const {
  std::vector<DirectionPair> pairs;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    if (result->star[k] < 0) continue;
    const Star& star = catalogue_.stars()[static_cast<std::size_t>(result->star[k])];
    pairs.push_back({seen[k].direction_C, aberrated(star.direction_ECI, v_ECI),
                     std::hypot(seen[k].sigma_rad, options_.systematic_rad)});
  }
  result->identified = static_cast<int>(pairs.size());
  if (!solve_attitude(pairs.data(), result->identified, &result->attitude)) result->identified = 0;
}

void StarIdentifier::collect_field(const Mat3& R_CI) {
  const Vec3 boresight = transpose(R_CI) * flight_support::vec3(0.0, 0.0, 1.0);
  const double least = std::cos(options_.field_radius_rad + 0.01);
  field_.clear();
  for (std::size_t k = 0; k < catalogue_.stars().size(); ++k) {
    if (dot(catalogue_.stars()[k].direction_ECI, boresight) > least) {
      field_.push_back(static_cast<int>(k));
    }
  }
}

// Every source gets the only star within reach of where it would be; a star serves one source.
bool StarIdentifier::match(const std::vector<SeenSource>& seen, const Vec3& v_ECI, const Mat3& R_CI,
                           double reach_rad, Identification* result) {
  std::vector<double> distance(seen.size(), INFINITY);
  result->star.assign(seen.size(), -1);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const Vec3 direction = transpose(R_CI) * seen[k].direction_C;
    const double reach =
        reach_rad + options_.sigmas * std::hypot(seen[k].sigma_rad, options_.systematic_rad);
    double second = INFINITY;
    for (int star : field_) {
      const Vec3 place =
          aberrated(catalogue_.stars()[static_cast<std::size_t>(star)].direction_ECI, v_ECI);
      const double away = norm(place - direction);
      if (away < distance[k]) {
        second = distance[k];
        distance[k] = away;
        result->star[k] = star;
      } else {
        second = std::min(second, away);
      }
    }
    if (distance[k] > reach || second < 2.0 * reach) result->star[k] = -1;
    for (std::size_t j = 0; j < k; ++j) {
      if (result->star[k] < 0 || result->star[j] != result->star[k]) continue;
      result->star[distance[j] > distance[k] ? j : k] = -1;
    }
  }
  attitude_of(seen, v_ECI, result);
  return result->identified >= 3;
}

// Again with the better attitude and a smaller reach: wrong stars fall away.
bool StarIdentifier::refine(const std::vector<SeenSource>& seen, const Vec3& v_ECI,
                            const Mat3& R_CI, double reach_rad, Identification* result) {
  collect_field(R_CI);
  if (!match(seen, v_ECI, R_CI, reach_rad, result)) return false;
  // A wrong star among many moves the attitude by a part of the first reach, which its covariance
  // does not know.
  double least = reach_rad;
  for (int round = 0; round < 2; ++round) {
    const Mat3 better = result->attitude.R_CI;
    least = round == 0 ? 0.1 * least : 0.0;
    const double reach = std::max(least, options_.sigmas * reach_of(result->attitude.covariance_C,
                                                                    options_.field_radius_rad));
    if (!match(seen, v_ECI, better, reach, result)) return false;
  }
  return result->identified >= needed(seen.size());
}

bool StarIdentifier::try_triad(const std::vector<SeenSource>& seen, const Triad& triad,
                               const Vec3& v_ECI, Identification* best) {
  const auto source = [&](int k) { return seen[static_cast<std::size_t>(triad.source[k])]; };
  neighbours_of_pair(source(0), source(1), &pairs_[0]);
  neighbours_of_pair(source(0), source(2), &pairs_[1]);
  neighbours_of_pair(source(1), source(2), &pairs_[2]);
  const auto first_of = [](const std::vector<Neighbour>& list, int star) {
    return std::lower_bound(list.begin(), list.end(), star,
                            [](const Neighbour& n, int s) { return n.star < s; });
  };
  int found = 0;
  for (const Neighbour& ab : pairs_[0]) {
    auto ac = first_of(pairs_[1], ab.star);
    auto bc = first_of(pairs_[2], ab.other);
    while (ac != pairs_[1].end() && ac->star == ab.star && bc != pairs_[2].end() &&
           bc->star == ab.other) {
      if (ac->other != bc->other) {
        ++(ac->other < bc->other ? ac : bc);
        continue;
      }
      const int star[3] = {ab.star, ab.other, ac->other};
      ++ac, ++bc;
      if (!right_handed(seen, triad, star)) continue;
      Identification candidate;
      candidate.star.assign(seen.size(), -1);
      for (int k = 0; k < 3; ++k) {
        candidate.star[static_cast<std::size_t>(triad.source[k])] = star[k];
      }
      attitude_of(seen, v_ECI, &candidate);
      if (candidate.identified < 3) continue;
      const Mat3 R_CI = candidate.attitude.R_CI;
      const double reach =
          options_.sigmas * reach_of(candidate.attitude.covariance_C, options_.field_radius_rad);
      if (!refine(seen, v_ECI, R_CI, reach, &candidate)) continue;
      if (found > 0 && candidate.star == best->star) continue;
      if (found == 0 || candidate.identified > best->identified) *best = candidate;
      ++found;
    }
  }
  return found == 1;
}

bool StarIdentifier::lost_in_space(const std::vector<SeenSource>& seen, const Vec3& v_ECI,
                                   Identification* result) {
  const int n = std::min(static_cast<int>(seen.size()), options_.brightest);
  for (int dj = 1; dj < n - 1; ++dj) {
    for (int dk = 1; dj + dk < n; ++dk) {
      for (int i = 0; i + dj + dk < n; ++i) {
        if (try_triad(seen, {{i, i + dj, i + dj + dk}}, v_ECI, result)) return true;
      }
    }
  }
  return false;
}

bool StarIdentifier::track(const std::vector<SeenSource>& seen, const Vec3& v_ECI, const Mat3& R_CI,
                           double predicted_error_rad, Identification* result) {
  return refine(seen, v_ECI, R_CI, predicted_error_rad, result);
}

}  // namespace rpo_kit
