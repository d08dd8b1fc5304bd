#include <orrery/harness/gtest/flags.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(FlagsTest, DefaultsHoldWhereNothingIsSaid) {
  const Flags f = parse_flags({"--gtest_filter=*"}, {"HOME=/"});
  EXPECT_EQ(f.seed, 1u);
  EXPECT_FALSE(f.runs.has_value());
  EXPECT_TRUE(f.out.empty());
  EXPECT_EQ(f.record.mode, RecordSetting::Mode::kPeriodic);
  EXPECT_FALSE(f.record.period.has_value());
  EXPECT_EQ(f.log.level, 4);
}

TEST(FlagsTest, TheCommandLineBeatsTheEnvironment) {
  EXPECT_EQ(parse_flags({}, {"ORRERY_SEED=7"}).seed, 7u);
  EXPECT_EQ(parse_flags({"--orrery_seed=9"}, {"ORRERY_SEED=7"}).seed, 9u);
}

TEST(FlagsTest, SeedsStayExactInADouble) {
  EXPECT_EQ(parse_flags({"--orrery_seed=9007199254740991"}, {}).seed, 9007199254740991u);
  EXPECT_THAT([] { parse_flags({"--orrery_seed=9007199254740992"}, {}); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("9007199254740992"), HasSubstr("0 to 9007199254740991"))));
}

TEST(FlagsTest, TimesTakeSecondsOrAUnit) {
  EXPECT_EQ(parse_flags({"--orrery_break_at=12.5"}, {}).break_at, 12500ms);
  EXPECT_EQ(parse_flags({"--orrery_break_at=12.5s"}, {}).break_at, 12500ms);
  EXPECT_EQ(parse_flags({"--orrery_record=500ms"}, {}).record.period, 500ms);
  EXPECT_EQ(parse_flags({"--orrery_record=off"}, {}).record.mode, RecordSetting::Mode::kOff);
  EXPECT_EQ(parse_flags({"--orrery_record=events"}, {}).record.mode, RecordSetting::Mode::kEvents);
}

TEST(FlagsTest, PaceTakesARateAndADeadline) {
  EXPECT_FALSE(parse_flags({}, {}).pace.has_value());
  EXPECT_EQ(parse_flags({"--orrery_pace=1"}, {}).pace->rate, 1);
  EXPECT_EQ(parse_flags({"--orrery_pace=1"}, {}).pace->deadline, 10ms);
  const Flags f = parse_flags({"--orrery_pace=0.5,20ms"}, {});
  EXPECT_EQ(f.pace->rate, 0.5);
  EXPECT_EQ(f.pace->deadline, 20ms);
  EXPECT_THAT([] { parse_flags({"--orrery_pace=1,soon"}, {}); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("--orrery_pace=soon"), HasSubstr("a time"))));
}

TEST(FlagsTest, LogTakesALevelAndASpacecraft) {
  const Flags f = parse_flags({"--orrery_log=warning,deputy"}, {});
  EXPECT_EQ(f.log.level, 2);
  EXPECT_EQ(f.log.spacecraft, "deputy");
}

TEST(FlagsTest, NonsenseIsNamed) {
  for (const char* flag :
       {"--orrery_seed=-1", "--orrery_seed=1x", "--orrery_seed=", "--orrery_runs=0",
        "--orrery_out=", "--orrery_record=0", "--orrery_record=nan", "--orrery_break_at=-3",
        "--orrery_break_at=1e300", "--orrery_log=loud", "--orrery_progress=maybe",
        "--orrery_pace=-1", "--orrery_pace=fast"}) {
    EXPECT_THAT([flag] { parse_flags({flag}, {}); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(flag)))
        << flag;
  }
  EXPECT_THAT([] { parse_flags({"--orrery_sed=1"}, {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("known are --orrery_break_at")));
  EXPECT_THAT([] { parse_flags({"--orrery_seed"}, {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("needs a value")));
  EXPECT_THAT([] { parse_flags({"--orrery_threads=2"}, {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("one thread")));
}

TEST(FlagsTest, TargetsNameProcessesAndTheWayThere) {
  const Flags f =
      parse_flags({"--orrery_target=dsc=qemu-arm", "--orrery_target=osc/gnc=tcp:h:5"}, {});
  ASSERT_EQ(f.targets.size(), 2u);
  EXPECT_EQ(f.targets[0].process, "dsc");
  EXPECT_EQ(to_string(f.targets[0].address), "qemu-arm");
  EXPECT_EQ(f.targets[1].process, "osc/gnc");
  EXPECT_EQ(to_string(f.targets[1].address), "tcp:h:5");
  const Flags e = parse_flags({}, {"ORRERY_TARGET=dsc=exec:a b=c; osc=unix:/x"});
  ASSERT_EQ(e.targets.size(), 2u);
  EXPECT_EQ(to_string(e.targets[0].address), "exec:a b=c");
  EXPECT_EQ(to_string(e.targets[1].address), "unix:/x");
  for (const char* wrong : {"--orrery_target=dsc", "--orrery_target==qemu-arm",
                            "--orrery_target=dsc=udp:h:5", "--orrery_target=dsc="}) {
    EXPECT_THROW(parse_flags({wrong}, {}), std::invalid_argument) << wrong;
  }
}

TEST(FlagsTest, ThoseOfCampaigns) {
  const Flags f = parse_flags({"--orrery_run=17", "--orrery_jobs=4", "--orrery_campaign=out",
                               "--orrery_set=deputy/mass_kg=11.5", "--orrery_set=a=b=-1e3"},
                              {});
  EXPECT_EQ(f.run, 17u);
  EXPECT_EQ(f.jobs, 4);
  EXPECT_EQ(f.campaign, "out");
  EXPECT_EQ(f.set.at("deputy/mass_kg"), 11.5);
  EXPECT_EQ(f.set.at("a=b"), -1000);
  for (const char* bad :
       {"--orrery_run=-1", "--orrery_jobs=0", "--orrery_set=x", "--orrery_set=x=1y"}) {
    EXPECT_THROW(parse_flags({bad}, {}), std::invalid_argument) << bad;
  }
}

}  // namespace
}  // namespace orrery
