#include "rpo_kit/imaging/hot_pixels.hpp"

#include <algorithm>

namespace rpo_kit {
namespace {

constexpr std::int16_t kHot = 3;  // frames running
// Least height above the brightest neighbour, and that over the height above the darkest.
constexpr int kLeast_dn = 25;
constexpr double kSharp = 0.75;

}  // namespace

bool HotPixels::is_hot(std::int32_t at) const {
  const auto place = std::lower_bound(suspects_.begin(), suspects_.end(), at,
                                      [](const Suspect& s, std::int32_t p) { return s.at < p; });
  return place != suspects_.end() && place->at == at && place->frames >= kHot;
}

int HotPixels::known() const {
  return static_cast<int>(std::count_if(suspects_.begin(), suspects_.end(),
                                        [](const Suspect& s) { return s.frames >= kHot; }));
}

void HotPixels::mend_one(std::uint16_t* pixels, int width, int height, std::int32_t at) const {
  const int x0 = at % width, y0 = at / width;
  std::uint32_t sum = 0, count = 0;
  for (int y = std::max(y0 - 1, 0); y <= std::min(y0 + 1, height - 1); ++y) {
    for (int x = std::max(x0 - 1, 0); x <= std::min(x0 + 1, width - 1); ++x) {
      if (is_hot(y * width + x)) continue;
      sum += pixels[y * width + x];
      ++count;
    }
  }
  if (count > 0) pixels[at] = static_cast<std::uint16_t>((sum + count / 2) / count);
}

void HotPixels::suspect(std::int32_t at) {
  const auto place = std::lower_bound(suspects_.begin(), suspects_.end(), at,
                                      [](const Suspect& s, std::int32_t p) { return s.at < p; });
  if (place != suspects_.end() && place->at == at) {
    place->frames = std::min<std::int16_t>(kHot, static_cast<std::int16_t>(place->frames + 1));
    place->seen = true;
  } else if (suspects_.size() < kMost) {
    suspects_.insert(place, {at, 1, true});
  }
}

void HotPixels::mend(std::uint16_t* pixels, int width, int height) {
  for (Suspect& s : suspects_) {
    s.seen = s.frames >= kHot;
    if (s.seen) mend_one(pixels, width, height, s.at);
  }
  for (int y = 1; y + 1 < height; ++y) {
    for (int x = 1; x + 1 < width; ++x) {
      const std::uint16_t* p = pixels + y * width + x;
      const int value = *p;
      if (value < p[1] + kLeast_dn || value < p[-1] + kLeast_dn) continue;
      int most = 0, least = value;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0) continue;
          most = std::max<int>(most, p[dy * width + dx]);
          least = std::min<int>(least, p[dy * width + dx]);
        }
      }
      if (value < most + kLeast_dn || value - most < kSharp * (value - least)) continue;
      suspect(y * width + x);
    }
  }
  suspects_.erase(
      std::remove_if(suspects_.begin(), suspects_.end(), [](const Suspect& s) { return !s.seen; }),
      suspects_.end());
}

}  // namespace rpo_kit
