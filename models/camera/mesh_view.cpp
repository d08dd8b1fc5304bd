#include <orrery/models/camera/gl_renderer.hpp>
#include <orrery/models/camera/mesh_view.hpp>
#include <orrery/models/camera/parallel_rows.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <thread>

namespace orrery {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kAcrossAPoint = 128, kAcross = 1024;
constexpr double kLeastPerPixel = 2, kMostPerPixel = 16;
constexpr double kLargestShadowMap = 512;
constexpr double kNearest_m = 1e-3;
constexpr double kMargin_px = 30;  // beyond the image: what the PSF brings in
constexpr int kBlock = 16;         // samples that share one solid angle, across and down
constexpr double kSpreadPerPixel = 4, kSpreadAcross = 32;  // samples that the PSF needs

// A point needs its flux only; what has edges needs them in place.
double samples_per_px(double size_px) {
  if (size_px < kAcrossAPoint / kMostPerPixel) return kAcrossAPoint / size_px;
  return std::clamp(kAcross / size_px, kLeastPerPixel, kMostPerPixel);
}

struct Corner {
  double u = 0, v = 0;  // in samples
  double nearness = 0;  // larger is nearer, linear in the plane of the grid
};

// Grid of the nearest triangle.
struct DepthGrid {
  int columns = 0, rows = 0;
  std::vector<double> nearness;  // at 100 km a float would not tell front from back
  std::vector<int> triangle;     // -1: none

  DepthGrid(int c, int r)
      : columns(c),
        rows(r),
        nearness(static_cast<std::size_t>(c) * static_cast<std::size_t>(r),
                 -std::numeric_limits<double>::infinity()),
        triangle(nearness.size(), -1) {}
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
};

using Corners = std::array<Corner, 3>;

double doubled_area(const Corners& c) {
  return (c[1].u - c[0].u) * (c[2].v - c[0].v) - (c[2].u - c[0].u) * (c[1].v - c[0].v);
}

// Barycentric coordinates of the point (u, v).
std::array<double, 3> weights_at(const Corners& c, double u, double v) {
  const double whole = doubled_area(c);
  const double b = ((u - c[0].u) * (c[2].v - c[0].v) - (c[2].u - c[0].u) * (v - c[0].v)) / whole;
  const double a = ((c[1].u - c[0].u) * (v - c[0].v) - (u - c[0].u) * (c[1].v - c[0].v)) / whole;
  return {1 - a - b, b, a};
}

// What is linear over a triangle in the plane of the grid, given at its corners.
struct Linear {
  double at_0 = 0, per_u = 0, per_v = 0;

  Linear() = default;
  Linear(const Corners& c, double value_0, double value_1, double value_2)
      : at_0(value_0),
        per_u(((value_1 - value_0) * (c[2].v - c[0].v) - (value_2 - value_0) * (c[1].v - c[0].v)) /
              doubled_area(c)),
        per_v(((value_2 - value_0) * (c[1].u - c[0].u) - (value_1 - value_0) * (c[2].u - c[0].u)) /
              doubled_area(c)) {}
  /// From the first corner.
  double at(double du, double dv) const { return at_0 + per_u * du + per_v * dv; }
};

// Of a triangle, the upper end first, so that both triangles that share it cross the same points.
struct Edge {
  double u = 0, v = 0, end_v = 0, slope = 0;

