#include "formation_keeping/configuration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace formation_keeping {

using namespace flight_support;

namespace {

using testing::HasSubstr;

struct ConfigurationTest : testing::Test {
  bool parse(const std::string& text) {
    char line[192] = "";
    const bool ok =
        parse_configuration(text.data(), text.size(), &configuration, line, sizeof line);
    message = line;
    return ok;
  }
  Configuration configuration;
  std::string message;
};

TEST_F(ConfigurationTest, NothingMeansDefaults) {
  ASSERT_TRUE(parse_configuration(nullptr, 0, &configuration, nullptr, 0));
  EXPECT_EQ(configuration.role, Role::kChief);
  EXPECT_EQ(configuration.crosslink_period_s, 10.0);
  EXPECT_EQ(configuration.navigation.earth_time.leap_seconds, 18);
}

TEST_F(ConfigurationTest, ReadsKeysCommentsAndBlankLines) {
  ASSERT_TRUE(
      parse("# deputy of the reference mission\n\n  role = deputy  # it manoeuvres\r\n"
            "leap_seconds=19\nburn_lead_s\t=\t90.5"))
      << message;
  EXPECT_EQ(configuration.role, Role::kDeputy);
  EXPECT_EQ(configuration.navigation.earth_time.leap_seconds, 19);
  EXPECT_EQ(configuration.control.burn_lead_s, 90.5);
}

TEST_F(ConfigurationTest, RefusesWhatItDoesNotUnderstandAndSaysWhere) {
  EXPECT_FALSE(parse("role=deputy\nburn_laed_s=60"));
  EXPECT_THAT(message, HasSubstr("line 2: 'burn_laed_s' is no key"));
  EXPECT_FALSE(parse("role=leader"));
  EXPECT_THAT(message, HasSubstr("'role' is not chief or deputy"));
  EXPECT_FALSE(parse("role"));
  EXPECT_THAT(message, HasSubstr("has no '='"));
  EXPECT_FALSE(parse("lag_s=3x"));
  EXPECT_THAT(message, HasSubstr("'lag_s' is not a number in [0, 600]: '3x'"));
  EXPECT_FALSE(parse("lag_s="));
  EXPECT_FALSE(parse("lag_s=nan"));
  EXPECT_FALSE(parse("burn_lead_s=10"));  // the thruster wants 20 s
  EXPECT_THAT(message, HasSubstr("[25, 600]"));
  EXPECT_FALSE(parse("leap_seconds=18.5"));
  EXPECT_FALSE(parse("lag_s=30\nlag_s=31"));
  EXPECT_THAT(message, HasSubstr("given twice"));
  EXPECT_FALSE(parse(std::string(200, 'x')));
}

}  // namespace
}  // namespace formation_keeping
