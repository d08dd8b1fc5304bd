#include "rpo_kit/near_range/pose_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>

namespace rpo_kit {
namespace {

using namespace flight_support;

// Real roots of a quartic: all four by Durand-Kerner, the nearly real ones polished by Newton.
int real_roots(const double a[5], double roots[4]) {
  if (!(std::fabs(a[4]) > 1e-14 * (std::fabs(a[0]) + std::fabs(a[2])))) return 0;
  using Complex = std::complex<double>;
  const auto polynomial = [&](Complex x) {
    return (((x + a[3] / a[4]) * x + a[2] / a[4]) * x + a[1] / a[4]) * x + a[0] / a[4];
  };
  Complex z[4] = {{1.0, 0.0}, {0.4, 0.9}, {-0.65, 0.72}, {-0.908, -0.297}};
  for (int iteration = 0; iteration < 60; ++iteration) {
    double moved = 0.0;
    for (int k = 0; k < 4; ++k) {
      Complex others = 1.0;
      for (int j = 0; j < 4; ++j) {
        if (j != k) others *= z[k] - z[j];
      }
      if (!(std::norm(others) > 0.0)) return 0;
      const Complex step = polynomial(z[k]) / others;
      z[k] -= step;
      moved = std::max(moved, std::norm(step));
    }
    if (moved < 1e-28) break;
  }
  int count = 0;
  for (const Complex& root : z) {
    // A double root, as of weak perspective, comes as a pair that is 1e-3 off the axis.
    if (root.imag() * root.imag() < 0.0004 * std::norm(root)) roots[count++] = root.real();
  }
  return count;
}

// The rotation and shift that take three points of B to three of C: by their triads.
void align(const Vec3 points_B[3], const Vec3 points_C[3], Pose* pose) {
  const auto triad = [](const Vec3 p[3]) {
    Vec3 x = p[1] - p[0];
    x = (1.0 / norm(x)) * x;
    Vec3 z = cross(x, p[2] - p[0]);
    z = (1.0 / norm(z)) * z;
    const Vec3 y = cross(z, x);
    Mat3 columns;
    for (int k = 0; k < 3; ++k) columns(k, 0) = x[k], columns(k, 1) = y[k], columns(k, 2) = z[k];
    return columns;
  };
  pose->R_CB = triad(points_C) * transpose(triad(points_B));
  pose->r_BC_C = points_C[0] - pose->R_CB * points_B[0];
}

Mat3 hat(const Vec3& v) {
  return Mat3{{{0, -v[2], v[1]}, {v[2], 0, -v[0]}, {-v[1], v[0], 0}}};
}

class PoseFit {
 public:
  PoseFit(const Camera& camera, const std::vector<Vec3>& points_B,
          const std::vector<Keypoint>& seen)
      : camera_(camera), points_B_(points_B), seen_(seen) {}

  // Of one keypoint [px]; infinite behind the camera.
  double miss_px(const Pose& pose, const Keypoint& keypoint) const {
    Pixel pixel;
    const Vec3& point = points_B_[static_cast<std::size_t>(keypoint.point)];
    if (!project(camera_, pose.r_BC_C + pose.R_CB * point, &pixel)) return INFINITY;
    const double du = pixel.u - keypoint.pixel.u, dv = pixel.v - keypoint.pixel.v;
    return std::sqrt(du * du + dv * dv);
  }

  int count(const Pose& pose, double reach_px) const {
    int inliers = 0;
    for (const Keypoint& keypoint : seen_) inliers += miss_px(pose, keypoint) < reach_px ? 1 : 0;
    return inliers;
  }

