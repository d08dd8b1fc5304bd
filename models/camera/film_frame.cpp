#include <orrery/models/camera/film_frame.hpp>

#include <algorithm>
#include <cmath>

namespace orrery {

namespace {

constexpr int kWidest = 256;
constexpr std::size_t kMostStars = 8;
constexpr Rgb kStarColour{90, 170, 255}, kTargetColour{255, 150, 40};

void dot_at(Image<Rgb>& out, double u, double v, const Rgb& colour) {
  const int i = static_cast<int>(std::lround(u)), k = static_cast<int>(std::lround(v));
  if (i >= 0 && k >= 0 && i < out.width_px && k < out.height_px) out.at(i, k) = colour;
}

void ring(Image<Rgb>& out, const Pixel& at, double radius, const Rgb& colour) {
  for (int k = 0; k < 48; ++k) {
    const double a = k * (6.283185307179586 / 48);
    dot_at(out, at.u + radius * std::cos(a), at.v + radius * std::sin(a), colour);
  }
}

void square(Image<Rgb>& out, const Pixel& at, double half, const Rgb& colour) {
  for (double s = -half; s <= half; s += 0.5) {
    dot_at(out, at.u + s, at.v - half, colour), dot_at(out, at.u + s, at.v + half, colour);
    dot_at(out, at.u - half, at.v + s, colour), dot_at(out, at.u + half, at.v + s, colour);
  }
}

Image<Rgb> stretched(const DigitalImage& image, int step) {
  std::vector<std::uint16_t> sorted = image.values;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double low = *middle,
               high = std::max<double>(low + 1, *std::max_element(middle, sorted.end()));
  Image<Rgb> out((image.width_px + step - 1) / step, (image.height_px + step - 1) / step);
  for (int v = 0; v < image.height_px; ++v) {
    for (int u = 0; u < image.width_px; ++u) {
      const double part = std::clamp((image.at(u, v) - low) / (high - low), 0.0, 1.0);
      Rgb& to = out.at(u / step, v / step);
      // 254 greys and the two colours of the truth: a palette holds them.
      const auto level = std::lround(253 * std::sqrt(part));
      const auto grey = static_cast<std::uint8_t>((level * 255 + 126) / 253);
      if (grey > to[0]) to = {grey, grey, grey};
    }
  }
  return out;
}

}  // namespace

Image<Rgb> film_frame(const CameraFrame& frame) {
  const int step = (frame.image.width_px + kWidest - 1) / kWidest;
  Image<Rgb> out = stretched(frame.image, step);
  const auto reduced = [step](const Pixel& p) {
    return Pixel{(p.u + 0.5) / step - 0.5, (p.v + 0.5) / step - 0.5};
  };
  for (std::size_t k = 0; k < std::min(kMostStars, frame.stars.size()); ++k) {
    ring(out, reduced(frame.stars[k].at), 5, kStarColour);
  }
  for (const auto& target : frame.targets) {
    if (!target || !std::isfinite(target->size_px)) continue;
    square(out, reduced(target->origin), std::min(300.0, 5 + 0.5 * target->size_px / step),
           kTargetColour);
  }
  return out;
}

}  // namespace orrery
