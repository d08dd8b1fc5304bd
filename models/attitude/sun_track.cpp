#include <orrery/models/attitude/sun_track.hpp>
#include <orrery/models/orbit/sun_moon.hpp>

namespace orrery {

SunDirection SunTrack::at(SimTime t) const {
  constexpr Duration kStep = 6h;
  const std::int64_t interval = to_ns(t) / to_ns(kStep);
  if (interval != interval_) {
    for (int i = 0; i < 4; ++i) {
      knots_[static_cast<std::size_t>(i)] =
          apparent_sun_direction_ECI(from_ns((interval + i - 1) * to_ns(kStep)));
    }
    interval_ = interval;
  }
  // Lagrange on -1, 0, 1, 2 in x = (t - begin)/step, as a polynomial in x.
  const auto& [a, b, c, d] = knots_;
  const Vec3 c1 = -1 / 3. * a - 0.5 * b + c - 1 / 6. * d;
  const Vec3 c2 = 0.5 * a - b + 0.5 * c;
  const Vec3 c3 = -1 / 6. * a + 0.5 * b - 0.5 * c + 1 / 6. * d;
  const double x = to_seconds(t - from_ns(interval * to_ns(kStep))) / to_seconds(kStep);
  return {b + x * (c1 + x * (c2 + x * c3)), (c1 + x * (2 * c2 + (3 * x) * c3)) / to_seconds(kStep)};
}

}  // namespace orrery
