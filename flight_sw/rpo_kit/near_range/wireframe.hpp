/// The target's shape as the flight software knows it: corners and plane faces, from which follow
/// its edges and which parts of them are to be seen.
///
/// Faces       Convex polygons of corners, counterclockwise seen from outside. A thin plate is two
///             faces with the same corners the other way round; a patch of another colour is a face
///             a little above the one that it lies on.
/// Edges       Where a face ends. Seen are those with a face turned to the eye, where no other face
///             is before them by more than 1 cm.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/keypoint_finder_test.cpp
#pragma once

#include <vector>

#include "support/matrix.hpp"

namespace rpo_kit {

constexpr int kMostFaces = 32, kMostFaceCorners = 8;

struct WireframeFace {
  int corners[kMostFaceCorners] = {};
  int count = 0;
  double albedo = 0.3;  ///< diffuse
};

/// A point of an edge.
struct EdgePoint {
  int edge = 0;
  double along = 0.0;  ///< 0 at its first corner, 1 at its second
  flight_support::Vec3 point_B;
};

/// A point of a face that is seen, and what light it gives.
struct FacePoint {
  flight_support::Vec3 point_B;
  double albedo = 0.0;
  double sunlight = 0.0;  ///< albedo times the cosine of the Sun's angle; 0 in a shadow
};

class Wireframe {
 public:
  struct Edge {
    int corners[2] = {};
    int faces[2] = {-1, -1};  ///< the second -1: a patch's
    flight_support::Vec3 unit_B;
    double length_m = 0.0;
  };

  Wireframe() = default;
  /// @return false: a face with fewer than 3 corners, one that there is not, or not plane to 1 cm.
  bool set(const std::vector<flight_support::Vec3>& corners_B,
           const std::vector<WireframeFace>& faces);

  bool empty() const { return edges_.empty(); }
  const std::vector<flight_support::Vec3>& corners_B() const { return corners_; }
  const std::vector<Edge>& edges() const { return edges_; }
  /// Of the smallest sphere about the origin that holds it all [m].
  double radius_m() const { return radius_; }

  /// Points of the edges that are seen from `eye_B`.
  /// @param step_m  Between them, at most; 3 to 40 on an edge.
  void seen_from(const flight_support::Vec3& eye_B, double step_m,
                 std::vector<EdgePoint>* points) const;

  /// Points of the faces that are seen from `eye_B`, and whether the Sun lights them.
  /// @param to_sun_B  Unit vector. @param step_m  Between them.
  void lit_from(const flight_support::Vec3& eye_B, const flight_support::Vec3& to_sun_B,
                double step_m, std::vector<FacePoint>* points) const;

 private:
  struct Face {
    std::vector<int> corners;
    flight_support::Vec3 normal_B, middle_B;
    double offset_m = 0.0, reach_m = 0.0, albedo = 0.0;
  };
  bool hides(const Face& face, const flight_support::Vec3& eye_B,
             const flight_support::Vec3& point_B, double before_m) const;
  bool is_inside(const Face& face, const flight_support::Vec3& point_B) const;
  void add_edge(int from, int to, int face);

  std::vector<flight_support::Vec3> corners_;
  std::vector<Face> faces_;
  std::vector<Edge> edges_;
  double radius_ = 0.0;
};

}  // namespace rpo_kit
