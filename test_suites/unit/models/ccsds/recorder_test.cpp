// The recorder writes its OEMs line by line as states come (harness/record/oem_writer.hpp); the
// reader of this room must take them.
#include <orrery/harness/record/oem_writer.hpp>
#include <orrery/models/ccsds/oem_interpolation.hpp>

#include <gtest/gtest.h>

#include <cstdio>

namespace orrery {
namespace {

// 10 decimals of km and 13 of km/s: half a unit of the last, and rounding of 7000 km.
TEST(RecordedOemTest, SpacecraftMayStartFromIt) {
  const std::string path = testing::TempDir() + "orrery_recorded.oem";
  const SimTime start = gps_midnight(2025, 3, 20);
  const OemWriter::Components r{6928137.123456789, -1.0, 1e-9}, v{0.1, 7585.123456789, -1e-3};
  OemWriter writer(path, {.name = "chief", .id = ""}, start);
  writer.state(start, r, v);
  writer.break_segment(start + 10s, r, v, {0.2, 7585.0, 0.0});
  writer.state(start + 20s, r, v);
  writer.close();

  const Oem oem = load_oem(path);
  std::remove(path.c_str());
  ASSERT_EQ(oem.segments.size(), 2u);
  EXPECT_EQ(oem.segments[0].metadata.time_system, TimeSystem::kGPS);
  EXPECT_EQ(parse_oem(write_oem(oem), "written"), oem);
  const OrbitState first = state_at(oem, start);
  EXPECT_LT(norm(first.r_ECI - Vec3{r[0], r[1], r[2]}), 1e-7);
  EXPECT_LT(norm(first.v_ECI - Vec3{v[0], v[1], v[2]}), 1e-10);
  // After the impulse at 10 s, not before it.
  EXPECT_NEAR(state_at(oem, start + 10s).v_ECI.x, 0.2, 1e-10);
}

}  // namespace
}  // namespace orrery