  Edge(Corner p, Corner q) {
    if (p.v > q.v) std::swap(p, q);
    u = p.u, v = p.v, end_v = q.v;
    slope = p.v < q.v ? (q.u - p.u) / (q.v - p.v) : 0;
  }
};

// Of a number from 0 to 1e9; the library's are calls where the processor need not have them.
int rounded_up(double x) {
  const int below = static_cast<int>(x);
  return below < x ? below + 1 : below;
}

// Samples are at (column + 1/2, row + 1/2). One that lies on an edge belongs to the later triangle,
// which is the same for any band of rows.
void scan(DepthGrid& grid, const Corners& c, int id, int first_row, int end_row) {
  const auto [low_v, high_v] = std::minmax({c[0].v, c[1].v, c[2].v});
  if (high_v < first_row || low_v > end_row) return;
  if (!(std::abs(doubled_area(c)) > 1e-12)) return;
  const int begin = std::max(first_row, rounded_up(std::clamp(low_v - 0.5, 0.0, 1e6)));
  const int end = std::min(end_row, static_cast<int>(std::clamp(high_v + 0.5, 0.0, 1e6)));
  if (begin >= end) return;
  const Linear nearness(c, c[0].nearness, c[1].nearness, c[2].nearness);
  const Edge edges[3] = {{c[0], c[1]}, {c[1], c[2]}, {c[2], c[0]}};
  for (int row = begin; row < end; ++row) {
    const double v = row + 0.5;
    double left = 1e9, right = -1e9;
    for (const Edge& edge : edges) {
      if (edge.v > v || edge.end_v <= v) continue;
      const double u = edge.u + edge.slope * (v - edge.v);
      left = std::min(left, u), right = std::max(right, u);
    }
    if (left > right || right < 0.5) continue;
    const int from = rounded_up(std::clamp(left - 0.5, 0.0, 1e6));
    const int to = static_cast<int>(std::min(right - 0.5, grid.columns - 1.0));
    if (from > to) continue;
    double near = nearness.at(from + 0.5 - c[0].u, v - c[0].v);
    std::size_t at = grid.index(from, row);
    for (int column = from; column <= to; ++column, ++at, near += nearness.per_u) {
      if (near >= grid.nearness[at]) grid.nearness[at] = near, grid.triangle[at] = id;
    }
  }
}

struct SunAxes {
  Vec3 z, x, y;
  explicit SunAxes(const Vec3& to_sun)
      : z(to_sun),
        x(unit(std::abs(z.x) < 0.7 ? cross({1, 0, 0}, z) : cross({0, 1, 0}, z))),
        y(cross(z, x)) {}
};

// What lies in sunlight: the nearest triangle to the Sun on a grid normal to its direction.
class ShadowMap {
 public:
  ShadowMap(const Mesh& mesh, const Vec3& to_sun_B, int size, int threads)
      : radius_(mesh.radius_m()), axes_(to_sun_B), grid_(size, size), scale_(size / (2 * radius_)) {
    std::vector<Corner> places;
    for (const Vec3& vertex : mesh.vertices_B()) places.push_back(place(vertex));
    for_bands_of_rows(threads, grid_.rows, [&](int first, int end) {
      const auto& triangles = mesh.triangles();
      for (std::size_t k = 0; k < triangles.size(); ++k) {
        const auto& c = triangles[k].corners;
        const Corners corners{places[static_cast<std::size_t>(c[0])],
                              places[static_cast<std::size_t>(c[1])],
                              places[static_cast<std::size_t>(c[2])]};
        if (doubled_area(corners) > 0) scan(grid_, corners, static_cast<int>(k), first, end);
      }
    });
  }

  bool is_lit(const Corner& c, int triangle, double slack) const {
    const int column = c.u > 0 ? static_cast<int>(std::min(c.u, grid_.columns - 1.0)) : 0;
    const int row = c.v > 0 ? static_cast<int>(std::min(c.v, grid_.rows - 1.0)) : 0;
    const std::size_t at = grid_.index(column, row);
    if (grid_.triangle[at] < 0 || grid_.triangle[at] == triangle) return true;
    return grid_.nearness[at] - c.nearness < slack;
  }
  // One texel of the map along the surface, whose depth it cannot resolve.
  double slack(double cosine) const { return (1.5 / scale_) * (1 + 1 / std::max(cosine, 0.05)); }
  Corner place(const Vec3& p) const {
    return {(dot(p, axes_.x) + radius_) * scale_, (dot(p, axes_.y) + radius_) * scale_,
            dot(p, axes_.z)};
  }

 private:
  double radius_;
  SunAxes axes_;
  DepthGrid grid_;
  double scale_;
};

// Radiance [suns/sr] of a surface with unit normal n towards the unit vector `to_camera`.
class Shading {
 public:
  Shading(const Lighting& light, const Mat3& R_TI)
      : light_(light), to_sun_(R_TI * light.to_sun_ECI), to_earth_(R_TI * light.to_earth_ECI) {}

