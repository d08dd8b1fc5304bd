/// Cubics over fixed intervals of time, made when asked for and kept. Not installed.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/vector.hpp>

#include <array>
#include <cstdint>
#include <mutex>

namespace orrery {

/// The polynomial through values at s = -1, 0, 1, 2. Error for |s| there: h^4/24 max|f''''|, h the
/// step between the knots.
struct Cubic {
  double c0 = 0, c1 = 0, c2 = 0, c3 = 0;

  static Cubic through(double a, double b, double c, double d) {
    return {b, c - a / 3 - b / 2 - d / 6, (a + c) / 2 - b, (d - a) / 6 + (b - c) / 2};
  }
  double at(double s) const { return c0 + s * (c1 + s * (c2 + s * c3)); }
  double slope(double s) const { return c1 + s * (2 * c2 + s * 3 * c3); }
};

struct CubicVec3 {
  Cubic x, y, z;

  static CubicVec3 through(const std::array<Vec3, 4>& v) {
    return {Cubic::through(v[0].x, v[1].x, v[2].x, v[3].x),
            Cubic::through(v[0].y, v[1].y, v[2].y, v[3].y),
            Cubic::through(v[0].z, v[1].z, v[2].z, v[3].z)};
  }
  Vec3 at(double s) const { return {x.at(s), y.at(s), z.at(s)}; }
  Vec3 slope(double s) const { return {x.slope(s), y.slope(s), z.slope(s)}; }
};

/// Intervals of 3 h since the GPS epoch with knots an hour apart, the first and last at their ends:
/// a value depends on its instant alone, and not on what was asked before.
constexpr Duration kKnotSpacing = 1h;
constexpr double kKnotSpacing_s = 3600;
constexpr Duration kInterval = 3 * kKnotSpacing;

inline std::int64_t interval_index(SimTime t) {
  const std::int64_t ns = to_ns(t), width = to_ns(kInterval);
  return ns / width - (ns % width < 0 ? 1 : 0);
}
inline SimTime interval_begin(std::int64_t index) {
  return SimTime(index * kInterval);
}
/// Where `t` is among the knots of its interval: -1 at the first, 2 at the last.
inline double interval_place(std::int64_t index, SimTime t) {
  return 1e-9 * static_cast<double>((t - interval_begin(index)).count()) / kKnotSpacing_s - 1;
}

/// The last few intervals asked for, made by `make(index)`. Safe from several threads.
template <class Interval>
class IntervalCache {
 public:
  template <class Make, class Use>
  auto use(std::int64_t index, Make make, Use use_it) {
    Slot& slot = slots_[static_cast<std::size_t>(index & 3)];
    const std::lock_guard lock(mutex_);
    if (!slot.made || slot.index != index) slot = {index, true, make(index)};
    return use_it(slot.interval);
  }

 private:
  struct Slot {
    std::int64_t index = 0;
    bool made = false;
    Interval interval;
  };
  // Index mod 4: a few spacecraft at slightly different times do not displace one another.
  std::mutex mutex_;
  std::array<Slot, 4> slots_;
};

}  // namespace orrery
