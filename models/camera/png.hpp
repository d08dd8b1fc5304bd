/// Images as PNG files.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/models/camera/image.hpp>

#include <array>

namespace orrery {

using Rgb = std::array<std::uint8_t, 3>;

/// 16-bit grey, lossless: numbers of `bits` bits are moved to the top, so that viewers show them,
/// and the chunk sBIT says how many count. Not compressed (deflate's stored blocks): 2 bytes per
/// pixel.
/// @throws std::invalid_argument  an image without pixels, or bits outside 1 to 16.
ByteBuffer to_png(const DigitalImage& image, int bits);
/// 8-bit colour: 1 byte per pixel up to 256 different colours (with a palette), 3 above.
/// @throws std::invalid_argument  an image without pixels.
ByteBuffer to_png(const Image<Rgb>& image);

}  // namespace orrery
