#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/mesh.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace orrery {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLargest_m = 1000;

void check(const SurfaceMaterial& m) {
  if (!(m.albedo >= 0 && m.specular >= 0 && m.albedo + m.specular <= 1 && m.shininess >= 1 &&
        m.shininess <= 1e5)) {
    throw std::invalid_argument("Mesh: material with albedo = " + to_text(m.albedo) +
                                ", specular = " + to_text(m.specular) +
                                ", shininess = " + to_text(m.shininess) +
                                "; accepted: 0 or above, together at most 1; 1 to 1e5");
  }
}

}  // namespace

class ObjReader {
 public:
  ObjReader(std::string_view text, std::string_view source, const SurfaceMaterials& materials)
      : lines_(text, "Mesh", source), materials_(materials) {}

  Mesh read() {
    while (const auto line = lines_.next()) {
      const std::vector<std::string_view> words = text::words_of(*line);
      if (!words.empty() && words[0].front() != '#') statement(words);
    }
    if (mesh_.triangles_.empty()) lines_.fail("no face");
    return std::move(mesh_);
  }

 private:
  using Words = std::vector<std::string_view>;

  void statement(const Words& words) {
    const std::string_view key = words[0];
    if (key == "v") return vertex(words);
    if (key == "f") return face(words);
    if (key == "usemtl") return use(words);
    for (const char* passed : {"vt", "vn", "g", "o", "s", "mtllib"}) {
      if (key == passed) return;
    }
    lines_.fail("statement " + text::quoted(key) +
                "; accepted: v, vt, vn, f, g, o, s, usemtl, mtllib");
  }

  void vertex(const Words& words) {
    if (words.size() < 4) lines_.fail("v with fewer than 3 coordinates");
    mesh_.add_vertex({lines_.real(words[1], "x", kLargest_m),
                      lines_.real(words[2], "y", kLargest_m),
                      lines_.real(words[3], "z", kLargest_m)});
  }

  int index(std::string_view word) const {
    const int count = static_cast<int>(mesh_.vertices_.size());
    const int given = lines_.integer(word.substr(0, word.find('/')), "vertex", -count, count);
    if (given == 0) lines_.fail("vertex 0; accepted: 1 or above, or negative");
    return given > 0 ? given - 1 : count + given;
  }

  void face(const Words& words) {
    if (words.size() < 4) lines_.fail("f with fewer than 3 vertices");
    if (material_ < 0) material_ = mesh_.add_material({});
    const int first = index(words[1]);
    for (std::size_t k = 2; k + 1 < words.size(); ++k) {
      mesh_.triangles_.push_back({{first, index(words[k]), index(words[k + 1])}, material_});
    }
  }

  void use(const Words& words) {
    const std::string name(words.size() > 1 ? words[1] : "");
    const auto [at, is_new] = known_.try_emplace(name, 0);
    if (is_new) {
      const auto given = materials_.find(name);
      at->second =
          mesh_.add_material(given == materials_.end() ? SurfaceMaterial{} : given->second);
    }
    material_ = at->second;
  }

  text::NumberedLines lines_;
  const SurfaceMaterials& materials_;
  std::map<std::string, int> known_;
  int material_ = -1;
  Mesh mesh_;
};

int Mesh::add_material(const SurfaceMaterial& material) {
  check(material);
  materials_.push_back(material);
  return static_cast<int>(materials_.size()) - 1;
}

void Mesh::add_vertex(const Vec3& vertex_B) {
  vertices_.push_back(vertex_B);
  radius_ = std::max(radius_, norm(vertex_B));
}

Mesh Mesh::parse_obj(std::string_view text, std::string_view source_name,
                     const SurfaceMaterials& materials) {
  return ObjReader(text, source_name, materials).read();
}

Mesh Mesh::load_obj(const std::string& path, const SurfaceMaterials& materials) {
  return parse_obj(text::read_file(path, "Mesh"), path, materials);
}

Mesh Mesh::box(const Vec3& size_B, const SurfaceMaterial& material) {
  if (!(size_B.x > 0 && size_B.y > 0 && size_B.z > 0 && norm(size_B) <= kLargest_m)) {
    throw std::invalid_argument("Mesh::box: size = (" + to_text(size_B.x) + ", " +
                                to_text(size_B.y) + ", " + to_text(size_B.z) +
                                ") m; accepted: above 0, at most 1000 across");
  }
  Mesh mesh;
  mesh.add_material(material);
  for (int k = 0; k < 8; ++k) {
    mesh.add_vertex({(k & 1 ? 0.5 : -0.5) * size_B.x, (k & 2 ? 0.5 : -0.5) * size_B.y,
                     (k & 4 ? 0.5 : -0.5) * size_B.z});
  }
  constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : kFaces) {
    mesh.triangles_.push_back({{f[0], f[1], f[2]}, 0});
    mesh.triangles_.push_back({{f[0], f[2], f[3]}, 0});
  }
  return mesh;
}

Mesh Mesh::sphere(double radius_m, int rings, const SurfaceMaterial& material) {
  if (!(radius_m > 0 && radius_m <= kLargest_m) || rings < 2 || rings > 1000) {
    throw std::invalid_argument("Mesh::sphere: radius_m = " + to_text(radius_m) + ", rings = " +
                                std::to_string(rings) + "; accepted: above 0 to 1000 m, 2 to 1000");
  }
  Mesh mesh;
  mesh.add_material(material);
  const int columns = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k < columns; ++k) {
      const double polar = kPi * i / rings, a = 2 * kPi * k / columns;
      mesh.add_vertex({radius_m * std::sin(polar) * std::cos(a),
                       radius_m * std::sin(polar) * std::sin(a), radius_m * std::cos(polar)});
    }
  }
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < columns; ++k) {
      const int next = (k + 1) % columns, a = i * columns, b = a + columns;
      if (i > 0) mesh.triangles_.push_back({{a + k, b + next, a + next}, 0});
      if (i + 1 < rings) mesh.triangles_.push_back({{a + k, b + k, b + next}, 0});
    }
  }
  return mesh;
}

void Mesh::add(const Mesh& part, const Vec3& at_B) {
  const int first_vertex = static_cast<int>(vertices_.size());
  const int first_material = static_cast<int>(materials_.size());
  for (const Vec3& v : part.vertices_) add_vertex(v + at_B);
  for (Triangle triangle : part.triangles_) {
    for (int& corner : triangle.corners) corner += first_vertex;
    triangle.material += first_material;
    triangles_.push_back(triangle);
  }
  materials_.insert(materials_.end(), part.materials_.begin(), part.materials_.end());
}

}  // namespace orrery