  // Gauss-Newton over the keypoints within reach. @return false if it has no solution there.
  bool refine(double reach_px, double gate_sigma, Pose* pose) const {
    for (int iteration = 0; iteration < 12; ++iteration) {
      const double reach = iteration < 4 ? reach_px : 0.0;
      Matrix<6, 6> normal;
      Vector<6> right, step;
      double squares = 0.0;
      pose->inliers = 0;
      for (const Keypoint& keypoint : seen_) {
        const double gate = std::max(reach, gate_sigma * keypoint.sigma_px);
        if (miss_px(*pose, keypoint) > gate) continue;
        add(*pose, keypoint, &normal, &right, &squares);
        ++pose->inliers;
      }
      if (pose->inliers < 4 || !solve(normal, right, &step) || !is_finite(step)) return false;
      pose->r_BC_C = pose->r_BC_C + vec3(step[0], step[1], step[2]);
      pose->R_CB = turned(vec3(step[3], step[4], step[5]), pose->R_CB);
      const double per_degree = squares / std::max(1, 2 * pose->inliers - 6);
      pose->residual = std::sqrt(squares / (2.0 * pose->inliers));
      if (iteration < 6 || norm(step) > 1e-9) continue;
      if (!solve(normal, identity<6>(), &pose->covariance)) return false;
      pose->covariance = std::max(1.0, per_degree) * symmetric(pose->covariance);
      return true;
    }
    return false;
  }

 private:
  void add(const Pose& pose, const Keypoint& keypoint, Matrix<6, 6>* normal, Vector<6>* right,
           double* squares) const {
    const Vec3 arm = pose.R_CB * points_B_[static_cast<std::size_t>(keypoint.point)];
    Pixel pixel;
    Matrix<2, 3> partials;
    project(camera_, pose.r_BC_C + arm, &pixel, &partials);
    // d(p_C) = d(r) - d x arm = d(r) + arm x d, with R' = (I - [d x]) R.
    const Matrix<2, 3> by_turn = partials * hat(arm);
    const double w = 1.0 / (keypoint.sigma_px * keypoint.sigma_px);
    Matrix<2, 6> J;
    for (int row = 0; row < 2; ++row) {
      for (int k = 0; k < 3; ++k) {
        J(row, kPosePosition + k) = partials(row, k);
        J(row, kPoseRotation + k) = by_turn(row, k);
      }
    }
    Vector<2> r;
    r[0] = keypoint.pixel.u - pixel.u;
    r[1] = keypoint.pixel.v - pixel.v;
    *normal = *normal + w * (transpose(J) * J);
    *right = *right + w * (transpose(J) * r);
    *squares += w * dot(r, r);
  }

