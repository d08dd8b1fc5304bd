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

// One tap at a time over a whole row: simple loops, that compilers make wide.
void add_row(float* out, const float* in, int count, float part) {
  for (int u = 0; u < count; ++u) out[u] += part * in[u];
}

}  // namespace

void blur(Image<float>& image, double sigma_px, int threads) {
  const std::vector<float> parts = kernel(sigma_px);
  const int half = static_cast<int>(parts.size()) / 2, width = image.width_px;
  Image<float> across(image.width_px, image.height_px);
  for_bands_of_rows(threads, image.height_px, [&](int first, int end) {
    std::vector<float> padded(static_cast<std::size_t>(width + 2 * half));
    for (int v = first; v < end; ++v) {
      std::fill_n(padded.begin(), half, image.at(0, v));
      std::copy_n(image.row(v), width, padded.begin() + half);
      std::fill_n(padded.end() - half, half, image.at(width - 1, v));
      for (int k = 0; k <= 2 * half; ++k) {
        add_row(across.row(v), padded.data() + k, width, parts[static_cast<std::size_t>(k)]);
      }
    }
  });
  for_bands_of_rows(threads, image.height_px, [&](int first, int end) {
    for (int v = first; v < end; ++v) {
      std::fill_n(image.row(v), width, 0.0f);
      for (int k = -half; k <= half; ++k) {
        const int from = std::clamp(v + k, 0, image.height_px - 1);
        add_row(image.row(v), across.row(from), width, parts[static_cast<std::size_t>(k + half)]);
      }
    }
  });
}

}  // namespace orrery
