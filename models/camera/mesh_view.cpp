#include <orrery/models/camera/gl_renderer.hpp>
#include <orrery/models/camera/mesh_view.hpp>
#include <orrery/models/camera/parallel_rows.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
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

// Samples are at (column + 1/2, row + 1/2). One that lies on an edge belongs to the later triangle,
// which is the same for any band of rows.
void scan(DepthGrid& grid, const Corners& c, int id, int first_row, int end_row) {
  const auto [low_v, high_v] = std::minmax({c[0].v, c[1].v, c[2].v});
  const double whole = doubled_area(c);
  if (!(std::abs(whole) > 1e-12)) return;
  const int begin = std::max(first_row, static_cast<int>(std::ceil(std::max(low_v - 0.5, -1.0))));
  const int end = std::min(end_row, static_cast<int>(std::floor(std::min(high_v - 0.5, 1e6))) + 1);
  for (int row = begin; row < end; ++row) {
    const double v = row + 0.5;
    double left = 1e9, right = -1e9;
    for (int k = 0; k < 3; ++k) {
      const Corner &p = c[static_cast<std::size_t>(k)],
                   &q = c[static_cast<std::size_t>((k + 1) % 3)];
      if ((p.v <= v) == (q.v <= v)) continue;
      const double u = p.u + (q.u - p.u) * (v - p.v) / (q.v - p.v);
      left = std::min(left, u), right = std::max(right, u);
    }
    if (left > right) continue;
    const int from = static_cast<int>(std::ceil(std::max(left - 0.5, 0.0)));
    const int to = static_cast<int>(std::floor(std::min(right - 0.5, grid.columns - 1.0)));
    if (from > to) continue;
    const auto w = weights_at(c, from + 0.5, v);
    double near = w[0] * c[0].nearness + w[1] * c[1].nearness + w[2] * c[2].nearness;
    const double slope = ((c[1].nearness - c[0].nearness) * (c[2].v - c[0].v) -
                          (c[2].nearness - c[0].nearness) * (c[1].v - c[0].v)) /
                         whole;
    std::size_t at = grid.index(from, row);
    for (int column = from; column <= to; ++column, ++at, near += slope) {
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

  bool is_lit(const Vec3& p_B, int triangle, double cosine) const {
    const Corner c = place(p_B);
    const int column = std::clamp(static_cast<int>(c.u), 0, grid_.columns - 1);
    const int row = std::clamp(static_cast<int>(c.v), 0, grid_.rows - 1);
    const std::size_t at = grid_.index(column, row);
    if (grid_.triangle[at] < 0 || grid_.triangle[at] == triangle) return true;
    // One texel of the map along the surface, whose depth it cannot resolve.
    const double slack = (1.5 / scale_) * (1 + 1 / std::max(cosine, 0.05));
    return grid_.nearness[at] - c.nearness < slack;
  }

 private:
  Corner place(const Vec3& p) const {
    return {(dot(p, axes_.x) + radius_) * scale_, (dot(p, axes_.y) + radius_) * scale_,
            dot(p, axes_.z)};
  }

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
      const bool is_seen = p_C.z > kNearest_m;
      const Pixel at = is_seen ? *camera_.project(p_C) : Pixel{};
      corners_.push_back({at.u, at.v, is_seen ? 1 / p_C.z : 0});
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
      if (c[0].nearness == 0 || c[1].nearness == 0 || c[2].nearness == 0) continue;
      // v runs down: counterclockwise from outside is clockwise in numbers.
      if (doubled_area(c) < 0) scan(grid, c, static_cast<int>(k), first, end);
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
      const bool is_seen = corners[0].nearness != 0 && corners[1].nearness != 0 &&
                           corners[2].nearness != 0 && doubled_area(corners) < 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const Corner& c = corners[i];
        const Vec3& p = vertex(t, i);
        const Vec3& n = f.normal_B;
        const double farness = high > low ? (high - c.nearness) / (high - low) : 0.5;
        out.vertices.push_back({.u = float(c.u),
                                .v = float(c.v),
                                .depth = is_seen ? float(2 * farness - 1) : 2.0f,
                                .distance = is_seen ? float(1 / c.nearness) : 1.0f,
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

  double radiance(int id, int column, int row, const ShadowMap& shadows) const {
    const Mesh::Triangle& t = mesh_.triangles()[static_cast<std::size_t>(id)];
    const Facet& f = facets_[static_cast<std::size_t>(id)];
    if (f.cosine <= 0) return f.earthshine;
    const Vec3 p = point_B(t, corners_of(t), column + 0.5, row + 0.5);
    if (!shadows.is_lit(p, id, f.cosine)) return f.earthshine;
    const SurfaceMaterial& m = material(t);
    if (m.specular == 0) return f.earthshine + f.lambert;
    return f.earthshine + f.lambert + shading_.lobe(m, f.normal_B, f.cosine, unit(camera_B_ - p));
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

}  // namespace

double MeshSamples::total_suns() const {
  return std::accumulate(suns.begin(), suns.end(), 0.0);
}

Pixel MeshSamples::photocentre() const {
  double total = 0, u = 0, v = 0;
  const bool is_dark = total_suns() == 0;
  std::size_t at = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column, ++at) {
      const double weight = is_dark ? covered[at] : double(suns[at]);
      total += weight, u += weight * (column + 0.5), v += weight * (row + 0.5);
    }
  }
  if (total == 0) return {left, top};
  return {left + u / total / per_px_u, top + v / total / per_px_v};
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
                 double electrons_per_sun, double psf_sigma_px, double weight, int threads) {
  if (s.suns.empty()) return;
  const double finest = std::min(s.per_px_u, s.per_px_v);
  const double size_px = s.columns / s.per_px_u;
  const double enough = std::max(kSpreadPerPixel, kSpreadAcross / size_px);
  const JoinedSamples joined(s, std::max(1, static_cast<int>(finest / enough)));
  const Spread across(joined.columns, s.left, joined.per_px_u, psf_sigma_px, image.width_px);
  const Spread down(joined.rows, s.top, joined.per_px_v, psf_sigma_px, image.height_px);
  const auto spread_covered = [&] {
    spread_rows(covered, joined, joined.covered, across, down, weight / (s.per_px_u * s.per_px_v));
  };
  std::thread other;
  if (threads > 1) other = std::thread(spread_covered);
  spread_rows(image, joined, joined.suns, across, down, weight * electrons_per_sun);
  if (threads > 1) {
    other.join();
  } else {
    spread_covered();
  }
}

}  // namespace orrery
