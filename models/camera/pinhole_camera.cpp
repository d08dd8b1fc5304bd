#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/pinhole_camera.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {

namespace {

constexpr double kBeyondCorner = 1.1;
constexpr int kRadialSteps = 64;

void check(const char* option, double value, double low, double high, const char* unit) {
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument("PinholeCamera: " + std::string(option) + " = " + to_text(value) +
                                " " + unit + "; accepted: " + to_text(low) + " to " +
                                to_text(high));
  }
}

[[noreturn]] void refuse_folding() {
  throw std::invalid_argument(
      "PinholeCamera: distortion maps two directions to one point within 1.1 times the radius of "
      "the farthest corner; accepted: one to one");
}

}  // namespace

PinholeCamera::PinholeCamera(const PinholeOptions& options) : options_(options) {
  check("width_px", options.width_px, 16, 4096, "px");
  check("height_px", options.height_px, 16, 4096, "px");
  check("fx_px", options.fx_px, 10, 1e6, "px");
  check("fy_px", options.fy_px, 10, 1e6, "px");
  cx_ = options.cx_px.value_or(0.5 * (options.width_px - 1));
  cy_ = options.cy_px.value_or(0.5 * (options.height_px - 1));
  check("cx_px", cx_, 0, options.width_px - 1, "px");
  check("cy_px", cy_, 0, options.height_px - 1, "px");
  const LensDistortion& d = options.distortion;
  for (const double k : {d.k1, d.k2, d.p1, d.p2, d.k3}) check("distortion", k, -1e9, 1e9, "");
  find_field();
}

// The corners from within: the undistorted radius at which each is reached grows along its ray.
void PinholeCamera::find_field() {
  largest_r_ = 1e9;
  double farthest = 0;
  for (const double u : {-0.5, options_.width_px - 0.5}) {
    for (const double v : {-0.5, options_.height_px - 0.5}) {
      const std::optional<Plane> corner =
          undistorted({(u - cx_) / options_.fx_px, (v - cy_) / options_.fy_px});
      if (!corner) refuse_folding();
      farthest = std::max(farthest, std::hypot(corner->x, corner->y));
    }
  }
  half_field_ = std::atan(farthest);
  largest_r_ = kBeyondCorner * farthest;
  for (int i = 0; i <= kRadialSteps; ++i) {
    for (int k = 0; k < 8; ++k) {
      const double r = largest_r_ * i / kRadialSteps, a = k * (3.14159265358979323846 / 4);
      const Jacobian j = derivative({r * std::cos(a), r * std::sin(a)});
      if (!(j.determinant() > 0 && j.xx > 0)) refuse_folding();
    }
  }
}

PinholeCamera::Plane PinholeCamera::distorted(const Plane& at) const {
  const LensDistortion& d = options_.distortion;
  const double x = at.x, y = at.y, r2 = x * x + y * y;
  const double q = 1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  return {x * q + 2 * d.p1 * x * y + d.p2 * (r2 + 2 * x * x),
          y * q + d.p1 * (r2 + 2 * y * y) + 2 * d.p2 * x * y};
}

PinholeCamera::Jacobian PinholeCamera::derivative(const Plane& at) const {
  const LensDistortion& d = options_.distortion;
  const double x = at.x, y = at.y, r2 = x * x + y * y;
  const double q = 1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  const double dq = 2 * (d.k1 + r2 * (2 * d.k2 + 3 * r2 * d.k3));  // (dq/dx) / x
  return {q + x * x * dq + 2 * d.p1 * y + 6 * d.p2 * x, x * y * dq + 2 * d.p1 * x + 2 * d.p2 * y,
          q + y * y * dq + 6 * d.p1 * y + 2 * d.p2 * x};
}

std::optional<PinholeCamera::Plane> PinholeCamera::undistorted(const Plane& at) const {
  Plane guess = at;
  for (int i = 0; i < 50; ++i) {
    const Plane seen = distorted(guess);
    const double ex = at.x - seen.x, ey = at.y - seen.y;
    const double error = std::abs(ex) + std::abs(ey);
    if (error < 1e-13) return guess;
    const Jacobian j = derivative(guess);
    const double det = j.determinant();
    if (!(det > 0)) return {};
    guess.x += (j.yy * ex - j.xy * ey) / det;
    guess.y += (j.xx * ey - j.xy * ex) / det;
  }
  return {};
}

std::optional<Pixel> PinholeCamera::project(const Vec3& p_C) const {
  if (!(p_C.z > 0)) return {};
  const Plane plain{p_C.x / p_C.z, p_C.y / p_C.z};
  const double r = std::hypot(plain.x, plain.y);
  Plane seen;
  if (r <= largest_r_) {
    seen = distorted(plain);
  } else {
    const double s = largest_r_ / r;
    seen = distorted({plain.x * s, plain.y * s});
    seen = {seen.x / s, seen.y / s};
  }
  return Pixel{options_.fx_px * seen.x + cx_, options_.fy_px * seen.y + cy_};
}

Vec3 PinholeCamera::direction_C(const Pixel& pixel) const {
  const std::optional<Plane> plain =
      undistorted({(pixel.u - cx_) / options_.fx_px, (pixel.v - cy_) / options_.fy_px});
  if (!plain) {
    throw std::domain_error("PinholeCamera::direction_C: (" + to_text(pixel.u) + ", " +
                            to_text(pixel.v) + ") px is too far outside the image");
  }
  return unit({plain->x, plain->y, 1});
}

double PinholeCamera::solid_angle_sr(const Pixel& pixel) const {
  const Vec3 d = direction_C(pixel);
  const Jacobian j = derivative({d.x / d.z, d.y / d.z});
  return d.z * d.z * d.z / (options_.fx_px * options_.fy_px * j.determinant());
}

bool PinholeCamera::is_inside(const Pixel& p, double margin_px) const {
  const double edge = 0.5 + margin_px;
  return p.u >= -edge && p.v >= -edge && p.u <= options_.width_px - 1 + edge &&
         p.v <= options_.height_px - 1 + edge;
}

}  // namespace orrery