  const Vec3& to_sun_B() const { return to_sun_; }
  double lambert(const SurfaceMaterial& m, double cosine) const {
    return cosine > 0 ? light_.sun * cosine * m.albedo / kPi : 0;
  }
  double lobe(const SurfaceMaterial& m, const Vec3& n, double cosine, const Vec3& to_camera) const {
    if (cosine <= 0 || m.specular == 0) return 0;
    const double half = std::max(0.0, dot(n, unit(to_sun_ + to_camera)));
    return lobe_factor(m, cosine) * std::pow(half, m.shininess);
  }
  double lobe_factor(const SurfaceMaterial& m, double cosine) const {
    if (cosine <= 0) return 0;
    return light_.sun * cosine * m.specular * (m.shininess + 8) / (8 * kPi);
  }
  double earthshine(const SurfaceMaterial& m, const Vec3& n) const {
    const double cosine = dot(n, to_earth_), w = light_.earth_width;
    return light_.earth * m.albedo / kPi *
           ((1 - w) * std::max(0.0, cosine) + w * 0.5 * (1 + cosine));
  }

 private:
  const Lighting& light_;
  Vec3 to_sun_, to_earth_;
};

class MeshSampler {
 public:
  MeshSampler(const Mesh& mesh, const PinholeCamera& camera, const MeshPose& pose,
              const Lighting& light)
      : mesh_(mesh), camera_(camera), pose_(pose), shading_(light, pose.R_TI) {}

  MeshSamples sample(int threads, GlRenderer* gl) {
    MeshSamples out;
    if (!project() || !lay_out(out)) return out;
    light_facets();
    measure_blocks(out);
    if (gl != nullptr) {
      take(out, gl->mesh(drawing(out)));
      return out;
    }
    DepthGrid grid(out.columns, out.rows);
    for_bands_of_rows(threads, out.rows, [&](int first, int end) { scan_all(grid, first, end); });
    const ShadowMap shadows(mesh_, shading_.to_sun_B(), shadow_map_size(), threads);
    place_facets(shadows);
    out.suns.assign(grid.triangle.size(), 0);
    out.covered.assign(grid.triangle.size(), 0);
    for_bands_of_rows(threads, out.rows,
                      [&](int first, int end) { shade(out, grid, shadows, first, end); });
    return out;
  }

 private:
  // All corners; false: the target's origin is not in front.
  bool project() {
    centre_C_ = pose_.R_CI * pose_.r_TC_ECI;
    if (!(centre_C_.z > kNearest_m)) return false;
    const Mat3 R_CT = pose_.R_CI * transpose(pose_.R_TI);
    camera_B_ = -(pose_.R_TI * pose_.r_TC_ECI);
    for (const Vec3& vertex : mesh_.vertices_B()) {
      const Vec3 p_C = R_CT * vertex + centre_C_;
      const bool is_in_front = p_C.z > kNearest_m;
      const Pixel at = is_in_front ? *camera_.project(p_C) : Pixel{};
      corners_.push_back({at.u, at.v, is_in_front ? 1 / p_C.z : 0});
    }
    return true;
  }

  // The smallest rectangle about what is seen, within the image and its margin.
  bool lay_out(MeshSamples& out) {
    double low_u = 1e9, high_u = -1e9, low_v = 1e9, high_v = -1e9;
    for (const Corner& c : corners_) {
      if (c.nearness == 0) continue;
      low_u = std::min(low_u, c.u), high_u = std::max(high_u, c.u);
      low_v = std::min(low_v, c.v), high_v = std::max(high_v, c.v);
    }
    const double size_px = std::max(high_u - low_u, high_v - low_v);
    low_u = std::max(low_u, -kMargin_px), low_v = std::max(low_v, -kMargin_px);
    high_u = std::min(high_u, camera_.width_px() + kMargin_px);
    high_v = std::min(high_v, camera_.height_px() + kMargin_px);
    if (!(low_u < high_u && low_v < high_v)) return false;
    const double per_px = samples_per_px(size_px);
    across_samples_ = size_px * per_px;
    out.left = low_u, out.top = low_v;
    out.columns = static_cast<int>(std::ceil((high_u - low_u) * per_px));
    out.rows = static_cast<int>(std::ceil((high_v - low_v) * per_px));
    out.per_px_u = out.columns / (high_u - low_u), out.per_px_v = out.rows / (high_v - low_v);
    for (Corner& c : corners_) {
      c.u = (c.u - out.left) * out.per_px_u, c.v = (c.v - out.top) * out.per_px_v;
    }
    return true;
  }

