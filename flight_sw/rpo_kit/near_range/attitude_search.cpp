#include "rpo_kit/near_range/attitude_search.hpp"

#include <algorithm>
#include <cmath>

#include "support/orbit/constants.hpp"

namespace rpo_kit {

using namespace flight_support;

namespace {

constexpr int kCoarse_px = 4, kMostCells = 96, kMargin = 6, kDirections = 8;
constexpr double kReach = 6.0;  // cells within which an edge counts
constexpr int kViews = 600, kTurns = 36;
constexpr std::size_t kMostGuesses = 40;
constexpr double kLeastPixels = 24.0;

// Means of cells, and the gradient over them.
struct Grid {
  int columns, rows;
  std::vector<float> value;

  Grid(const ImageView& image, int left, int top, int cell, int width, int height)
      : columns(width), rows(height), value(std::size_t(width) * std::size_t(height)) {
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        double sum = 0.0;
        int count = 0;
        for (int v = top + r * cell; v < top + (r + 1) * cell; ++v) {
          for (int u = left + c * cell; u < left + (c + 1) * cell; ++u) {
            const int x = std::clamp(u, 0, image.width - 1), y = std::clamp(v, 0, image.height - 1);
            sum += image.pixels[std::size_t(y) * std::size_t(image.width) + std::size_t(x)];
            ++count;
          }
        }
        value[index(c, r)] = static_cast<float>(sum / count);
      }
    }
  }
  std::size_t index(int c, int r) const {
    return std::size_t(r) * std::size_t(columns) + std::size_t(c);
  }
  // Sobel's, over eight: the slope per cell.
  void gradient(int c, int r, double* gu, double* gv) const {
    const auto at = [&](int x, int y) { return double(value[index(x, y)]); };
    *gu = (at(c + 1, r - 1) + 2 * at(c + 1, r) + at(c + 1, r + 1) - at(c - 1, r - 1) -
           2 * at(c - 1, r) - at(c - 1, r + 1)) /
          8;
    *gv = (at(c - 1, r + 1) + 2 * at(c, r + 1) + at(c + 1, r + 1) - at(c - 1, r - 1) -
           2 * at(c, r - 1) - at(c + 1, r - 1)) /
          8;
  }
};

int direction_bin(double du, double dv) {
  double angle = std::atan2(dv, du);
  if (angle < 0.0) angle += kPi;
  return static_cast<int>(std::floor(angle / kPi * kDirections + 0.5)) % kDirections;
}

double noise_dn(const PixelNoise& n, double value_dn, int cell) {
  const double dn = std::max(0.0, value_dn - n.offset_dn);
  const double read_dn = n.read_electrons / n.electrons_per_dn;
  return std::sqrt(read_dn * read_dn + dn / n.electrons_per_dn +
                   n.response * n.response * dn * dn) /
         cell;
}

}  // namespace

