/// cv::projectPoints, apart from the tests so that its headers are parsed once.
#pragma once

#include <orrery/models/camera/pinhole_camera.hpp>

#include <vector>

namespace orrery {

/// Empty where the tests are built without OpenCV.
std::vector<Pixel> opencv_projection(const PinholeCamera& camera,
                                     const std::vector<Vec3>& points_C);

}  // namespace orrery
