// No GoogleTest, no world: one model in a plain program.
#include <orrery/models/orbit/gravity.hpp>

#include <cstdio>

int main() {
  const orrery::HarmonicGravity gravity(orrery::GravityField::ggm05s(), 60);
  const orrery::Vec3 a = gravity.acceleration_ECEF({6928e3, 0, 0});
  std::printf("%.9e %.9e %.9e\n", a.x, a.y, a.z);
}
