#include "rpo_kit/near_range/keypoint_finder.hpp"

#include <algorithm>
#include <cmath>

namespace rpo_kit {

using namespace flight_support;

namespace {

constexpr double kStep_px = 3.0, kFineStep_px = 1.0, kAgree_px = 1.5, kApart_px = 2.2;
constexpr double kTurned_rad = 0.35;

double turn_between(const Mat3& a, const Mat3& b) {
  const Mat3 D = a * transpose(b);
  return std::acos(std::clamp(0.5 * (D(0, 0) + D(1, 1) + D(2, 2) - 1.0), -1.0, 1.0));
}

// offset = a + b s along an edge, s from -1/2 to 1/2.
struct Line {
  bool found = false;
  double a = 0, b = 0, aa = 0, ab = 0, bb = 0;  // and its covariance
  double du = 0, dv = 0;

  double at(double s) const { return a + b * s; }
  double variance(double s) const { return aa + 2 * s * ab + s * s * bb; }
};

Line line_through(const std::vector<const EdgeSight*>& points, double point_px) {
  Line line;
  double gate_px = 1.5;
  for (int pass = 0; pass < 3; ++pass) {
    double n = 0, s1 = 0, s2 = 0, o = 0, os = 0, du = 0, dv = 0;
    for (const EdgeSight* p : points) {
      const double s = p->at.along - 0.5;
      if (std::fabs(p->offset_px - line.at(s)) > gate_px) continue;
      n += 1, s1 += s, s2 += s * s, o += p->offset_px, os += p->offset_px * s;
      du += p->du, dv += p->dv;
    }
    const double determinant = n * s2 - s1 * s1;
    // Four points, over a third of the edge.
    if (n < 4 || determinant < 0.01 * n * n) return {};
    line.a = (s2 * o - s1 * os) / determinant;
    line.b = (n * os - s1 * o) / determinant;
    const double variance = point_px * point_px / determinant;
    line.aa = s2 * variance, line.ab = -s1 * variance, line.bb = n * variance;
    const double length = std::hypot(du, dv);
    if (!(length > 0)) return {};
    line.du = du / length, line.dv = dv / length;
    gate_px = 3.0 * point_px;
  }
  line.found = true;
  return line;
}

}  // namespace

double KeypointFinder::agreement(EdgeFit& fit, const Pose& pose) const {
  return fit.support(pose, kAgree_px, kStep_px) * fit.shading(pose, to_sun_C_);
}

double KeypointFinder::best_half_turn(EdgeFit& fit) const {
  double best = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    Mat3 half = -1.0 * identity<3>();
    half(axis, axis) = 1.0;
    Pose pose = pose_;
    pose.R_CB = pose_.R_CB * half;
    if (!fit.refine(5.0, kStep_px, 8, &pose)) continue;
    if (turn_between(pose.R_CB, pose_.R_CB) < kTurned_rad) continue;
    best = std::max(best, agreement(fit, pose));
  }
  return best;
}

Finding KeypointFinder::track(EdgeFit& fit, const Pose& guess, double reach_px) {
  pose_ = guess;
  if (!fit.refine(std::clamp(3.0 * reach_px, 4.0, 20.0), kStep_px, 14, &pose_)) {
    return Finding::kNothing;
  }
  support_ = fit.support(pose_, kAgree_px, kStep_px);
  if (support_ < options_.least_support) return Finding::kNothing;
  return best_half_turn(fit) > agreement(fit, pose_) + options_.flip_margin ? Finding::kNothing
                                                                            : Finding::kTracked;
}

