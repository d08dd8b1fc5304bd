#include <orrery/models/camera/film_frame.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

namespace orrery {
namespace {

struct Marks {
  int count = 0, left = 1 << 20, right = -1;
  double u = 0, v = 0;
};

// Where pixels have a colour of that kind: their number, their mean, their extent.
template <class Colour>
Marks marks(const Image<Rgb>& picture, Colour is_it) {
  Marks out;
  for (int v = 0; v < picture.height_px; ++v) {
    for (int u = 0; u < picture.width_px; ++u) {
      if (!is_it(picture.at(u, v))) continue;
      ++out.count, out.u += u, out.v += v;
      out.left = std::min(out.left, u), out.right = std::max(out.right, u);
    }
  }
  out.u /= out.count, out.v /= out.count;
  return out;
}
bool is_blue(const Rgb& c) {
  return c[2] > c[0];
}
bool is_orange(const Rgb& c) {
  return c[0] > c[2];
}

// 1024 x 512 px, drawn at a quarter: pixel (4 i + 1.5, 4 k + 1.5) is the middle of pixel (i, k).
CameraFrame wide_frame() {
  CameraFrame frame;
  frame.image = DigitalImage(1024, 512, 100);
  return frame;
}

TEST(FilmFrameTest, RingsAndSquaresStandAroundTheTruth) {
  CameraFrame frame = wide_frame();
  frame.stars = {{.number = 1, .at = {4 * 200 + 1.5, 4 * 30 + 1.5}, .electrons = 1e4}};
  frame.targets = {SeenTarget{.origin = {4 * 60 + 1.5, 4 * 70 + 1.5}, .size_px = 80}, std::nullopt};
  const Image<Rgb> picture = film_frame(frame);
  ASSERT_EQ(picture.width_px, 256);
  ASSERT_EQ(picture.height_px, 128);
  const Marks star = marks(picture, is_blue), target = marks(picture, is_orange);
  EXPECT_GT(star.count, 20);
  EXPECT_NEAR(star.u, 200, 0.3);
  EXPECT_NEAR(star.v, 30, 0.3);
  EXPECT_EQ(star.right - star.left, 10);  // radius 5
  EXPECT_NEAR(target.u, 60, 1e-9);
  EXPECT_NEAR(target.v, 70, 1e-9);
  EXPECT_EQ(target.right - target.left, 30);  // 80/4 px of target and 5 on each side
}

TEST(FilmFrameTest, OneBrightPixelSurvivesTheReduction) {
  CameraFrame frame = wide_frame();
  frame.image.at(4 * 17 + 3, 4 * 9 + 2) = 4095;
  frame.image.at(4 * 50, 4 * 9) = 100 + (4095 - 100) / 4;
  const Image<Rgb> picture = film_frame(frame);
  EXPECT_EQ(picture.at(17, 9), (Rgb{255, 255, 255}));
  EXPECT_NEAR(picture.at(50, 9)[1], 127.4, 1);  // the square root
  EXPECT_EQ(picture.at(18, 9), (Rgb{0, 0, 0}));
}

// What a camera cannot show must not draw over the edge of memory, and is not drawn at all.
TEST(FilmFrameTest, TruthOutsideOfTheImageIsLeftOut) {
  CameraFrame frame = wide_frame();
  frame.stars = {{.number = 1, .at = {-500, 80}, .electrons = 1}};
  frame.targets = {SeenTarget{.origin = {1e9, -1e9}, .size_px = 4}};
  const Image<Rgb> picture = film_frame(frame);
  EXPECT_EQ(marks(picture, is_blue).count, 0);
  EXPECT_EQ(marks(picture, is_orange).count, 0);
}

}  // namespace
}  // namespace orrery
