/// JPEG files, by way of libturbojpeg where it is installed. Not installed.
#pragma once

#include <orrery/models/camera/image.hpp>

#include <string>

namespace orrery {

/// Luminance, 0 to 1, of a linear scale (sRGB undone, Rec. 709 weights).
/// @throws std::runtime_error  no library, no file, or no JPEG; says what to install.
Image<float> read_jpeg_luminance(const std::string& path);

}  // namespace orrery