  Corners corners_of(const Mesh::Triangle& t) const {
    return {corners_[static_cast<std::size_t>(t.corners[0])],
            corners_[static_cast<std::size_t>(t.corners[1])],
            corners_[static_cast<std::size_t>(t.corners[2])]};
  }

  void scan_all(DepthGrid& grid, int first, int end) const {
    const auto& triangles = mesh_.triangles();
    for (std::size_t k = 0; k < triangles.size(); ++k) {
      const Corners c = corners_of(triangles[k]);
      if (is_seen(c)) scan(grid, c, static_cast<int>(k), first, end);
    }
  }

  // Perspective: position/Z and 1/Z are linear in the image.
  Vec3 point_B(const Mesh::Triangle& t, const Corners& c, double u, double v) const {
    const auto w = weights_at(c, u, v);
    Vec3 sum;
    double nearness = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double part = w[i] * c[i].nearness;
      sum += part * vertex(t, i);
      nearness += part;
    }
    return sum / nearness;
  }

  void shade(MeshSamples& out, const DepthGrid& grid, const ShadowMap& shadows, int first,
             int end) const {
    const std::size_t blocks = static_cast<std::size_t>(block_columns_);
    for (int row = first; row < end; ++row) {
      const double* solid_angles = &solid_angles_[static_cast<std::size_t>(row / kBlock) * blocks];
      for (int column = 0; column < out.columns; ++column) {
        const std::size_t at = grid.index(column, row);
        const int id = grid.triangle[at];
        if (id < 0) continue;
        out.covered[at] = 1;
        out.suns[at] =
            static_cast<float>(solid_angles[column / kBlock] * radiance(id, column, row, shadows));
      }
    }
  }

  // Of a sample [sr], for each block.
  void measure_blocks(const MeshSamples& s) {
    const double per_sample = 1 / (s.per_px_u * s.per_px_v);
    block_columns_ = (s.columns + kBlock - 1) / kBlock;
    for (int row = 0; row < s.rows; row += kBlock) {
      const double v = s.top + (row + 0.5 * kBlock) / s.per_px_v;
      for (int column = 0; column < s.columns; column += kBlock) {
        const double u = s.left + (column + 0.5 * kBlock) / s.per_px_u;
        const Pixel at{std::clamp(u, -0.5, camera_.width_px() - 0.5),
                       std::clamp(v, -0.5, camera_.height_px() - 0.5)};
        solid_angles_.push_back(per_sample * camera_.solid_angle_sr(at));
      }
    }
  }

  GlRenderer::MeshDrawing drawing(const MeshSamples& s) const {
    const SunAxes sun(shading_.to_sun_B());
    GlRenderer::MeshDrawing out{.columns = s.columns,
                                .rows = s.rows,
                                .vertices = {},
                                .to_sun = sun.z,
                                .sun_x = sun.x,
                                .sun_y = sun.y,
                                .camera = camera_B_,
                                .radius_m = mesh_.radius_m(),
                                .shadow_size = shadow_map_size()};
    double low = 1e300, high = 0;
    for (const Corner& c : corners_) {
      if (c.nearness == 0) continue;
      low = std::min(low, c.nearness), high = std::max(high, c.nearness);
    }
    out.vertices.reserve(3 * facets_.size());
    for (std::size_t k = 0; k < facets_.size(); ++k) {
      const Mesh::Triangle& t = mesh_.triangles()[k];
      const Facet& f = facets_[k];
      const SurfaceMaterial& m = material(t);
      const Corners corners = corners_of(t);
      const bool is_turned_here = is_seen(corners);
      for (std::size_t i = 0; i < 3; ++i) {
        const Corner& c = corners[i];
        const Vec3& p = vertex(t, i);
        const Vec3& n = f.normal_B;
        const double farness = high > low ? (high - c.nearness) / (high - low) : 0.5;
        out.vertices.push_back({.u = float(c.u),
                                .v = float(c.v),
                                .depth = is_turned_here ? float(2 * farness - 1) : 2.0f,
                                .distance = is_turned_here ? float(1 / c.nearness) : 1.0f,
                                .position = {float(p.x), float(p.y), float(p.z)},
                                .normal = {float(n.x), float(n.y), float(n.z)},
                                .cosine = float(f.cosine),
                                .lambert = float(f.lambert),
                                .earthshine = float(f.earthshine),
                                .lobe = float(shading_.lobe_factor(m, f.cosine)),
                                .shininess = float(m.shininess),
                                .id = float(k)});
      }
    }
    return out;
  }
  void take(MeshSamples& out, const std::vector<float>& radiance) const {
    out.suns.assign(radiance.size(), 0);
    out.covered.assign(radiance.size(), 0);
    std::size_t at = 0;
    for (int row = 0; row < out.rows; ++row) {
      for (int column = 0; column < out.columns; ++column, ++at) {
        if (radiance[at] < 0) continue;
        out.covered[at] = 1;
        out.suns[at] = static_cast<float>(solid_angle_sr(column, row) * double(radiance[at]));
      }
    }
  }
  double solid_angle_sr(int column, int row) const {
    return solid_angles_[static_cast<std::size_t>(row / kBlock * block_columns_ + column / kBlock)];
  }
  int shadow_map_size() const {
    return static_cast<int>(std::clamp(across_samples_, kAcrossAPoint, kLargestShadowMap));
  }

