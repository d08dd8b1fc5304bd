#include "rpo_kit/imaging/camera.hpp"

#include <cmath>

namespace rpo_kit {
namespace {

using flight_support::Matrix;
using flight_support::Vec3;

struct Distorted {
  double x, y;
  double xx, xy, yx, yy;  // partials: row, column
};

Distorted distort(const Camera& c, double x, double y) {
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const double slope = c.k1 + r2 * (2.0 * c.k2 + 3.0 * r2 * c.k3);  // d radial / d r2
  Distorted d;
  d.x = x * radial + 2.0 * c.p1 * x * y + c.p2 * (r2 + 2.0 * x * x);
  d.y = y * radial + c.p1 * (r2 + 2.0 * y * y) + 2.0 * c.p2 * x * y;
  d.xx = radial + 2.0 * x * x * slope + 2.0 * c.p1 * y + 6.0 * c.p2 * x;
  d.xy = 2.0 * x * y * slope + 2.0 * c.p1 * x + 2.0 * c.p2 * y;
  d.yx = d.xy;
  d.yy = radial + 2.0 * y * y * slope + 6.0 * c.p1 * y + 2.0 * c.p2 * x;
  return d;
}

}  // namespace

bool project(const Camera& camera, const Vec3& direction_C, Pixel* pixel, Matrix<2, 3>* partials) {
  const double z = direction_C[2];
  if (!(z > 0.0)) return false;
  const double x = direction_C[0] / z, y = direction_C[1] / z;
  const Distorted d = distort(camera, x, y);
  *pixel = {camera.fx * d.x + camera.cx, camera.fy * d.y + camera.cy};
  if (partials != nullptr) {
    const double fx = camera.fx / z, fy = camera.fy / z;
    *partials = Matrix<2, 3>{{{fx * d.xx, fx * d.xy, -fx * (d.xx * x + d.xy * y)},
                              {fy * d.yx, fy * d.yy, -fy * (d.yx * x + d.yy * y)}}};
  }
  return true;
}

bool project(const Camera& camera, const Vec3& direction_C, Pixel* pixel) {
  return project(camera, direction_C, pixel, nullptr);
}

bool unproject(const Camera& camera, const Pixel& pixel, Vec3* direction_C) {
  const double u = (pixel.u - camera.cx) / camera.fx, v = (pixel.v - camera.cy) / camera.fy;
  double x = u, y = v;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Distorted d = distort(camera, x, y);
    const double eu = u - d.x, ev = v - d.y;
    const double determinant = d.xx * d.yy - d.xy * d.yx;
    if (!(determinant > 0.0)) return false;  // folded over
    const double dx = (d.yy * eu - d.xy * ev) / determinant;
    const double dy = (d.xx * ev - d.yx * eu) / determinant;
    x += dx;
    y += dy;
    if (std::fabs(dx) + std::fabs(dy) < 1e-14) break;
    if (iteration == 19) return false;
  }
  const double length = std::sqrt(x * x + y * y + 1.0);
  *direction_C = flight_support::vec3(x / length, y / length, 1.0 / length);
  return true;
}

}  // namespace rpo_kit
