/// The target of the near range from frames: a body of 0.6 x 0.4 x 0.3 m with two panels, a
/// telescope's baffle on +X and a radiator on each deck. Its mesh, for the camera, and what the
/// flight software knows of it, corners and faces, are written down apart from each other: the
/// panels are 3 mm thick in the one and plates without thickness in the other.
#pragma once

#include <orrery/models/camera/mesh.hpp>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace orrery::rendezvous {

/// 0 to 7 the body's, 8 to 15 the baffle's, 16 to 23 the panels', 24 to 31 the radiators'.
inline std::vector<Vec3> target_corners_B() {
  std::vector<Vec3> corners;
  const auto box = [&](const Vec3& low, const Vec3& high) {
    for (int k = 0; k < 8; ++k) {
      corners.push_back({(k & 1) != 0 ? high.x : low.x, (k & 2) != 0 ? high.y : low.y,
                         (k & 4) != 0 ? high.z : low.z});
    }
  };
  const auto rectangle = [&](double x0, double x1, double y0, double y1, double z) {
    for (const auto& [x, y] : {std::pair{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}) {
      corners.push_back({x, y, z});
    }
  };
  box({-0.3, -0.2, -0.15}, {0.3, 0.2, 0.15});
  box({0.3, -0.16, -0.08}, {0.45, 0.0, 0.08});
  rectangle(-0.12, 0.12, 0.25, 0.9, 0);
  rectangle(-0.12, 0.12, -0.9, -0.25, 0);
  rectangle(-0.22, -0.06, -0.05, 0.13, 0.152);
  rectangle(0.02, 0.22, -0.14, 0.06, -0.152);
  return corners;
}

/// Counterclockwise seen from outside.
inline std::vector<std::vector<int>> target_faces() {
  return {{0, 4, 6, 2},     {1, 3, 7, 5},     {0, 1, 5, 4},     {2, 6, 7, 3},     {0, 2, 3, 1},
          {4, 5, 7, 6},     {9, 11, 15, 13},  {8, 9, 13, 12},   {10, 14, 15, 11}, {8, 10, 11, 9},
          {12, 13, 15, 14}, {16, 17, 18, 19}, {19, 18, 17, 16}, {20, 21, 22, 23}, {23, 22, 21, 20},
          {24, 25, 26, 27}, {31, 30, 29, 28}};
}

/// Of those, as the flight software has them.
inline std::vector<double> target_albedos() {
  return {0.42, 0.42, 0.3, 0.3, 0.22, 0.22, 0.06, 0.5, 0.5,
          0.5,  0.5,  0.1, 0.1, 0.1,  0.1,  0.55, 0.06};
}

/// Closed boxes with a material for each side: -x, +x, -y, +y, -z, +z.
inline std::string target_obj() {
  std::string text;
  int first = 1;
  const auto box = [&](const Vec3& at, const Vec3& size, const std::array<const char*, 6>& sides) {
    char line[96];
    for (int k = 0; k < 8; ++k) {
      std::snprintf(
          line, sizeof line, "v %.4f %.4f %.4f\n", at.x + ((k & 1) != 0 ? 0.5 : -0.5) * size.x,
          at.y + ((k & 2) != 0 ? 0.5 : -0.5) * size.y, at.z + ((k & 4) != 0 ? 0.5 : -0.5) * size.z);
      text += line;
    }
    constexpr int kSides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                  {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (std::size_t s = 0; s < 6; ++s) {
      const int* c = kSides[s];
      std::snprintf(line, sizeof line, "usemtl %s\nf %d %d %d %d\n", sides[s], first + c[0],
                    first + c[1], first + c[2], first + c[3]);
      text += line;
    }
    first += 8;
  };
  const auto plain = [](const char* name) {
    return std::array<const char*, 6>{name, name, name, name, name, name};
  };
  box({0, 0, 0}, {0.6, 0.4, 0.3}, {"foil", "foil", "side", "side", "deck", "deck"});
  box({0.375, -0.08, 0}, {0.15, 0.16, 0.16},
      {"black", "black", "baffle", "baffle", "baffle", "baffle"});
  for (const double side : {0.575, -0.575}) box({0, side, 0}, {0.24, 0.65, 0.003}, plain("cells"));
  box({-0.14, 0.04, 0.151}, {0.16, 0.18, 0.002}, plain("white"));
  box({0.12, -0.04, -0.151}, {0.2, 0.2, 0.002}, plain("black"));
  return text;
}

inline Mesh inspection_mesh() {
  return Mesh::parse_obj(target_obj(), "inspection target",
                         {{"foil", {.albedo = 0.42}},
                          {"side", {.albedo = 0.3}},
                          {"deck", {.albedo = 0.22}},
                          {"baffle", {.albedo = 0.5}},
                          {"black", {.albedo = 0.06}},
                          {"white", {.albedo = 0.55}},
                          {"cells", {.albedo = 0.1, .specular = 0.05, .shininess = 60}}});
}

}  // namespace orrery::rendezvous