  // What all points of a triangle share.
  struct Facet {
    Vec3 normal_B;
    double cosine = 0, lambert = 0, earthshine = 0;
    // From here on of those in sunlight that are turned to the camera.
    double first_u = 0, first_v = 0;
    Linear nearness, map_u, map_v, map_nearness;  // the latter three times the nearness
    double slack = 0;
    bool is_glossy = false;
  };
  void light_facets() {
    for (const Mesh::Triangle& t : mesh_.triangles()) {
      const Vec3& a = vertex(t, 0);
      const Vec3 normal = cross(vertex(t, 1) - a, vertex(t, 2) - a);
      const double length = norm(normal);
      Facet f;
      if (length > 0) f.normal_B = normal / length;
      f.cosine = dot(f.normal_B, shading_.to_sun_B());
      const SurfaceMaterial& m = material(t);
      f.lambert = shading_.lambert(m, f.cosine);
      f.earthshine = shading_.earthshine(m, f.normal_B);
      facets_.push_back(f);
    }
  }
  const Vec3& vertex(const Mesh::Triangle& t, std::size_t k) const {
    return mesh_.vertices_B()[static_cast<std::size_t>(t.corners[k])];
  }
  const SurfaceMaterial& material(const Mesh::Triangle& t) const {
    return mesh_.materials()[static_cast<std::size_t>(t.material)];
  }

  // Where the sunlit facets that are turned to the camera are in the shadow map: linear in the
  // image after multiplication by the nearness, which is linear, too (perspective).
  void place_facets(const ShadowMap& shadows) {
    for (std::size_t k = 0; k < facets_.size(); ++k) {
      Facet& f = facets_[k];
      const Mesh::Triangle& t = mesh_.triangles()[k];
      const Corners c = corners_of(t);
      if (f.cosine <= 0 || !is_seen(c)) continue;
      const Corner p[3] = {shadows.place(vertex(t, 0)), shadows.place(vertex(t, 1)),
                           shadows.place(vertex(t, 2))};
      const double n[3] = {c[0].nearness, c[1].nearness, c[2].nearness};
      f.first_u = c[0].u, f.first_v = c[0].v;
      f.nearness = {c, n[0], n[1], n[2]};
      f.map_u = {c, n[0] * p[0].u, n[1] * p[1].u, n[2] * p[2].u};
      f.map_v = {c, n[0] * p[0].v, n[1] * p[1].v, n[2] * p[2].v};
      f.map_nearness = {c, n[0] * p[0].nearness, n[1] * p[1].nearness, n[2] * p[2].nearness};
      f.slack = shadows.slack(f.cosine);
      f.is_glossy = material(t).specular != 0;
    }
  }
  // v runs down: counterclockwise from outside is clockwise in numbers.
  static bool is_seen(const Corners& c) {
    return c[0].nearness != 0 && c[1].nearness != 0 && c[2].nearness != 0 && doubled_area(c) < 0;
  }

