// Compiled for AVX2, and called only where the processor has it.
#include <orrery/models/orbit/gravity_sums_body.hpp>

namespace orrery::gravity_sums {

void sum_avx2(const Series& series, Point& point) {
  sum_one<4>(series, point);
}

}  // namespace orrery::gravity_sums
