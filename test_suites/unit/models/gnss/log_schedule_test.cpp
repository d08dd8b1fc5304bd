#include <orrery/models/gnss/log_schedule.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace orrery::novatel {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr SimTime kStart = from_ns(2358 * 604'800'000'000'000LL);  // start of a week

std::vector<std::uint16_t> ids(std::span<const DueLog> due) {
  std::vector<std::uint16_t> out;
  for (const DueLog& log : due) out.push_back(log.message_id);
  return out;
}

std::vector<int> seconds_due(LogSchedule& schedule, int count) {
  std::vector<int> out;
  for (int s = 0; s < count; ++s) {
    if (!schedule.due(kStart + std::chrono::seconds(s)).empty()) out.push_back(s);
  }
  return out;
}

TEST(LogScheduleTest, OnTimeIsDueAtMultiplesOfThePeriodInGpsTime) {
  LogSchedule schedule;
  schedule.log({.message_id = 43, .trigger = LogTrigger::kOnTime, .period = 10s});
  EXPECT_THAT(seconds_due(schedule, 35), ElementsAre(0, 10, 20, 30));
}

// The manual's example: ONTIME 7 0.5 is output at 0.5, 7.5, 14.5 s.
TEST(LogScheduleTest, OffsetShiftsThePeriod) {
  LogSchedule schedule;
  schedule.log({.message_id = 42, .trigger = LogTrigger::kOnTime, .period = 60s, .offset = 1s});
  EXPECT_THAT(seconds_due(schedule, 130), ElementsAre(1, 61, 121));
}

TEST(LogScheduleTest, OnceIsSentAtTheNextEpochAndForgotten) {
  LogSchedule schedule;
  schedule.log({.message_id = 37});
  EXPECT_THAT(seconds_due(schedule, 5), ElementsAre(0));
  EXPECT_EQ(schedule.size(), 0u);
}

TEST(LogScheduleTest, OnChangedIsSentWholeAndThenOnlyWhatChanged) {
  LogSchedule schedule;
  schedule.log({.message_id = 41, .trigger = LogTrigger::kOnChanged});
  EXPECT_THAT(schedule.due(kStart), ElementsAre(DueLog{41, false}));
  EXPECT_THAT(schedule.due(kStart + 1s), IsEmpty());
  schedule.note_change(41);
  schedule.note_change(8);
  EXPECT_THAT(schedule.due(kStart + 2s), ElementsAre(DueLog{41, true}));
  EXPECT_THAT(schedule.due(kStart + 3s), IsEmpty());
}

TEST(LogScheduleTest, ChangeBeforeTheFirstEpochIsPartOfTheFirst) {
  LogSchedule schedule;
  schedule.log({.message_id = 41, .trigger = LogTrigger::kOnChanged});
  schedule.note_change(41);
  EXPECT_THAT(schedule.due(kStart), ElementsAre(DueLog{41, false}));
  EXPECT_THAT(schedule.due(kStart + 1s), IsEmpty());
}

TEST(LogScheduleTest, LogsGoOutInTheOrderOfTheirRequests) {
  LogSchedule schedule;
  for (const std::uint16_t id : std::initializer_list<std::uint16_t>{241, 43, 41, 101}) {
    schedule.log({.message_id = id, .trigger = LogTrigger::kOnTime, .period = 1s});
  }
  EXPECT_THAT(ids(schedule.due(kStart)), ElementsAre(241, 43, 41, 101));
  // A new request for a message replaces the old one in its place.
  schedule.log({.message_id = 43, .trigger = LogTrigger::kOnTime, .period = 2s});
  EXPECT_THAT(ids(schedule.due(kStart + 1s)), ElementsAre(241, 41, 101));
  EXPECT_THAT(ids(schedule.due(kStart + 2s)), ElementsAre(241, 43, 41, 101));
}

TEST(LogScheduleTest, UnlogRemovesOneAndSaysWhetherItWasThere) {
  LogSchedule schedule;
  schedule.log({.message_id = 43, .trigger = LogTrigger::kOnTime, .period = 1s});
  EXPECT_FALSE(schedule.unlog(42));
  EXPECT_TRUE(schedule.unlog(43));
  EXPECT_THAT(schedule.due(kStart), IsEmpty());
}

TEST(LogScheduleTest, HeldLogsOutliveUnlogAllUnlessTheyAreMeant) {
  LogSchedule schedule;
  schedule.log({.message_id = 43, .trigger = LogTrigger::kOnTime, .period = 1s, .hold = true});
  schedule.log({.message_id = 42, .trigger = LogTrigger::kOnTime, .period = 1s});
  schedule.unlog_all();
  EXPECT_THAT(ids(schedule.due(kStart)), ElementsAre(43));
  schedule.unlog_all(true);
  EXPECT_THAT(schedule.due(kStart), IsEmpty());
}

TEST(LogScheduleTest, ThirtyLogsAreAllThereIsRoomFor) {
  LogSchedule schedule;
  for (std::uint16_t id = 0; id < 30; ++id) EXPECT_TRUE(schedule.log({.message_id = id}));
  EXPECT_FALSE(schedule.log({.message_id = 30}));
  EXPECT_TRUE(schedule.log({.message_id = 29}));  // replaces
  EXPECT_EQ(schedule.due(kStart).size(), 30u);
}

TEST(LogScheduleTest, PeriodAndOffsetOutOfRangeAreNamed) {
  LogSchedule schedule;
  const auto expect_refused = [&](Duration period, Duration offset, const char* text) {
    EXPECT_THAT(
        [&] {
          schedule.log({.message_id = 43,
                        .trigger = LogTrigger::kOnTime,
                        .period = period,
                        .offset = offset});
        },
        testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text)));
  };
  expect_refused(0s, 0s, "period = 0 s of an ONTIME log; accepted: above 0");
  expect_refused(-1s, 0s, "period = -1 s");
  expect_refused(1s, 1s, "offset = 1 s; accepted: 0 to below the period, 1 s");
  expect_refused(1s, -1ns, "offset = -1 ns");
  EXPECT_EQ(schedule.size(), 0u);
}

}  // namespace
}  // namespace orrery::novatel