  const Camera& camera_;
  const std::vector<Vec3>& points_B_;
  const std::vector<Keypoint>& seen_;
};

struct Triple {
  int at[3];
};

// All of them while they are few; otherwise a fixed sequence (SplitMix64 of the place in it).
std::vector<Triple> triples(int count, int most) {
  std::vector<Triple> list;
  if (count <= 12) {
    for (int i = 0; i < count; ++i) {
      for (int j = i + 1; j < count; ++j) {
        for (int k = j + 1; k < count; ++k) list.push_back({{i, j, k}});
      }
    }
    return list;
  }
  std::uint64_t state = 0;
  const auto draw = [&]() {
    state += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return static_cast<int>((z ^ (z >> 31)) % static_cast<std::uint64_t>(count));
  };
  while (static_cast<int>(list.size()) < most) {
    const int i = draw();
    const int j = draw();
    const int k = draw();
    if (i != j && j != k && i != k) list.push_back({{i, j, k}});
  }
  return list;
}

// The best by inliers, of equals the first: a thousand solutions of triples need no room.
constexpr std::size_t kMostCandidates = 12;

void keep(const Pose& pose, std::vector<Pose>* best) {
  const auto better = [](const Pose& a, const Pose& b) { return a.inliers > b.inliers; };
  best->insert(std::upper_bound(best->begin(), best->end(), pose, better), pose);
  if (best->size() > kMostCandidates) best->pop_back();
}

double turn_between_rad(const Mat3& a, const Mat3& b) {
  const Mat3 D = a * transpose(b);
  return std::acos(std::clamp(0.5 * (D(0, 0) + D(1, 1) + D(2, 2) - 1.0), -1.0, 1.0));
}

}  // namespace

Mat3 turned(const Vec3& d, const Mat3& R) {
  const double angle = norm(d);
  if (angle < 1e-12) return R - hat(d) * R;
  const double s = std::sin(angle) / angle, c = (1.0 - std::cos(angle)) / (angle * angle);
  const Mat3 D = identity<3>() - s * hat(d) + c * (hat(d) * hat(d));
  return D * R;
}

// Symbols as in Haralick et al. (1994), table 1 and eq. (9): s2 = u s1, s3 = v s1.
int solve_three_points(const Vec3 points_B[3], const Vec3 directions_C[3], Pose poses[4]) {
  const double a = norm(points_B[1] - points_B[2]), b = norm(points_B[0] - points_B[2]);
  const double c = norm(points_B[0] - points_B[1]);
  const double area = norm(cross(points_B[1] - points_B[0], points_B[2] - points_B[0]));
  if (!(area > 1e-6 * (a * a + b * b + c * c))) return 0;  // on one line
  const double alpha = dot(directions_C[1], directions_C[2]);
  const double beta = dot(directions_C[0], directions_C[2]);
  const double gamma = dot(directions_C[0], directions_C[1]);
  const double b2 = b * b, q = (a * a - c * c) / b2, p = (a * a + c * c) / b2;
  const double c2 = c * c / b2, a2 = a * a / b2;
  const double quartic[5] = {
      (1 + q) * (1 + q) - 4 * a2 * gamma * gamma,
      4 * (-q * (1 + q) * beta + 2 * a2 * gamma * gamma * beta - (1 - p) * alpha * gamma),
      2 * (q * q - 1 + 2 * q * q * beta * beta + 2 * (1 - c2) * alpha * alpha -
           4 * p * alpha * beta * gamma + 2 * (1 - a2) * gamma * gamma),
      4 * (q * (1 - q) * beta - (1 - p) * alpha * gamma + 2 * c2 * alpha * alpha * beta),
      (q - 1) * (q - 1) - 4 * c2 * alpha * alpha};
  double roots[4];
  const int count = real_roots(quartic, roots);
  int found = 0;
  for (int k = 0; k < count; ++k) {
    const double v = roots[k];
    const double below = 2 * (gamma - v * alpha);
    const double under = 1 + v * v - 2 * v * beta;
    if (!(v > 0.0) || std::fabs(below) < 1e-12 || !(under > 0.0)) continue;
    const double u = ((q - 1) * v * v - 2 * q * beta * v + 1 + q) / below;
    const double s1 = b / std::sqrt(under);
    if (!(u > 0.0)) continue;
    const Vec3 points_C[3] = {s1 * directions_C[0], u * s1 * directions_C[1],
                              v * s1 * directions_C[2]};
    align(points_B, points_C, &poses[found]);
    if (is_finite(poses[found].R_CB)) ++found;
  }
  return found;
}

bool estimate_pose(const Camera& camera, const std::vector<Vec3>& points_B,
                   const std::vector<Keypoint>& seen, const PoseOptions& options, Pose* pose) {
  const PoseFit fit(camera, points_B, seen);
  std::vector<Vec3> directions(seen.size());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const bool known =
        seen[k].point >= 0 && static_cast<std::size_t>(seen[k].point) < points_B.size();
    if (!known || !unproject(camera, seen[k].pixel, &directions[k])) return false;
  }
  std::vector<Pose> candidates;
  candidates.reserve(kMostCandidates + 1);
  for (const Triple& triple : triples(static_cast<int>(seen.size()), options.most_triples)) {
    Vec3 from_B[3], towards_C[3];
    for (int k = 0; k < 3; ++k) {
      const std::size_t at = static_cast<std::size_t>(triple.at[k]);
      from_B[k] = points_B[static_cast<std::size_t>(seen[at].point)];
      towards_C[k] = directions[at];
    }
    Pose solutions[4];
    const int count = solve_three_points(from_B, towards_C, solutions);
    for (int k = 0; k < count; ++k) {
      solutions[k].inliers = fit.count(solutions[k], options.consensus_px);
      if (solutions[k].inliers >= 4) keep(solutions[k], &candidates);
    }
  }
  bool found = false;
  for (Pose& candidate : candidates) {
    if (!fit.refine(options.consensus_px, options.gate_sigma, &candidate)) {
      candidate.inliers = 0;
      continue;
    }
    const bool better = !found || candidate.inliers > pose->inliers ||
                        (candidate.inliers == pose->inliers && candidate.residual < pose->residual);
    if (better) *pose = candidate;
    found = true;
  }
  if (!found || pose->inliers < options.least_inliers) return false;
  pose->rival_inliers = 0;
  for (const Pose& other : candidates) {
    if (turn_between_rad(other.R_CB, pose->R_CB) < 0.52) continue;
    pose->rival_inliers = std::max(pose->rival_inliers, other.inliers);
  }
  return true;
}

}  // namespace rpo_kit
