#include "rpo_kit/near_range/edge_fit.hpp"

#include <algorithm>
#include <cmath>

namespace rpo_kit {

using namespace flight_support;

namespace {

constexpr int kMostReach = 24;
constexpr int kFewestFound = 12;
constexpr double kStandOut = 5.0;    // sigmas of a step
constexpr double kOfSteepest = 0.3;  // of the steepest on the line: what is less is texture
constexpr double kMargin_px = 3.0;   // from the image's edge

}  // namespace

double EdgeFit::pixel_at(double u, double v) const {
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  const double x = u - column, y = v - row;
  const std::uint16_t* p = image_.pixels + static_cast<std::ptrdiff_t>(row) * image_.width + column;
  const std::uint16_t* q = p + image_.width;
  return (1 - y) * ((1 - x) * p[0] + x * p[1]) + y * ((1 - x) * q[0] + x * q[1]);
}

// Means of three pixels along the edge, their differences over two pixels across it; of the steep
// places the one nearest to the middle. Beyond the image there is none.
bool EdgeFit::steepest(const Pixel& at, double du, double dv, int reach, double* offset_px) const {
  double value[2 * kMostReach + 5];
  double slope[2 * kMostReach + 3];
  const int half = reach + 2;
  for (int k = -half; k <= half; ++k) {
    double sum = 0.0;
    for (int j = -1; j <= 1; ++j) {
      const double u = at.u + k * du - j * dv, v = at.v + k * dv + j * du;
      if (!(u >= 0.0 && v >= 0.0 && u < image_.width - 1 && v < image_.height - 1)) return false;
      sum += pixel_at(u, v);
    }
    value[k + half] = sum / 3.0;
  }
  double steepest = 0.0;
  const int slopes = 2 * half - 1;  // of value[1] to value[2 half - 1]
  for (int k = 0; k < slopes; ++k) {
    slope[k] = std::fabs(value[k + 2] - value[k]);
    steepest = std::max(steepest, slope[k]);
  }
  double best = 1e9;
  for (int k = 1; k + 1 < slopes; ++k) {
    if (slope[k] < slope[k - 1] || slope[k] <= slope[k + 1]) continue;
    if (slope[k] < kOfSteepest * steepest) continue;
    const double dn = std::max(0.0, std::max(value[k], value[k + 2]) - noise_.offset_dn);
    const double read_dn = noise_.read_electrons / noise_.electrons_per_dn;
    const double variance = read_dn * read_dn + dn / noise_.electrons_per_dn +
                            noise_.response * noise_.response * dn * dn;
    if (slope[k] < kStandOut * std::sqrt(variance / 3.0)) continue;
    const double bend = slope[k - 1] - 2.0 * slope[k] + slope[k + 1];
    const double part = bend < 0.0 ? 0.5 * (slope[k - 1] - slope[k + 1]) / bend : 0.0;
    const double offset = k + 1 - half + part;
    if (std::fabs(offset) < std::fabs(best)) best = offset;
  }
  if (!(std::fabs(best) <= reach)) return false;
  *offset_px = best;
  return true;
}

void EdgeFit::look(const Pose& pose, double reach_px, double step_px,
                   std::vector<EdgeSight>* sights) {
  sights->clear();
  const Vec3 eye_B = -1.0 * (transpose(pose.R_CB) * pose.r_BC_C);
  wireframe_.seen_from(eye_B, step_px * norm(pose.r_BC_C) / camera_.fx, &points_);
  const int reach = std::min(kMostReach, std::max(1, static_cast<int>(std::lround(reach_px))));
  for (const EdgePoint& point : points_) {
    EdgeSight sight;
    sight.at = point;
    const Vec3 p_C = pose.r_BC_C + pose.R_CB * point.point_B;
    Matrix<2, 3> partials;
    if (!project(camera_, p_C, &sight.pixel, &partials)) continue;
    if (!(sight.pixel.u > kMargin_px && sight.pixel.v > kMargin_px &&
          sight.pixel.u < image_.width - kMargin_px &&
          sight.pixel.v < image_.height - kMargin_px)) {
      continue;
    }
    const Wireframe::Edge& edge = wireframe_.edges()[static_cast<std::size_t>(point.edge)];
    const Matrix<2, 1> along = partials * (pose.R_CB * edge.unit_B);
    const double length = std::hypot(along[0], along[1]);
    if (!(length * edge.length_m > 3.0)) continue;  // seen end on
    sight.du = -along[1] / length, sight.dv = along[0] / length;
    sight.found = steepest(sight.pixel, sight.du, sight.dv, reach, &sight.offset_px);
    sights->push_back(sight);
  }
}

bool EdgeFit::step(double gate_px, Pose* pose, double* moved) {
  Matrix<6, 6> normal;
  Vector<6> right, d;
  int found = 0;
  for (const EdgeSight& s : sights_) {
    if (!s.found || std::fabs(s.offset_px) >= gate_px) continue;
    ++found;
    const Vec3 arm = pose->R_CB * s.at.point_B;
    Pixel pixel;
    Matrix<2, 3> partials;
    project(camera_, pose->r_BC_C + arm, &pixel, &partials);
    const double t = s.offset_px / gate_px, w = (1 - t * t) * (1 - t * t);
    Vec3 across;
    for (int k = 0; k < 3; ++k) across[k] = s.du * partials(0, k) + s.dv * partials(1, k);
    // d(p_C) = d(r) + arm x d: see the pose estimator.
    const Vec3 by_turn = cross(across, arm);
    Vector<6> J;
    for (int k = 0; k < 3; ++k) {
      J[kPosePosition + k] = across[k];
      J[kPoseRotation + k] = by_turn[k];
    }
    normal = normal + w * (J * transpose(J));
    right = right + (w * s.offset_px) * J;
  }
  if (found < kFewestFound) return false;
  // What the edges do not show, stays: 1 px per 30 m or 3 rad.
  for (int k = 0; k < 3; ++k) {
    normal(kPosePosition + k, kPosePosition + k) += 1e-3;
    normal(kPoseRotation + k, kPoseRotation + k) += 0.1;
  }
  if (!solve(normal, right, &d) || !is_finite(d)) return false;
  const Vec3 shift = vec3(d[0], d[1], d[2]);
  Vec3 turn = vec3(d[3], d[4], d[5]);
  if (norm(turn) > 0.3) turn = (0.3 / norm(turn)) * turn;
  pose->r_BC_C = pose->r_BC_C + shift;
  pose->R_CB = turned(turn, pose->R_CB);
  *moved = camera_.fx / norm(pose->r_BC_C) * (norm(turn) * wireframe_.radius_m() + norm(shift));
  return pose->r_BC_C[2] > 2.0 * wireframe_.radius_m() && is_finite(pose->R_CB);
}

bool EdgeFit::refine(double reach_px, double step_px, int iterations, Pose* pose) {
  double reach = reach_px;
  for (int k = 0; k < iterations; ++k) {
    look(*pose, reach, step_px, &sights_);
    double moved = 0.0;
    if (!step(reach + 0.5, pose, &moved)) return false;
    reach = std::max(2.0, 0.75 * reach);
    if (reach <= 2.0 && moved < 0.02) break;
  }
  return true;
}

double EdgeFit::shading(const Pose& pose, const Vec3& to_sun_C) const {
  const Mat3 R_BC = transpose(pose.R_CB);
  std::vector<FacePoint> points;
  wireframe_.lit_from(-1.0 * (R_BC * pose.r_BC_C), R_BC * to_sun_C, wireframe_.radius_m() / 20.0,
                      &points);
  double ss = 0, sa = 0, aa = 0, so = 0, ao = 0, oo = 0;
  for (const FacePoint& p : points) {
    Pixel at;
    if (!project(camera_, pose.r_BC_C + pose.R_CB * p.point_B, &at)) continue;
    if (!(at.u >= 0 && at.v >= 0 && at.u < image_.width - 1 && at.v < image_.height - 1)) continue;
    const double o = pixel_at(at.u, at.v) - noise_.offset_dn;
    ss += p.sunlight * p.sunlight, sa += p.sunlight * p.albedo, aa += p.albedo * p.albedo;
    so += p.sunlight * o, ao += p.albedo * o, oo += o * o;
  }
  if (!(oo > 0.0) || !(aa > 0.0)) return 0.0;
  // The best of both lights, of which neither is negative.
  double best = std::max(0.0, ao) * ao / aa;
  if (ss > 0.0) best = std::max(best, std::max(0.0, so) * so / ss);
  const double determinant = ss * aa - sa * sa;
  if (determinant > 1e-9 * ss * aa) {
    const double sun = (aa * so - sa * ao) / determinant, sky = (ss * ao - sa * so) / determinant;
    if (sun > 0.0 && sky > 0.0) best = sun * so + sky * ao;
  }
  return std::clamp(best / oo, 0.0, 1.0);
}

double EdgeFit::support(const Pose& pose, double reach_px, double step_px) {
  look(pose, reach_px, step_px, &sights_);
  int found = 0;
  for (const EdgeSight& s : sights_) found += s.found ? 1 : 0;
  return static_cast<int>(sights_.size()) < kFewestFound
             ? 0.0
             : found / static_cast<double>(sights_.size());
}

}  // namespace rpo_kit