bool AttitudeSearch::find_region(const ImageView& image, const PixelNoise& noise) {
  const Grid grid(image, 0, 0, kCoarse_px, image.width / kCoarse_px, image.height / kCoarse_px);
  std::vector<float> steep(grid.value.size(), 0.0f);
  double steepest = 0.0;
  for (int r = 1; r + 1 < grid.rows; ++r) {
    for (int c = 1; c + 1 < grid.columns; ++c) {
      double gu, gv;
      grid.gradient(c, r, &gu, &gv);
      const double g = std::hypot(gu, gv);
      if (g < 4.0 * noise_dn(noise, double(grid.value[grid.index(c, r)]), kCoarse_px)) continue;
      steep[grid.index(c, r)] = static_cast<float>(g);
      steepest = std::max(steepest, g);
    }
  }
  std::vector<char> taken(steep.size(), 0);
  std::vector<Cell> queue;
  double best = 0.0;
  int low_u = 0, high_u = 0, low_v = 0, high_v = 0;
  const auto is_steep = [&](int c, int r) {
    return c >= 0 && r >= 0 && c < grid.columns &&
           r<grid.rows&& double(steep[grid.index(c, r)])> 0.04 * steepest;
  };
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      if (!is_steep(c, r) || taken[grid.index(c, r)] != 0) continue;
      queue.assign(1, Cell{c, r});
      taken[grid.index(c, r)] = 1;
      double sum = 0.0;
      int lu = c, hu = c, lv = r, hv = r;
      for (std::size_t k = 0; k < queue.size(); ++k) {
        const Cell at = queue[k];
        sum += double(steep[grid.index(at.u, at.v)]);
        lu = std::min(lu, at.u), hu = std::max(hu, at.u);
        lv = std::min(lv, at.v), hv = std::max(hv, at.v);
        for (int dv = -2; dv <= 2; ++dv) {
          for (int du = -2; du <= 2; ++du) {
            const int x = at.u + du, y = at.v + dv;
            if (!is_steep(x, y) || taken[grid.index(x, y)] != 0) continue;
            taken[grid.index(x, y)] = 1;
            queue.push_back({x, y});
          }
        }
      }
      if (sum <= best) continue;
      best = sum, low_u = lu, high_u = hu, low_v = lv, high_v = hv;
    }
  }
  // One that reaches the image's edge is not all there, or is no target.
  if (low_u <= 1 || low_v <= 1 || high_u >= grid.columns - 2 || high_v >= grid.rows - 2) {
    return false;
  }
  size_px_ = kCoarse_px * (std::max(high_u - low_u, high_v - low_v) + 1);
  if (size_px_ < kLeastPixels) return false;
  cell_ = static_cast<int>(std::ceil(size_px_ / kMostCells));
  left_ = kCoarse_px * low_u - kMargin * cell_;
  top_ = kCoarse_px * low_v - kMargin * cell_;
  columns_ = kCoarse_px * (high_u - low_u + 1) / cell_ + 2 * kMargin;
  rows_ = kCoarse_px * (high_v - low_v + 1) / cell_ + 2 * kMargin;
  return true;
}

void AttitudeSearch::find_edges(const ImageView& image, const PixelNoise& noise) {
  const Grid grid(image, left_, top_, cell_, columns_, rows_);
  std::vector<float> steep(grid.value.size(), 0.0f);
  std::vector<float> all;
  for (int r = 1; r + 1 < rows_; ++r) {
    for (int c = 1; c + 1 < columns_; ++c) {
      double gu, gv;
      grid.gradient(c, r, &gu, &gv);
      const double g = std::hypot(gu, gv);
      if (g < 3.0 * noise_dn(noise, double(grid.value[grid.index(c, r)]), cell_)) continue;
      steep[grid.index(c, r)] = static_cast<float>(g);
      all.push_back(static_cast<float>(g));
    }
  }
  edges_.clear();
  bins_.clear();
  if (all.empty()) return;
  const std::size_t at = all.size() * 9 / 10;
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(at), all.end());
  const double least = 0.08 * double(all[at]);
  low_u_ = low_v_ = 1e9, high_u_ = high_v_ = -1e9;
  for (int r = 1; r + 1 < rows_; ++r) {
    for (int c = 1; c + 1 < columns_; ++c) {
      const double g = double(steep[grid.index(c, r)]);
      if (g <= least) continue;
      double gu, gv;
      grid.gradient(c, r, &gu, &gv);
      const int du = std::fabs(gu) > 0.4 * g ? (gu > 0 ? 1 : -1) : 0;
      const int dv = std::fabs(gv) > 0.4 * g ? (gv > 0 ? 1 : -1) : 0;
      if (g < double(steep[grid.index(c + du, r + dv)]) ||
          g <= double(steep[grid.index(c - du, r - dv)])) {
        continue;
      }
      edges_.push_back({c, r});
      bins_.push_back(direction_bin(-gv, gu));
      low_u_ = std::min(low_u_, double(c)), high_u_ = std::max(high_u_, double(c));
      low_v_ = std::min(low_v_, double(r)), high_v_ = std::max(high_v_, double(r));
    }
  }
}

