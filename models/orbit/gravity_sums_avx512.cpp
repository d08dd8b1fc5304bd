// Compiled for AVX-512, and called only where the processor has it. Its 32 registers hold the sums
// of two points.
#include <orrery/models/orbit/gravity_sums_body.hpp>

namespace orrery::gravity_sums {

void sum_avx512(const Series& series, Point& point) {
  sum_one<8>(series, point);
}

void sum_two_avx512(const Series& series, Point& first, Point& second) {
  sum_two<8>(series, first, second);
}

}  // namespace orrery::gravity_sums
