/// The shape and surface of a spacecraft as a camera sees it.
#pragma once

#include <orrery/models/frames/vector.hpp>

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// Lambert, and a lobe about the mirror direction: Blinn and Phong's, normalised so that `specular`
/// is the reflected part at normal incidence.
struct SurfaceMaterial {
  double albedo = 0.3;     // diffuse reflectance, 0 to 1
  double specular = 0;     // 0 to 1, with albedo at most 1
  double shininess = 100;  // exponent of the lobe, 1 to 1e5
};
using SurfaceMaterials = std::map<std::string, SurfaceMaterial, std::less<>>;

/// Triangles in body axes [m]. Corners counterclockwise seen from outside; a closed surface.
class Mesh {
 public:
  struct Triangle {
    std::array<int, 3> corners{};
    int material = 0;
  };

  Mesh() = default;
  /// Wavefront OBJ: v, f (polygons as fans, v/vt/vn, negative indices), usemtl; vt, vn, g, o, s,
  /// mtllib and comments are passed over, anything else is refused. A name that `materials` does
  /// not have gets the default material.
  /// @throws std::invalid_argument  "Mesh: <source>, line N: ..."; or a material out of range.
  static Mesh parse_obj(std::string_view text, std::string_view source_name,
                        const SurfaceMaterials& materials = {});
  /// @throws std::invalid_argument  also if the file cannot be read.
  static Mesh load_obj(const std::string& path, const SurfaceMaterials& materials = {});
  /// About the origin, edges along the axes [m], each above 0.
  static Mesh box(const Vec3& size_B, const SurfaceMaterial& material = {});
  /// A sphere's latitudes and longitudes, corners on the sphere; `rings` 2 to 1000.
  static Mesh sphere(double radius_m, int rings, const SurfaceMaterial& material = {});

  /// Another part, shifted by `at_B`.
  void add(const Mesh& part, const Vec3& at_B = {});

  const std::vector<Vec3>& vertices_B() const { return vertices_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  const std::vector<SurfaceMaterial>& materials() const { return materials_; }
  /// Of the smallest sphere about the origin that holds it all.
  double radius_m() const { return radius_; }

 private:
  int add_material(const SurfaceMaterial& material);
  void add_vertex(const Vec3& vertex_B);
  friend class ObjReader;

  std::vector<Vec3> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<SurfaceMaterial> materials_;
  double radius_ = 0;
};

}  // namespace orrery
