/// How much light a camera gathers, and how a point spreads.
#pragma once

#include <orrery/models/camera/image.hpp>
#include <orrery/models/camera/pinhole_camera.hpp>

namespace orrery {

struct OpticsOptions {
  double aperture_m = 0.02;   // diameter, 1e-4 to 1
  double throughput = 1;      // of optics and detector relative to `zero_point`, above 0 to 2
  double psf_sigma_px = 0.8;  // of a Gaussian, 0.3 to 5
  /// Photo-electrons per second and m^2 from V = 0, of a star like the Sun on a silicon detector:
  /// Liebe, Accuracy Performance of Star Trackers, IEEE TAES 38 (2002), 1.9e4 /s/mm^2. 1e6 to 1e12.
  double zero_point_ps_pm2 = 1.9e10;
  double vignetting_power = 1;  // of the cosine of the angle off the boresight; 0 to 8
};

constexpr double kSunMagnitude =
    -26.74;  // V at 1 au; Allen (2000) and Willmer (2018): -26.74 to -26.76

/// The colour of a star is not taken into account: a cool star gives silicon more than its V says.
class Optics {
 public:
  /// @throws std::invalid_argument  an option outside its range.
  explicit Optics(const OpticsOptions& options = {});

  const OpticsOptions& options() const { return options_; }
  /// Photo-electrons per second from a point of V = `magnitude`.
  double electrons_ps(double magnitude) const;
  /// The same from an irradiance given as a fraction of that of the Sun at 1 au.
  double electrons_ps_of_suns(double suns) const { return suns * sun_ps_; }

 private:
  OpticsOptions options_;
  double area_m2_ = 0, sun_ps_ = 0;
};

/// Adds a point's light, its Gaussian integrated over each pixel:
/// N/4 [erf((i + 1/2 - u)/(s sqrt 2)) - erf((i - 1/2 - u)/(s sqrt 2))] [the same in v], on the
/// pixels within 5 sigma of the centre, which leaves out 1.1e-6 of it.
void add_point(ElectronImage& image, const Pixel& at, double electrons, double sigma_px);

/// Multiplies by cos^power of the angle off the boresight.
class Vignetting {
 public:
  Vignetting(const PinholeCamera& camera, double power);
  void apply(ElectronImage& image, int threads = 1) const;

 private:
  Image<float> factor_;  // empty: 1 everywhere
};

}  // namespace orrery