  double radiance(int id, int column, int row, const ShadowMap& shadows) const {
    const Facet& f = facets_[static_cast<std::size_t>(id)];
    if (f.cosine <= 0) return f.earthshine;
    const double du = column + 0.5 - f.first_u, dv = row + 0.5 - f.first_v;
    const double distance = 1 / f.nearness.at(du, dv);
    const Corner in_map{f.map_u.at(du, dv) * distance, f.map_v.at(du, dv) * distance,
                        f.map_nearness.at(du, dv) * distance};
    if (!shadows.is_lit(in_map, id, f.slack)) return f.earthshine;
    if (!f.is_glossy) return f.earthshine + f.lambert;
    const Mesh::Triangle& t = mesh_.triangles()[static_cast<std::size_t>(id)];
    const Vec3 p = point_B(t, corners_of(t), column + 0.5, row + 0.5);
    return f.earthshine + f.lambert +
           shading_.lobe(material(t), f.normal_B, f.cosine, unit(camera_B_ - p));
  }

  const Mesh& mesh_;
  const PinholeCamera& camera_;
  const MeshPose& pose_;
  Shading shading_;
  Vec3 centre_C_, camera_B_;
  std::vector<Corner> corners_;
  std::vector<Facet> facets_;
  std::vector<double> solid_angles_;
  int block_columns_ = 0;
  double across_samples_ = 0;
};

// For each sample along one axis, the pixels it reaches and its part on each.
struct Spread {
  struct Reach {
    int first = 0, count = 0;
  };
  std::vector<Reach> reach;
  std::vector<float> parts;
  std::size_t most = 0;

  Spread(int samples, double begin, double per_px, double sigma, int size) {
    const int half = static_cast<int>(std::ceil(5 * sigma));
    most = static_cast<std::size_t>(2 * half + 1);
    parts.resize(most * static_cast<std::size_t>(samples));
    const double scale = 1 / (sigma * std::sqrt(2.0));
    for (int k = 0; k < samples; ++k) {
      const double at = begin + (k + 0.5) / per_px;
      const int middle = static_cast<int>(std::lround(at));
      const int first = std::max(0, middle - half), last = std::min(size - 1, middle + half);
      reach.push_back({first, std::max(0, last - first + 1)});
      for (int i = 0; i < reach.back().count; ++i) {
        const double low = std::erf((first + i - 0.5 - at) * scale);
        const double high = std::erf((first + i + 0.5 - at) * scale);
        parts[most * static_cast<std::size_t>(k) + static_cast<std::size_t>(i)] =
            static_cast<float>(0.5 * (high - low));
      }
    }
  }
  const float* of(int sample) const { return &parts[most * static_cast<std::size_t>(sample)]; }
};

// Samples joined by `step` in each direction where they are finer than the PSF needs: the sums, at
// the middle of those that are joined.
struct JoinedSamples {
  int columns = 0, rows = 0;
  double per_px_u = 1, per_px_v = 1;
  std::vector<float> suns, covered;

  JoinedSamples(const MeshSamples& s, int step)
      : columns((s.columns + step - 1) / step),
        rows((s.rows + step - 1) / step),
        per_px_u(s.per_px_u / step),
        per_px_v(s.per_px_v / step),
        suns(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)),
        covered(suns.size()) {
    std::size_t from = 0;
    for (int row = 0; row < s.rows; ++row) {
      const std::size_t line =
          static_cast<std::size_t>(row / step) * static_cast<std::size_t>(columns);
      for (int column = 0; column < s.columns; ++column, ++from) {
        if (s.covered[from] == 0) continue;
        const std::size_t to = line + static_cast<std::size_t>(column / step);
        suns[to] += s.suns[from];
        covered[to] += 1;
      }
    }
  }
};

