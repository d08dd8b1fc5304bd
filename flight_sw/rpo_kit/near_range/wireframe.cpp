#include "rpo_kit/near_range/wireframe.hpp"

#include <algorithm>
#include <cmath>

namespace rpo_kit {

using namespace flight_support;

namespace {

// By which what hides is before what it hides: an edge lies on faces, a point of a face under a
// patch.
constexpr double kBefore_m = 0.01, kPatch_m = 0.001;
constexpr double kSunFar_m = 1000.0;
constexpr int kFewestPoints = 3, kMostPointsOfEdge = 40;

}  // namespace

bool Wireframe::set(const std::vector<Vec3>& corners_B, const std::vector<WireframeFace>& faces) {
  *this = Wireframe();
  corners_ = corners_B;
  for (const Vec3& corner : corners_) radius_ = std::max(radius_, norm(corner));
  for (const WireframeFace& given : faces) {
    if (given.count < 3 || given.count > kMostFaceCorners) return false;
    Face face;
    for (int k = 0; k < given.count; ++k) {
      const int corner = given.corners[k];
      if (corner < 0 || corner >= static_cast<int>(corners_.size())) return false;
      face.corners.push_back(corner);
      face.middle_B = face.middle_B + (1.0 / given.count) * corners_[std::size_t(corner)];
    }
    const auto at = [&](std::size_t k) {
      return corners_[static_cast<std::size_t>(face.corners[k])];
    };
    const Vec3 normal = cross(at(1) - at(0), at(2) - at(0));
    if (!(norm(normal) > 1e-9)) return false;
    face.albedo = given.albedo;
    face.normal_B = (1.0 / norm(normal)) * normal;
    face.offset_m = dot(face.normal_B, at(0));
    for (std::size_t k = 0; k < face.corners.size(); ++k) {
      if (std::fabs(dot(face.normal_B, at(k)) - face.offset_m) > kBefore_m) return false;
      face.reach_m = std::max(face.reach_m, norm(at(k) - face.middle_B));
    }
    faces_.push_back(face);
    for (std::size_t k = 0; k < face.corners.size(); ++k) {
      add_edge(face.corners[k], face.corners[(k + 1) % face.corners.size()],
               static_cast<int>(faces_.size()) - 1);
    }
  }
  return true;
}

void Wireframe::add_edge(int from, int to, int face) {
  for (Edge& edge : edges_) {
    const bool same = (edge.corners[0] == from && edge.corners[1] == to) ||
                      (edge.corners[0] == to && edge.corners[1] == from);
    if (!same || edge.faces[1] >= 0) continue;
    edge.faces[1] = face;
    return;
  }
  Edge edge;
  edge.corners[0] = from, edge.corners[1] = to;
  edge.faces[0] = face;
  const Vec3 d = corners_[static_cast<std::size_t>(to)] - corners_[static_cast<std::size_t>(from)];
  edge.length_m = norm(d);
  edge.unit_B = (1.0 / std::max(edge.length_m, 1e-9)) * d;
  edges_.push_back(edge);
}

// Where the ray from the eye to the point meets the plane of the face.
bool Wireframe::hides(const Face& face, const Vec3& eye_B, const Vec3& point_B,
                      double before_m) const {
  const Vec3 ray = point_B - eye_B;
  const double down = dot(face.normal_B, ray);
  if (!(down < 0.0)) return false;  // turned away
  const double part = (face.offset_m - dot(face.normal_B, eye_B)) / down;
  if (!(part > 0.0) || (1.0 - part) * norm(ray) < before_m) return false;
  const Vec3 hit = eye_B + part * ray;
  const Vec3 off = hit - face.middle_B;
  if (dot(off, off) > face.reach_m * face.reach_m) return false;
  return is_inside(face, hit);
}

bool Wireframe::is_inside(const Face& face, const Vec3& point_B) const {
  for (std::size_t k = 0; k < face.corners.size(); ++k) {
    const Vec3& a = corners_[static_cast<std::size_t>(face.corners[k])];
    const Vec3& b = corners_[static_cast<std::size_t>(face.corners[(k + 1) % face.corners.size()])];
    if (dot(cross(b - a, point_B - a), face.normal_B) < 0.0) return false;
  }
  return true;
}

void Wireframe::lit_from(const Vec3& eye_B, const Vec3& to_sun_B, double step_m,
                         std::vector<FacePoint>* points) const {
  points->clear();
  const auto is_hidden = [this](const Vec3& eye, const Vec3& point) {
    return std::any_of(faces_.begin(), faces_.end(),
                       [&](const Face& face) { return hides(face, eye, point, kPatch_m); });
  };
  for (const Face& face : faces_) {
    if (!(dot(face.normal_B, eye_B) > face.offset_m)) continue;
    const Vec3 side = corners_[static_cast<std::size_t>(face.corners[0])] - face.middle_B;
    const Vec3 x = (1.0 / norm(side)) * side, y = cross(face.normal_B, x);
    const int half = static_cast<int>(face.reach_m / step_m);
    const double cosine = std::max(0.0, dot(face.normal_B, to_sun_B));
    for (int i = -half; i <= half; ++i) {
      for (int j = -half; j <= half; ++j) {
        FacePoint point;
        point.point_B = face.middle_B + (i * step_m) * x + (j * step_m) * y;
        if (!is_inside(face, point.point_B) || is_hidden(eye_B, point.point_B)) continue;
        point.albedo = face.albedo;
        if (cosine > 0.0 && !is_hidden(point.point_B + kSunFar_m * to_sun_B, point.point_B)) {
          point.sunlight = face.albedo * cosine;
        }
        points->push_back(point);
      }
    }
  }
}

void Wireframe::seen_from(const Vec3& eye_B, double step_m, std::vector<EdgePoint>* points) const {
  points->clear();
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const Edge& edge = edges_[e];
    const auto turned_here = [&](int face) {
      if (face < 0) return false;
      const Face& f = faces_[static_cast<std::size_t>(face)];
      return dot(f.normal_B, eye_B) > f.offset_m;
    };
    if (!turned_here(edge.faces[0]) && !turned_here(edge.faces[1])) continue;
    const int count = std::clamp(static_cast<int>(std::ceil(edge.length_m / step_m)), kFewestPoints,
                                 kMostPointsOfEdge);
    for (int k = 0; k < count; ++k) {
      EdgePoint point;
      point.edge = static_cast<int>(e);
      point.along = (k + 0.5) / count;
      point.point_B = corners_[static_cast<std::size_t>(edge.corners[0])] +
                      (point.along * edge.length_m) * edge.unit_B;
      bool hidden = false;
      for (std::size_t f = 0; f < faces_.size() && !hidden; ++f) {
        const int id = static_cast<int>(f);
        if (id == edge.faces[0] || id == edge.faces[1]) continue;
        hidden = hides(faces_[f], eye_B, point.point_B, kBefore_m);
      }
      if (!hidden) points->push_back(point);
    }
  }
}

}  // namespace rpo_kit
