// How often a spacecraft enters the Earth's shadow in a day: orrery::reference in a plain program.
#include <orrery/models/reference/reference_propagator.hpp>

#include <cstdio>

int main() {
  using namespace orrery;
  // 6978 km: 14.9 revolutions a day, from the subsolar side of an equinox orbit over the poles.
  const OrbitState initial{gps_midnight(2025, 3, 20), {6978e3, 0, 0}, {0, 0, 7558}, 100};
  ReferencePropagator orbit({{initial}}, std::make_shared<const EarthEnvironment>());
  int eclipses = 0;
  for (const OrbitEvent& event : orbit.advance_to(initial.t + 24h, {umbra()}))
    eclipses += event.begins ? 1 : 0;
  std::printf("%d eclipses\n", eclipses);
}