// Distances by two passes of 1 and sqrt(2) (Borgefors 1986), then how near that is.
void AttitudeSearch::spread_edges() {
  const std::size_t cells = std::size_t(columns_) * std::size_t(rows_);
  nearness_.assign(cells * kDirections, 1e3f);
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    const std::size_t at =
        std::size_t(edges_[k].v) * std::size_t(columns_) + std::size_t(edges_[k].u);
    for (int side = -1; side <= 1; ++side) {
      const int bin = (bins_[k] + side + kDirections) % kDirections;
      float& d = nearness_[std::size_t(bin) * cells + at];
      d = std::min(d, side == 0 ? 0.0f : 0.5f);
    }
  }
  const auto lower = [](float* d, float than) { *d = std::min(*d, than); };
  constexpr float kAslant = 1.414f;
  const std::ptrdiff_t line = columns_;
  for (int bin = 0; bin < kDirections; ++bin) {
    float* d = nearness_.data() + std::size_t(bin) * cells;
    for (int r = 1; r < rows_; ++r) {
      for (int c = 1; c + 1 < columns_; ++c) {
        float* at = d + r * line + c;
        lower(at, at[-1] + 1), lower(at, at[-line] + 1);
        lower(at, at[-line - 1] + kAslant), lower(at, at[-line + 1] + kAslant);
      }
    }
    for (int r = rows_ - 2; r >= 0; --r) {
      for (int c = columns_ - 2; c > 0; --c) {
        float* at = d + r * line + c;
        lower(at, at[1] + 1), lower(at, at[line] + 1);
        lower(at, at[line + 1] + kAslant), lower(at, at[line - 1] + kAslant);
      }
    }
    for (std::size_t k = 0; k < cells; ++k) {
      d[k] = std::max(0.0f, 1.0f - d[k] / static_cast<float>(kReach));
    }
  }
}

