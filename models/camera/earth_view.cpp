#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/camera/earth_view.hpp>
#include <orrery/models/camera/gl_renderer.hpp>
#include <orrery/models/camera/parallel_rows.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace orrery {

namespace {

constexpr double kSpeedOfLight_mps = 299792458.0;
constexpr double kPi = 3.14159265358979323846;
constexpr double kAtmosphereScales = 10;
constexpr double kWater = 0.06, kLand = 0.10;  // albedo
constexpr double kGlintReflectance = 0.02, kGlintExponent = 30;
constexpr int kTogether = 64;  // pixels

void check(const char* option, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument("EarthView: " + std::string(option) + " = " + to_text(value) +
                                "; accepted: " + to_text(low) + " to " + to_text(high));
  }
}

// Everything in Earth-fixed axes, z stretched so that the ellipsoid is a sphere of radius 1.
class EarthRays {
 public:
  EarthRays(const EarthViewOptions& options, const EarthPose& pose)
      : options_(options),
        unit_m_(options.radius_m),
        stretch_(1 / (1 - options.flattening)),
        R_EC_(pose.R_EI * transpose(pose.R_CI)),
        beta_C_(pose.R_CI * pose.v_ECI / kSpeedOfLight_mps),
        to_sun_(pose.R_EI * pose.to_sun_ECI),
        sun_(pose.sun),
        top_(options.atmosphere ? kAtmosphereScales * options.scale_height_m / options.radius_m
                                : 0) {
    const Vec3 r = pose.R_EI * pose.r_ECI / unit_m_;
    p_ = {r.x, r.y, r.z * stretch_};
    c_ = dot(p_, p_) - 1;
  }

  struct Crossing {
    Vec3 d_E;             // unit vector, true direction of the ray
    Vec3 q;               // the same, stretched
    double a = 0, b = 0;  // of a t^2 + 2 b t + c = 0
    double height = 0;    // of the tangent point over the surface, over the radius: about
  };
  // From the direction (unit vector) in which it is seen: not aberrated, to first order (1e-9).
  Crossing cross(const Vec3& seen_C) const {
    Crossing x;
    x.d_E = R_EC_ * (seen_C - beta_C_ + dot(seen_C, beta_C_) * seen_C);
    x.q = {x.d_E.x, x.d_E.y, x.d_E.z * stretch_};
    x.a = dot(x.q, x.q), x.b = dot(x.q, p_);
    x.height = 0.5 * (c_ - x.b * x.b / x.a);
    return x;
  }
  GlRenderer::EarthDrawing drawing() const {
    const EarthSurface& surface = options_.surface;
    return {.R_EC = R_EC_,
            .beta_C = beta_C_,
            .to_sun_E = to_sun_,
            .p = p_,
            .stretch = stretch_,
            .sun = sun_,
            .scale_height = options_.scale_height_m / unit_m_,
            .limb = options_.atmosphere ? options_.limb_reflectance : 0,
            .glint = options_.glint,
            .cells = surface.cells(),
            .surface = &surface.samples()[0].albedo};
  }
  bool hits(const Crossing& x) const { return x.b < 0 && x.height <= 0; }

  // Part of a pixel, and radiance [suns/sr] of the covered and of the open part.
  struct Seen {
    double covered = 0, radiance = 0;
  };
  // Up to kTogether pixels of one row, added to `suns` and `covered`. What is not on the edge of
  // the solid Earth is computed side by side, and where neither it nor the atmosphere is, not at
  // all.
  void look(const PixelRay* rays, int count, float weight, float* suns, float* covered) const {
    Together t;
    if (!cross(rays, count, t)) return;
    find_normals(count, t);
    for (int i = 0; i < count; ++i) {
      if (!t.is_seen[i]) continue;
      const double solid_angle = rays[i].solid_angle_sr;
      Seen seen;
      if (t.is_edge[i]) {
        seen = look({{t.dx[i], t.dy[i], t.dz[i]},
                     {t.dx[i], t.dy[i], t.dz[i] * stretch_},
                     t.a[i],
                     t.b[i],
                     t.height[i]},
                    std::sqrt(solid_angle));
      } else if (t.height[i] < 0) {
        seen = {1, radiance({t.dx[i], t.dy[i], t.dz[i]}, {t.nx[i], t.ny[i], t.nz[i]}, t.cosine[i])};
      } else {
        seen.radiance = glow(t.height[i] * unit_m_, t.cosine[i]);
      }
      suns[i] += weight * static_cast<float>(seen.radiance * solid_angle);
      covered[i] += weight * static_cast<float>(seen.covered);
    }
  }

