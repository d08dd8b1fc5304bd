/// A frame as people look at it: small, with what was true drawn over it. Not installed.
#pragma once

#include <orrery/models/camera/camera.hpp>
#include <orrery/models/camera/png.hpp>

namespace orrery {

/// At most 256 px wide: the brightest of the pixels that fall together, square root of the
/// brightness between the image's median and its top; the eight brightest stars ringed, targets
/// squared.
Image<Rgb> film_frame(const CameraFrame& frame);

}  // namespace orrery
