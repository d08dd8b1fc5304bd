/// What a detector makes of the light: charge with its noise, saturation, numbers.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/models/camera/image.hpp>

#include <vector>

namespace orrery {

struct DetectorOptions {
  int bits = 12;                       // of the converter, 8 to 16
  double gain_electrons_per_DN = 4;    // 0.01 to 1e4
  double offset_DN = 64;               // 0 to 2^bits - 1
  double full_well_electrons = 15000;  // 100 to 1e7
  bool shot_noise = true;
  double read_noise_electrons = 8;       // rms, 0 to 1000
  double dark_electrons_ps = 20;         // mean per pixel, 0 to 1e6
  double dark_nonuniformity = 0.1;       // rms of the dark current of pixels / its mean, 0 to 1
  double response_nonuniformity = 0.01;  // rms of the response of pixels / its mean, 0 to 0.3
  double hot_pixels_per_million = 50;    // 0 to 1e5
  double hot_pixel_electrons_ps =
      3000;                   // mean (exponential) of their additional dark current, 0 to 1e7
  double bloom = 0;           // part of the charge above full well that runs along the
                              // column, half of it each way; the rest is drained. 0 to 1
  double cosmic_rays_ps = 0;  // on the whole detector, mean rate, 0 to 1e5
};

/// A number with the Poisson distribution.
/// Method   Below a mean of 30 the cumulative distribution, inverted (one draw). From there on a
/// normal
///          variable z (one draw) as m + sqrt(m) z + (z^2 - 1)/6, rounded: mean, variance and third
///          moment are right, and the distribution function within 2e-3 at 30.
/// @param mean  0 or above, finite; else 0 is returned without a draw.
double poisson(RandomStream& stream, double mean);

/// One detector: its fixed pattern is drawn once, from a stream that stands for its serial number.
///
/// Method      Charge = Poisson(light x response + dark) + tracks of cosmic rays; what exceeds the
/// full
///             well blooms along the column; then read noise, gain, offset, rounding, clipping.
///             Each row of each frame has streams of its own, so that the number of threads does
///             not show.
/// Checked by  test_suites/unit/models/camera/detector_test.cpp: photon transfer curve and moments.
class Detector {
 public:
  /// @throws std::invalid_argument  an option outside its range.
  Detector(const DetectorOptions& options, int width_px, int height_px,
           RandomStream& fixed_pattern);

  const DetectorOptions& options() const { return options_; }
  /// @param light      Expected photo-electrons of the exposure, of the detector's size.
  /// @param exposure_s For the dark current and the cosmic rays.
  /// @param frame_key  Of this frame's random streams: another for each frame.
  DigitalImage read(const ElectronImage& light, double exposure_s, std::uint64_t frame_key,
                    int threads = 1) const;

  /// Adds `count` hot pixels, as radiation does.
  void add_hot_pixels(int count, RandomStream& stream);
  /// Cosmic rays from now on, on the whole detector per second.
  void set_cosmic_rays_ps(double rate) { options_.cosmic_rays_ps = rate; }
  /// Dark current per pixel [electrons/s].
  const Image<float>& dark_electrons_ps() const { return dark_; }

 private:
  void collect(Image<float>& charge, const ElectronImage& light, double exposure_s,
               std::uint64_t frame_key, int threads) const;
  void add_cosmic_rays(Image<float>& charge, double exposure_s, std::uint64_t frame_key) const;
  void saturate(Image<float>& charge) const;
  void convert(DigitalImage& out, const Image<float>& charge, std::uint64_t frame_key,
               int threads) const;

  DetectorOptions options_;
  Image<float> response_, dark_;
};

}  // namespace orrery
