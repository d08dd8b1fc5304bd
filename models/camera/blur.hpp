/// The PSF over a whole image. Not installed.
#pragma once

#include <orrery/models/camera/image.hpp>

namespace orrery {

/// Convolution with a Gaussian integrated over each pixel, cut at 4 sigma; the image goes on beyond
/// its edges as at them.
void blur(Image<float>& image, double sigma_px, int threads = 1);

}  // namespace orrery