// One row of samples across, then down.
void spread_rows(Image<float>& image, const JoinedSamples& s, const std::vector<float>& values,
                 const Spread& across, const Spread& down, double factor) {
  std::vector<float> line(static_cast<std::size_t>(image.width_px));
  for (int row = 0; row < s.rows; ++row) {
    std::fill(line.begin(), line.end(), 0.0f);
    int low = image.width_px, high = -1;
    const float* value =
        &values[static_cast<std::size_t>(row) * static_cast<std::size_t>(s.columns)];
    for (int k = 0; k < s.columns; ++k) {
      if (value[k] == 0) continue;
      const Spread::Reach reach = across.reach[static_cast<std::size_t>(k)];
      const float* part = across.of(k);
      const float light = static_cast<float>(factor * double(value[k]));
      for (int i = 0; i < reach.count; ++i) {
        line[static_cast<std::size_t>(reach.first + i)] += light * part[i];
      }
      if (reach.count > 0) {
        low = std::min(low, reach.first), high = std::max(high, reach.first + reach.count - 1);
      }
    }
    const Spread::Reach reach = down.reach[static_cast<std::size_t>(row)];
    for (int i = 0; i < reach.count; ++i) {
      const float part = down.of(row)[i];
      float* out = image.row(reach.first + i);
      for (int u = low; u <= high; ++u) out[u] += part * line[static_cast<std::size_t>(u)];
    }
  }
}

// Of one row of samples, about its begin. Four sums side by side do not wait for each other.
struct Moments {
  double total = 0, first = 0;
};
template <class Value>
Moments moments(const std::vector<Value>& values, int row, int columns) {
  const Value* value =
      values.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(columns);
  double total[4] = {}, first[4] = {};
  const auto add = [&](int lane, int column) {
    const double weight = value[column];
    total[lane] += weight, first[lane] += weight * (column + 0.5);
  };
  int column = 0;
  for (; column + 4 <= columns; column += 4) {
    for (int lane = 0; lane < 4; ++lane) add(lane, column + lane);
  }
  for (; column < columns; ++column) add(0, column);
  return {(total[0] + total[1]) + (total[2] + total[3]),
          (first[0] + first[1]) + (first[2] + first[3])};
}

}  // namespace

double MeshSamples::total_suns() const {
  double total = 0;
  for (int row = 0; row < rows; ++row) total += moments(suns, row, columns).total;
  return total;
}

Pixel MeshSamples::photocentre() const {
  const auto centre_of = [this](const auto& values) -> std::optional<Pixel> {
    double total = 0, u = 0, v = 0;
    for (int row = 0; row < rows; ++row) {
      const Moments m = moments(values, row, columns);
      total += m.total, u += m.first, v += m.total * (row + 0.5);
    }
    if (total == 0) return {};
    return Pixel{left + u / total / per_px_u, top + v / total / per_px_v};
  };
  if (const auto of_light = centre_of(suns)) return *of_light;
  return centre_of(covered).value_or(Pixel{left, top});
}

double MeshSamples::area_px2() const {
  const auto count = std::count(covered.begin(), covered.end(), 1);
  return static_cast<double>(count) / (per_px_u * per_px_v);
}

MeshSamples sample_mesh(const Mesh& mesh, const PinholeCamera& camera, const MeshPose& pose,
                        const Lighting& light, int threads, GlRenderer* gl) {
  return MeshSampler(mesh, camera, pose, light).sample(threads, gl);
}

void add_samples(ElectronImage& image, Image<float>& covered, const MeshSamples& s,
                 double electrons_per_sun, double psf_sigma_px, double weight, int threads,
                 int left_px, int top_px) {
  if (s.suns.empty()) return;
  const double finest = std::min(s.per_px_u, s.per_px_v);
  const double size_px = s.columns / s.per_px_u;
  const double enough = std::max(kSpreadPerPixel, kSpreadAcross / size_px);
  const JoinedSamples joined(s, std::max(1, static_cast<int>(finest / enough)));
  const Spread across(joined.columns, s.left - left_px, joined.per_px_u, psf_sigma_px,
                      image.width_px);
  const Spread down(joined.rows, s.top - top_px, joined.per_px_v, psf_sigma_px, image.height_px);
  const auto spread_covered = [&] {
    spread_rows(covered, joined, joined.covered, across, down, weight / (s.per_px_u * s.per_px_v));
  };
  std::thread other;
  if (threads > 1) other = worker_thread(spread_covered);
  spread_rows(image, joined, joined.suns, across, down, weight * electrons_per_sun);
  if (threads > 1) {
    other.join();
  } else {
    spread_covered();
  }
}

}  // namespace orrery
