/// Point sources in an image: background, detection, centroids with their uncertainty.
///
/// Method      Background and noise per tile: median, and standard deviation of what is within
///             3 sigma of it; both interpolated between tile centres. Groups of 8-connected pixels
///             above the threshold. Centroids by a Gaussian window that is iterated to where its
///             first moment vanishes (the windowed centroid of Bertin & Arnouts' SExtractor), which
///             has no truncation bias; its variance is propagated from the pixels'.
/// Accuracy    Bias 0.005 px for a PSF of 0.7 px (1 sigma), below 0.001 px from 0.8 px on;
///             noise within 10 % of what `sigma_px` says for a signal-to-noise ratio above 8.
/// Memory      Taken once, with the detector; none while detecting but for `found`.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/detection_test.cpp
#pragma once

#include <cstdint>
#include <vector>

namespace rpo_kit {

/// Row after row, no padding. Not owned.
struct ImageView {
  const std::uint16_t* pixels = nullptr;
  int width = 0, height = 0;
};

struct DetectionOptions {
  double threshold_sigma = 5.0;
  double psf_sigma_px = 0.8;
  int min_pixels = 2;             ///< above threshold; a lone one is noise, a ray or a hot pixel
  int max_pixels = 400;           ///< more is no point source
  double electrons_per_dn = 1.0;  ///< of shot noise; 0: none
  double saturation_dn = 65535.0;
  double floor_sigma_px = 0.01;  ///< added to every centroid's uncertainty: calibration
};

struct Detection {
  double u = 0.0, v = 0.0;  ///< centroid [px]
  double sigma_px = 0.0;    ///< 1-sigma, root mean square of both axes
  double flux_dn = 0.0;     ///< above background
  double snr = 0.0;         ///< flux over its own 1-sigma
  double sharpness = 0.0;   ///< brightest pixel over flux: near 1 for a hot pixel
  int pixels = 0;
  bool saturated = false;
};

class PointSourceDetector {
 public:
  static constexpr int kTile = 32;  ///< [px]

  PointSourceDetector(int width, int height, const DetectionOptions& options = {});

  /// Of the next images, where they differ from the options.
  void set_conversion(double electrons_per_dn, double saturation_dn) {
    options_.electrons_per_dn = electrons_per_dn;
    options_.saturation_dn = saturation_dn;
  }

  /// Brightest first; the centroid's window lies inside the image.
  /// @return false, and nothing found, if the image is not of the size that was announced.
  bool detect(const ImageView& image, std::vector<Detection>* found);

  /// Of the last image, at a pixel [DN].
  double background(int x, int y) const { return interpolate(median_, x, y); }
  double noise(int x, int y) const { return interpolate(sigma_, x, y); }
  /// A point source's sharpness is below that, whatever its position on the pixel.
  double hot_sharpness() const { return hot_sharpness_; }

 private:
  double interpolate(const std::vector<float>& grid, int x, int y) const;
  void measure_tile(const ImageView& image, int tile_x, int tile_y);
  void mark(const ImageView& image);
  void gather(int start);
  bool measure(const ImageView& image, Detection* detection) const;

  int width_, height_, tiles_x_, tiles_y_, radius_;
  DetectionOptions options_;
  double window_sigma_px_, hot_sharpness_;
  std::vector<float> median_, sigma_, scratch_;
  std::vector<std::uint8_t> marked_;
  std::vector<std::int32_t> group_;
};

}  // namespace rpo_kit
