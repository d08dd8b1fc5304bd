// Two doubles: what every 64-bit processor has.
#include <orrery/models/orbit/gravity_sums_body.hpp>

namespace orrery::gravity_sums {

void sum_plain(const Series& series, Point& point) {
  sum_one<2>(series, point);
}

}  // namespace orrery::gravity_sums
