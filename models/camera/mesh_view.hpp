/// A lit mesh as a camera sees it at one instant, on a grid finer than the pixels.
#pragma once

#include <orrery/models/camera/image.hpp>
#include <orrery/models/camera/lighting.hpp>
#include <orrery/models/camera/mesh.hpp>
#include <orrery/models/camera/optics.hpp>

#include <vector>

namespace orrery {

class GlRenderer;

struct MeshPose {
  Mat3 R_CI{}, R_TI{};  // axes of the camera and of the target
  Vec3 r_TC_ECI{};      // target's origin relative to the camera [m]
};

/// Samples of a target, the first with its corner at (left, top).
struct MeshSamples {
  int columns = 0, rows = 0;
  double left = 0, top = 0;           // image coordinates of the corner of the first sample [px]
  double per_px_u = 1, per_px_v = 1;  // samples to the pixel
  std::vector<float> suns = {};       // irradiance at the camera by each sample's part [suns]
  std::vector<char> covered = {};

  /// Of all samples.
  double total_suns() const;
  /// Centre of light, or of what is covered where there is no light.
  Pixel photocentre() const;
  /// Covered [px^2].
  double area_px2() const;
};

/// Method      Triangles are projected by their corners, with the lens, and scanned into a grid,
///             nearest first by 1/Z: 128 samples across a point, 16 to the pixel up to 64 px, then
///             1024 across, 2 to the pixel from 512 px on. The grid ends where the target does.
///             Back faces are left out, and triangles that reach behind 1 mm before the pinhole.
///             Sunlight by a shadow map along the Sun's direction, at least as fine as the grid up
///             to 512 across; Earthshine without shadows. Each sample counts with its own solid
///             angle.
/// Errors      An edge is in place to half a sample at worst, along rows or columns. Edges of large
///             triangles are straight in the image: the lens's bend along them is left out.
/// @param gl   By which to draw, in 32-bit floats; null: on the CPU.
/// Checked by  test_suites/unit/models/camera/mesh_view_test.cpp: closed forms of sphere and box.
MeshSamples sample_mesh(const Mesh& mesh, const PinholeCamera& camera, const MeshPose& pose,
                        const Lighting& light, int threads = 1, GlRenderer* gl = nullptr);

/// Spreads the samples over the pixels by the PSF, each integrated over the pixels.
/// @param covered  To which the covered part of each pixel, blurred likewise, is added.
/// @param left_px, top_px  The first pixel of both images, which may be a part of the camera's.
void add_samples(ElectronImage& image, Image<float>& covered, const MeshSamples& samples,
                 double electrons_per_sun, double psf_sigma_px, double weight = 1, int threads = 1,
                 int left_px = 0, int top_px = 0);

}  // namespace orrery