 private:
  struct Together {
    double dx[kTogether], dy[kTogether], dz[kTogether];  // as Crossing has them
    double a[kTogether], b[kTogether], height[kTogether];
    bool is_seen[kTogether], is_edge[kTogether];
    // Where the ray meets the surface, or else at the tangent point; cosine of the Sun's angle.
    double nx[kTogether], ny[kTogether], nz[kTogether], cosine[kTogether];
  };

  // False: nothing of the Earth is seen.
  bool cross(const PixelRay* rays, int count, Together& t) const {
    const Mat3 R = R_EC_;  // copies, which the loop's results cannot change
    const Vec3 beta = beta_C_, p = p_;
    const double stretch = stretch_, c = c_;
    for (int i = 0; i < count; ++i) {
      const double x = rays[i].x, y = rays[i].y, z = rays[i].z;
      const double along = x * beta.x + y * beta.y + z * beta.z;
      const double u = x - beta.x + along * x, v = y - beta.y + along * y,
                   w = z - beta.z + along * z;
      const double dx = R.row_x.x * u + R.row_x.y * v + R.row_x.z * w;
      const double dy = R.row_y.x * u + R.row_y.y * v + R.row_y.z * w;
      const double dz = R.row_z.x * u + R.row_z.y * v + R.row_z.z * w;
      const double qz = dz * stretch;
      const double a = dx * dx + dy * dy + qz * qz;
      const double b = dx * p.x + dy * p.y + qz * p.z;
      t.dx[i] = dx, t.dy[i] = dy, t.dz[i] = dz;
      t.a[i] = a, t.b[i] = b;
      t.height[i] = 0.5 * (c - b * b / a);
    }
    const double top = top_;
    int seen = 0;
    for (int i = 0; i < count; ++i) {
      // Half a pixel at the tangent point, squared, against the height: as look() has it.
      const double a = t.a[i], b = t.b[i], h = t.height[i];
      t.is_edge[i] = h * h * a * a < 0.25 * b * b * double(rays[i].solid_angle_sr);
      t.is_seen[i] = (b < 0) & ((h < top) | t.is_edge[i]);
      seen += t.is_seen[i];
    }
    return seen > 0;
  }

  void find_normals(int count, Together& t) const {
    const Vec3 p = p_, to_sun = to_sun_;
    const double stretch = stretch_, c = c_;
    for (int i = 0; i < count; ++i) {
      const double a = t.a[i], b = t.b[i];
      const double root2 = b * b - a * c;
      const double positive = 0.5 * (root2 + std::abs(root2));  // exactly, and without a branch
      const double way = (-b - std::sqrt(positive)) / a;
      const double x = p.x + way * t.dx[i], y = p.y + way * t.dy[i];
      const double z = (p.z + way * (t.dz[i] * stretch)) * stretch;
      const double scale = 1 / std::sqrt(x * x + y * y + z * z);
      t.nx[i] = x * scale, t.ny[i] = y * scale, t.nz[i] = z * scale;
      t.cosine[i] = t.nx[i] * to_sun.x + t.ny[i] * to_sun.y + t.nz[i] * to_sun.z;
    }
  }

  // Of a pixel at the edge.
  Seen look(const Crossing& x, double pixel_rad) const {
    Seen seen;
    const double range = -x.b / x.a;  // to the tangent point
    const double off_limb_px = x.height / (range * pixel_rad);
    seen.covered = std::clamp(0.5 - off_limb_px, 0.0, 1.0);
    if (seen.covered > 0) seen.radiance = seen.covered * surface(x);
    if (seen.covered < 1 && options_.atmosphere) {
      seen.radiance += (1 - seen.covered) * limb(x, range);
    }
    return seen;
  }

