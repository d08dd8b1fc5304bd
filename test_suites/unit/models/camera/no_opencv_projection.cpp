#include "opencv_projection.hpp"

namespace orrery {

std::vector<Pixel> opencv_projection(const PinholeCamera&, const std::vector<Vec3>&) {
  return {};
}

}  // namespace orrery
