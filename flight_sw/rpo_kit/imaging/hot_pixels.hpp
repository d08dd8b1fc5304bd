/// Pixels of the detector that are bright in the dark, learnt in flight.
///
/// Method      A pixel that stands out from all its eight neighbours by more than the optics allow
///             is no light; one that does so in three frames running is hot for good, and from then
///             on gets the mean of its neighbours that are not hot. Cosmic rays do so once.
/// Valid for   a PSF of 0.6 px (1 sigma) and more: of a point source the second brightest pixel
///             has at least a quarter of the brightest.
/// Memory      8 bytes a pixel that is hot, at most kMost.
/// Checked by  test_suites/unit/flight_sw/rpo_kit/frame_processor_test.cpp
#pragma once

#include <cstdint>
#include <vector>

#include "rpo_kit/imaging/detection.hpp"

namespace rpo_kit {

class HotPixels {
 public:
  static constexpr std::size_t kMost = 4096;

  /// Mends an image in place, of the same size as those before; then learns from it.
  void mend(std::uint16_t* pixels, int width, int height);
  /// Those that are mended.
  int known() const;

 private:
  struct Suspect {
    std::int32_t at;
    std::int16_t frames;  // running; kHot: for good
    bool seen;
  };

  bool is_hot(std::int32_t at) const;
  void mend_one(std::uint16_t* pixels, int width, int height, std::int32_t at) const;
  void suspect(std::int32_t at);

  std::vector<Suspect> suspects_;  // by place
};

}  // namespace rpo_kit
