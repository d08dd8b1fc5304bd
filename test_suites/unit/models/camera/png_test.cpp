#include <orrery/models/camera/png.hpp>

#include <gtest/gtest.h>

#include <cstring>
#include <png.h>
#include <vector>

namespace orrery {
namespace {

struct Decoded {
  int width = 0, height = 0, depth = 0, colour = 0;
  std::vector<std::vector<unsigned char>> rows;
};

// By libpng, which checks every checksum.
Decoded decoded(const ByteBuffer& file, int transforms = PNG_TRANSFORM_IDENTITY) {
  struct Source {
    const std::byte* at;
  } source{file.data()};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_read_fn(png, &source, [](png_structp p, png_bytep out, png_size_t count) {
    auto* from = static_cast<Source*>(png_get_io_ptr(p));
    std::memcpy(out, from->at, count);
    from->at += count;
  });
  png_read_png(png, info, transforms, nullptr);
  Decoded out{int(png_get_image_width(png, info)),
              int(png_get_image_height(png, info)),
              png_get_bit_depth(png, info),
              png_get_color_type(png, info),
              {}};
  const png_bytepp rows = png_get_rows(png, info);
  for (int v = 0; v < out.height; ++v) {
    out.rows.emplace_back(rows[v], rows[v] + png_get_rowbytes(png, info));
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return out;
}

// More than 65535 bytes: several stored blocks.
TEST(PngTest, SixteenBitGreyIsLossless) {
  DigitalImage image(300, 200);
  for (std::size_t k = 0; k < image.values.size(); ++k) {
    image.values[k] = std::uint16_t((k * 7919) % 4096);
  }
  const Decoded out = decoded(to_png(image, 12));
  ASSERT_EQ(out.width, 300);
  ASSERT_EQ(out.height, 200);
  EXPECT_EQ(out.depth, 16);
  EXPECT_EQ(out.colour, PNG_COLOR_TYPE_GRAY);
  for (int v = 0; v < 200; ++v) {
    for (int u = 0; u < 300; ++u) {
      const auto& row = out.rows[std::size_t(v)];
      ASSERT_EQ((row[std::size_t(2 * u)] * 256 + row[std::size_t(2 * u + 1)]) >> 4, image.at(u, v));
    }
  }
}

TEST(PngTest, ColoursComeBackFromAPaletteAndWithout) {
  Image<Rgb> image(3, 2, {1, 2, 3});
  image.at(2, 1) = {250, 128, 7};
  const Decoded few = decoded(to_png(image), PNG_TRANSFORM_EXPAND);
  EXPECT_EQ(few.rows.at(1), (std::vector<unsigned char>{1, 2, 3, 1, 2, 3, 250, 128, 7}));
  EXPECT_EQ(decoded(to_png(image)).colour, PNG_COLOR_TYPE_PALETTE);
  for (const int different : {256, 257}) {
    Image<Rgb> row(different, 1);
    for (int u = 0; u < different; ++u) row.at(u, 0) = {std::uint8_t(u), std::uint8_t(u / 256), 9};
    EXPECT_EQ(decoded(to_png(row)).colour,
              different == 256 ? PNG_COLOR_TYPE_PALETTE : PNG_COLOR_TYPE_RGB);
    const Decoded out = decoded(to_png(row), PNG_TRANSFORM_EXPAND);
    for (int u = 0; u < different; ++u) {
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_EQ(out.rows.at(0).at(3 * std::size_t(u) + k), row.at(u, 0)[k]) << different << u;
      }
    }
  }
  EXPECT_THROW(to_png(Image<Rgb>()), std::invalid_argument);
  EXPECT_THROW(to_png(DigitalImage(2, 2), 17), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