Finding KeypointFinder::acquire(EdgeFit& fit, const Camera& camera, const ImageView& image,
                                const PixelNoise& noise) {
  std::vector<Pose> candidates;
  if (!search_.look(camera, image, noise, &candidates)) return Finding::kNothing;
  std::vector<double> ratings;
  const double reach_px = std::clamp(0.08 * search_.size_px(), 4.0, 20.0);
  std::size_t best = 0;
  for (Pose& pose : candidates) {
    double rating = 0.0;
    if (fit.refine(reach_px, kStep_px, 14, &pose)) {
      rating = fit.support(pose, kAgree_px, kStep_px);
      rating *= rating > 0.3 ? search_.explained(camera, pose) * fit.shading(pose, to_sun_C_) : 0.0;
    }
    ratings.push_back(rating);
    if (rating > ratings[best]) best = ratings.size() - 1;
  }
  pose_ = candidates[best];
  support_ = fit.support(pose_, kAgree_px, kStep_px);
  if (ratings[best] < options_.least_acquired || support_ < options_.first_support) {
    return Finding::kNothing;
  }
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (turn_between(candidates[k].R_CB, pose_.R_CB) < kTurned_rad) continue;
    if (ratings[k] > options_.rival * ratings[best]) return Finding::kAmbiguous;
  }
  return Finding::kAcquired;
}

void KeypointFinder::corners(EdgeFit& fit, const Camera& camera, std::vector<Keypoint>* keypoints) {
  fit.look(pose_, 3.0, kFineStep_px, &sights_);
  // Where another edge is near, the steepest place is neither's.
  std::vector<std::vector<const EdgeSight*>> of_edge(wireframe_.edges().size());
  for (const EdgeSight& s : sights_) {
    if (!s.found) continue;
    const bool alone = std::none_of(sights_.begin(), sights_.end(), [&](const EdgeSight& other) {
      return other.at.edge != s.at.edge &&
             std::hypot(other.pixel.u - s.pixel.u, other.pixel.v - s.pixel.v) < kApart_px;
    });
    if (alone) of_edge[static_cast<std::size_t>(s.at.edge)].push_back(&s);
  }
  std::vector<Line> lines;
  for (const auto& points : of_edge) lines.push_back(line_through(points, options_.point_px));
  for (std::size_t k = 0; k < wireframe_.corners_B().size(); ++k) {
    // Where one line says nothing, along itself, the fitted pose does.
    const double open = 1.0 / (options_.open_px * options_.open_px);
    double uu = open, uv = 0, vv = open, u = 0, v = 0;
    int meet = 0;
    for (std::size_t e = 0; e < lines.size(); ++e) {
      const Wireframe::Edge& edge = wireframe_.edges()[e];
      const Line& line = lines[e];
      const int corner = static_cast<int>(k);
      if (!line.found || (edge.corners[0] != corner && edge.corners[1] != corner)) continue;
      const double s = edge.corners[0] == corner ? -0.5 : 0.5;
      const double w = 1.0 / (line.variance(s) + options_.floor_px * options_.floor_px);
      ++meet;
      uu += w * line.du * line.du, uv += w * line.du * line.dv, vv += w * line.dv * line.dv;
      u += w * line.du * line.at(s), v += w * line.dv * line.at(s);
    }
    const double determinant = uu * vv - uv * uv, half = 0.5 * (uu + vv);
    if (meet == 0) continue;
    // The larger half axis of the ellipse.
    const double least = half - std::sqrt(std::max(0.0, half * half - determinant));
    const double sigma_px = 1.0 / std::sqrt(least);
    Pixel at;
    if (!project(camera, pose_.r_BC_C + pose_.R_CB * wireframe_.corners_B()[k], &at)) {
      continue;
    }
    at.u += (vv * u - uv * v) / determinant;
    at.v += (uu * v - uv * u) / determinant;
    keypoints->push_back({static_cast<int>(k), at, sigma_px});
  }
}

Finding KeypointFinder::find(const Camera& camera, const ImageView& image, const PixelNoise& noise,
                             const Vec3& to_sun_C, const Pose* guess, double reach_px,
                             std::vector<Keypoint>* keypoints) {
  keypoints->clear();
  support_ = 0.0;
  to_sun_C_ = to_sun_C;
  EdgeFit fit(wireframe_, camera, image, noise);
  Finding finding = Finding::kNothing;
  if (guess != nullptr) finding = track(fit, *guess, reach_px);
  if (finding == Finding::kNothing) finding = acquire(fit, camera, image, noise);
  if (finding == Finding::kTracked || finding == Finding::kAcquired) {
    corners(fit, camera, keypoints);
  }
  return finding;
}

}  // namespace rpo_kit
