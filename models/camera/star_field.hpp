/// Stars and other points of light on the detector, to a hundredth of a pixel and better.
#pragma once

#include <orrery/models/camera/exposure.hpp>
#include <orrery/models/camera/optics.hpp>
#include <orrery/models/camera/star_catalogue.hpp>

#include <functional>

namespace orrery {

/// A point of light as seen from the camera, `line_of_sight + dt * rate` at dt [s] from the middle
/// of the exposure: any length, aberration included.
struct PointSource {
  Vec3 line_of_sight_ECI{};
  Vec3 rate_ECI_ps{};
  double electrons_ps = 0;
};

/// Where and how bright a point was drawn, at the middle of its row's exposure.
struct DrawnPoint {
  int number = 0;  // of the star
  Pixel at{};
  double electrons = 0;
};

/// Takes the light of one instant of a point.
using PointSink = std::function<void(const Pixel& at, double electrons)>;

/// Adds a point's light over an exposure.
///
/// Method      Its image is cut into instants so close that it moves by at most half a pixel from
/// one
///             to the next (at most 512), each a Gaussian integrated over the pixels (add_point).
///             Rolling shutter: each instant at the time of the row on which it falls, by two steps
///             of fixed-point iteration.
/// @return     Its place at the middle of the exposure; none where it is not in front.
std::optional<Pixel> add_source(ElectronImage& image, const PinholeCamera& camera,
                                const Optics& optics, const CameraPose& pose,
                                const ExposureTime& exposure, const PointSource& source);
/// The same into a sink, which may draw it otherwise.
std::optional<Pixel> trace_source(const PointSink& sink, const PinholeCamera& camera,
                                  const CameraPose& pose, const ExposureTime& exposure,
                                  const PointSource& source);

/// Draws the stars in the field: proper motion to the instant, aberration by the Earth's and the
/// spacecraft's velocity. Parallax (below 0.8") and light deflection (below 0.02" beyond 45 deg
/// from the Sun) are left out. Checked by  test_suites/unit/models/camera/star_field_test.cpp,
/// against OpenCV and closed forms.
class StarField {
 public:
  /// Whether a direction (unit vector) is covered by something near.
  using IsHidden = std::function<bool(const Vec3& direction_ECI)>;

  explicit StarField(StarCatalogue catalogue) : catalogue_(std::move(catalogue)) {}

  const StarCatalogue& catalogue() const { return catalogue_; }
  /// Adds all stars that reach the image. @return  those whose centre is in it.
  std::vector<DrawnPoint> draw(ElectronImage& image, const PinholeCamera& camera,
                               const Optics& optics, const CameraPose& pose,
                               const ExposureTime& exposure, const IsHidden& is_hidden = {}) const;
  std::vector<DrawnPoint> trace(const PointSink& sink, const PinholeCamera& camera,
                                const Optics& optics, const CameraPose& pose,
                                const ExposureTime& exposure, const IsHidden& is_hidden = {}) const;

 private:
  StarCatalogue catalogue_;
};

}  // namespace orrery
