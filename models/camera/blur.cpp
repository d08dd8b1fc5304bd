#include <orrery/models/camera/blur.hpp>
#include <orrery/models/camera/parallel_rows.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace orrery {

namespace {

std::vector<float> kernel(double sigma) {
  const int half = static_cast<int>(std::ceil(4 * sigma));
  const double scale = 1 / (sigma * std::sqrt(2.0));
  std::vector<double> parts;
  double sum = 0;
  for (int k = -half; k <= half; ++k) {
    parts.push_back(std::erf((k + 0.5) * scale) - std::erf((k - 0.5) * scale));
    sum += parts.back();
  }
  std::vector<float> normalised;
  for (const double part : parts) normalised.push_back(static_cast<float>(part / sum));
  return normalised;
}

struct Tap {
  const float* in = nullptr;
  float part = 0;
};

// out = the sum of part * in over the taps, in blocks that stay in registers.
void weighted_sum(float* out, const std::vector<Tap>& taps, int count) {
  constexpr int kBlock = 16;
  int u = 0;
  for (; u + kBlock <= count; u += kBlock) {
    float sums[kBlock] = {};
    for (const Tap& tap : taps) {
      const float* in = tap.in + u;
      for (int i = 0; i < kBlock; ++i) sums[i] += tap.part * in[i];
    }
    std::copy_n(sums, kBlock, out + u);
  }
  for (; u < count; ++u) {
    float sum = 0;
    for (const Tap& tap : taps) sum += tap.part * tap.in[u];
    out[u] = sum;
  }
}

}  // namespace

void blur(Image<float>& image, double sigma_px, int threads) {
  const std::vector<float> parts = kernel(sigma_px);
  const int half = static_cast<int>(parts.size()) / 2, width = image.width_px;
  Image<float> across(image.width_px, image.height_px);
  std::vector<char> is_dark(static_cast<std::size_t>(image.height_px));  // rows, which add nothing
  for_bands_of_rows(threads, image.height_px, [&](int first, int end) {
    std::vector<float> padded(static_cast<std::size_t>(width + 2 * half));
    std::vector<Tap> taps;
    for (int k = 0; k <= 2 * half; ++k) {
      taps.push_back({padded.data() + k, parts[static_cast<std::size_t>(k)]});
    }
    for (int v = first; v < end; ++v) {
      const float* row = image.row(v);
      if (std::all_of(row, row + width, [](float value) { return value == 0; })) {
        is_dark[static_cast<std::size_t>(v)] = 1;
        continue;
      }
      std::fill_n(padded.begin(), half, row[0]);
      std::copy_n(row, width, padded.begin() + half);
      std::fill_n(padded.end() - half, half, row[width - 1]);
      weighted_sum(across.row(v), taps, width);
    }
  });
  for_bands_of_rows(threads, image.height_px, [&](int first, int end) {
    std::vector<Tap> taps;
    for (int v = first; v < end; ++v) {
      taps.clear();
      for (int k = -half; k <= half; ++k) {
        const int from = std::clamp(v + k, 0, image.height_px - 1);
        if (is_dark[static_cast<std::size_t>(from)]) continue;
        taps.push_back({across.row(from), parts[static_cast<std::size_t>(k + half)]});
      }
      weighted_sum(image.row(v), taps, width);
    }
  });
}

}  // namespace orrery
