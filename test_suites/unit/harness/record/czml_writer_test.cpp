#include <orrery/harness/record/czml_writer.hpp>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>

#include "scratch_folder.hpp"

namespace orrery {
namespace {

constexpr double kRadius_m = 6928137, kRate_radps = 1.0948e-3;

struct CzmlWriterTest : testing::Test {
  ScratchFolder scratch;
  const SimTime epoch = gps_midnight(2025, 3, 20) + 18s;  // 00:00:00 UTC
  CzmlWriter writer{scratch / "formation.czml", "A <test>", epoch, 18s};

  static CzmlWriter::Components r(double t_s) {
    return {kRadius_m * std::cos(kRate_radps * t_s), kRadius_m * std::sin(kRate_radps * t_s), 0};
  }
  static CzmlWriter::Components v(double t_s) {
    const auto p = r(t_s);
    return {-kRate_radps * p[1], kRate_radps * p[0], 0};
  }
};

// Packets of one id add up, as the CZML Guide says: what a viewer has of an object in the end.
std::vector<double> samples_of(const nlohmann::json& czml, const std::string& id) {
  std::vector<double> all;
  for (const auto& packet : czml) {
    if (packet["id"] != id || !packet.contains("position")) continue;
    EXPECT_EQ(packet["position"]["referenceFrame"], "INERTIAL");
    EXPECT_EQ(packet["position"]["epoch"], "2025-03-20T00:00:00.000000000Z");
    for (const auto& value : packet["position"]["cartesianVelocity"]) all.push_back(value);
  }
  return all;
}

TEST_F(CzmlWriterTest, HoldsAllStatesInOrder) {
  for (int i = 0; i < 1200; ++i) {
    writer.state("chief", epoch + i * 30s, r(30.0 * i), v(30.0 * i));
    if (i % 2 == 0) writer.state("deputy", epoch + i * 30s, {1, 2, 3}, {4, 5, 6});
  }
  writer.close(epoch + 10h);
  const auto czml = nlohmann::json::parse(content_of(scratch / "formation.czml"));
  ASSERT_EQ(czml[0]["id"], "document");
  EXPECT_EQ(czml[0]["name"], "A <test>");
  EXPECT_EQ(czml[0]["version"], "1.0");
  EXPECT_EQ(czml[0]["clock"]["interval"],
            "2025-03-20T00:00:00.000000000Z/2025-03-20T10:00:00.000000000Z");
  const auto chief = samples_of(czml, "chief");
  ASSERT_EQ(chief.size(), 7u * 1200);
  for (std::size_t i = 0; i < 1200; ++i) {
    EXPECT_EQ(chief[7 * i], 30.0 * static_cast<double>(i));
    const auto expected = r(chief[7 * i]);
    EXPECT_NEAR(chief[7 * i + 2], expected[1], 0.0005 + 1e-9) << "three decimals";
  }
  EXPECT_EQ(samples_of(czml, "deputy").size(), 7u * 600);
  EXPECT_EQ(czml.back()["availability"],
            "2025-03-20T00:00:00.000000000Z/2025-03-20T10:00:00.000000000Z");
}

TEST_F(CzmlWriterTest, AnEmptyRunIsValid) {
  writer.close(epoch);
  EXPECT_EQ(nlohmann::json::parse(content_of(scratch / "formation.czml")).size(), 1u);
}

TEST_F(CzmlWriterTest, RefusesWhatIsNotFinite) {
  EXPECT_THROW(writer.state("a", epoch, {std::numeric_limits<double>::infinity(), 0, 0}, {}),
               std::invalid_argument);
}

}  // namespace
}  // namespace orrery