  double surface(const Crossing& x) const {
    const double root = std::sqrt(std::max(0.0, x.b * x.b - x.a * c_));
    const double t = (-x.b - root) / x.a;
    const Vec3 s = p_ + t * x.q;  // on the unit sphere
    const Vec3 normal = unit({s.x, s.y, s.z * stretch_});
    return radiance(x.d_E, normal, dot(normal, to_sun_));
  }
  // Of the surface.
  double radiance(const Vec3& d_E, const Vec3& normal, double cosine) const {
    const EarthSurface::Sample map = options_.surface.at(normal);
    if (cosine <= 0) return sun_ / kPi * double(map.night);
    const double diffuse = sun_ / kPi * double(map.albedo) * cosine;
    if (!options_.glint) return diffuse;
    const double water = std::clamp((kLand - double(map.albedo)) / (kLand - kWater), 0.0, 1.0);
    return water > 0 ? diffuse + water * glint(d_E, normal, cosine) : diffuse;
  }
  double glint(const Vec3& d_E, const Vec3& normal, double cosine) const {
    const double half = std::max(0.0, dot(normal, unit(to_sun_ - d_E)));
    return sun_ * cosine * kGlintReflectance * (kGlintExponent + 8) / (8 * kPi) *
           std::pow(half, kGlintExponent);
  }
  double limb(const Crossing& x, double range) const {
    const Vec3 s = p_ + range * x.q;
    return glow(std::max(0.0, x.height) * unit_m_, dot(unit({s.x, s.y, s.z * stretch_}), to_sun_));
  }
  double glow(double height_m, double cosine) const {
    if (!options_.atmosphere || height_m > kAtmosphereScales * options_.scale_height_m) return 0;
    return sun_ / kPi * options_.limb_reflectance * std::max(0.0, cosine) *
           std::exp(-height_m / options_.scale_height_m);
  }

  const EarthViewOptions& options_;
  double unit_m_, stretch_;
  Mat3 R_EC_;
  Vec3 beta_C_, to_sun_, p_;
  double sun_, top_, c_ = 0;  // top of the atmosphere, over the radius
};

}  // namespace

EarthView::EarthView(const EarthViewOptions& options) : options_(options) {
  check("radius_m", options.radius_m, 1e3, 1e8);
  check("flattening", options.flattening, 0, 0.01);
  check("scale_height_m", options.scale_height_m, 1000, 30000);
  check("limb_reflectance", options.limb_reflectance, 0, 1);
}

bool EarthView::is_in_view(const PinholeCamera& camera, const EarthPose& pose) const {
  const double r = norm(pose.r_ECI);
  const double top = options_.radius_m + kAtmosphereScales * options_.scale_height_m;
  const double reach = std::asin(std::min(1.0, top / r)) + camera.half_field_rad() + 1e-3;
  const double cosine = -dot(pose.R_CI.row_z, pose.r_ECI) / r;
  return reach >= kPi || cosine > std::cos(reach);
}

bool EarthView::hides(const Vec3& u_ECI, const EarthPose& pose) const {
  const EarthRays rays(options_, pose);
  return rays.hits(rays.cross(pose.R_CI * u_ECI));
}

void EarthView::add(Image<float>& suns, Image<float>& covered, const Image<PixelRay>& rays,
                    const EarthPose& pose, float weight, int threads, GlRenderer* gl) const {
  const EarthRays earth(options_, pose);
  if (gl != nullptr) {
    const auto drawn = gl->earth(earth.drawing(), rays);
    for (std::size_t k = 0; k < drawn.size(); ++k) {
      suns.values[k] += weight * drawn[k].first;
      covered.values[k] += weight * drawn[k].second;
    }
    return;
  }
  for_bands_of_rows(threads, rays.height_px, [&](int first, int end) {
    for (std::size_t k = rays.index(0, first); k < rays.index(0, end); k += kTogether) {
      const std::size_t count = std::min<std::size_t>(kTogether, rays.index(0, end) - k);
      earth.look(&rays.values[k], static_cast<int>(count), weight, &suns.values[k],
                 &covered.values[k]);
    }
  });
}

}  // namespace orrery