void AttitudeSearch::try_view(const Vec3& towards_B, std::vector<Guess>* best) {
  const Vec3 z = -1.0 * towards_B;
  Vec3 x = cross(std::fabs(z[2]) < 0.8 ? vec3(0, 0, 1) : vec3(1, 0, 0), z);
  x = (1.0 / norm(x)) * x;
  const Vec3 y = cross(z, x);
  const double radius = wireframe_.radius_m();
  wireframe_.seen_from((30.0 * radius) * towards_B, radius / 25.0, &points_);
  if (points_.size() < 20) return;
  struct Flat {
    double x, y, dx, dy;
  };
  std::vector<Flat> flat;
  flat.reserve(points_.size());
  for (const EdgePoint& p : points_) {
    const Vec3& d = wireframe_.edges()[static_cast<std::size_t>(p.edge)].unit_B;
    flat.push_back({dot(x, p.point_B), dot(y, p.point_B), dot(x, d), dot(y, d)});
  }
  const std::size_t cells = std::size_t(columns_) * std::size_t(rows_);
  const double width = high_u_ - low_u_, height = high_v_ - low_v_;
  Guess top;
  for (int turn = 0; turn < kTurns; ++turn) {
    const double c = std::cos(2 * kPi * turn / kTurns), s = std::sin(2 * kPi * turn / kTurns);
    double lx = 1e9, hx = -1e9, ly = 1e9, hy = -1e9;
    for (const Flat& f : flat) {
      const double px = c * f.x - s * f.y, py = s * f.x + c * f.y;
      lx = std::min(lx, px), hx = std::max(hx, px);
      ly = std::min(ly, py), hy = std::max(hy, py);
    }
    const double sx = width / std::max(hx - lx, 1e-6), sy = height / std::max(hy - ly, 1e-6);
    if (!(sx < 1.5 * sy && sy < 1.5 * sx)) continue;
    // The longer side says more of the scale.
    const double scale = width > height ? sx : sy;
    const double u0 = 0.5 * (low_u_ + high_u_) - 0.5 * scale * (lx + hx);
    const double v0 = 0.5 * (low_v_ + high_v_) - 0.5 * scale * (ly + hy);
    double score = 0.0;
    for (const Flat& f : flat) {
      const int u = static_cast<int>(std::lround(u0 + scale * (c * f.x - s * f.y)));
      const int v = static_cast<int>(std::lround(v0 + scale * (s * f.x + c * f.y)));
      if (u < 0 || v < 0 || u >= columns_ || v >= rows_) continue;
      const int bin = direction_bin(c * f.dx - s * f.dy, s * f.dx + c * f.dy);
      score += double(nearness_[std::size_t(bin) * cells + std::size_t(v) * std::size_t(columns_) +
                                std::size_t(u)]);
    }
    score /= static_cast<double>(flat.size());
    if (score <= top.score) continue;
    const Mat3 R{{{x[0], x[1], x[2]}, {y[0], y[1], y[2]}, {z[0], z[1], z[2]}}};
    const Mat3 roll{{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
    top = {score, scale, u0, v0, roll * R};
  }
  if (!(top.score > 0.0)) return;
  const auto better = [](const Guess& a, const Guess& b) { return a.score > b.score; };
  best->insert(std::upper_bound(best->begin(), best->end(), top, better), top);
  if (best->size() > kMostGuesses) best->pop_back();
}

bool AttitudeSearch::look(const Camera& camera, const ImageView& image, const PixelNoise& noise,
                          std::vector<Pose>* poses) {
  poses->clear();
  if (!find_region(image, noise)) return false;
  find_edges(image, noise);
  if (edges_.size() < 30 || !(high_u_ > low_u_ + 8) || !(high_v_ > low_v_ + 8)) return false;
  spread_edges();
  std::vector<Guess> best;
  best.reserve(kMostGuesses + 1);
  // A spiral of equal areas on the sphere.
  for (int k = 0; k < kViews; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / kViews, r = std::sqrt(1.0 - z * z);
    const double angle = k * kPi * (3.0 - std::sqrt(5.0));
    try_view(vec3(r * std::cos(angle), r * std::sin(angle), z), &best);
  }
  for (const Guess& guess : best) {
    Pose pose;
    Vec3 ray;
    const Pixel at{left_ + (guess.u + 0.5) * cell_ - 0.5, top_ + (guess.v + 0.5) * cell_ - 0.5};
    if (!unproject(camera, at, &ray)) continue;
    pose.r_BC_C = (camera.fx / (guess.scale * cell_)) * ray;
    // From the line of sight to the boresight.
    const Vec3 axis = cross(ray, vec3(0, 0, 1));
    const double sine = norm(axis);
    const Vec3 turn = sine > 1e-9 ? (std::asin(std::min(1.0, sine)) / sine) * axis : Vec3();
    pose.R_CB = turned(turn, guess.R_SB);
    poses->push_back(pose);
  }
  return !poses->empty();
}

double AttitudeSearch::explained(const Camera& camera, const Pose& pose) const {
  std::vector<char> near(std::size_t(columns_) * std::size_t(rows_), 0);
  std::vector<EdgePoint> points;
  wireframe_.seen_from(-1.0 * (transpose(pose.R_CB) * pose.r_BC_C),
                       cell_ * norm(pose.r_BC_C) / camera.fx, &points);
  for (const EdgePoint& p : points) {
    Pixel at;
    if (!project(camera, pose.r_BC_C + pose.R_CB * p.point_B, &at)) continue;
    const int u = static_cast<int>(std::floor((at.u + 0.5 - left_) / cell_));
    const int v = static_cast<int>(std::floor((at.v + 0.5 - top_) / cell_));
    for (int y = std::max(0, v - 1); y <= std::min(rows_ - 1, v + 1); ++y) {
      for (int x = std::max(0, u - 1); x <= std::min(columns_ - 1, u + 1); ++x) {
        near[std::size_t(y) * std::size_t(columns_) + std::size_t(x)] = 1;
      }
    }
  }
  int count = 0;
  for (const Cell& e : edges_) {
    count += near[std::size_t(e.v) * std::size_t(columns_) + std::size_t(e.u)];
  }
  return edges_.empty() ? 0.0 : count / static_cast<double>(edges_.size());
}

}  // namespace rpo_kit
