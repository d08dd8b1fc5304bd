#include <orrery/harness/record/csv_writer.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "scratch_folder.hpp"

namespace orrery {
namespace {

struct CsvWriterTest : testing::Test {
  ScratchFolder folder;
  std::filesystem::path path = folder / "table.csv";
};

TEST_F(CsvWriterTest, FileIsHeaderAndRowsWithLineFeeds) {
  CsvWriter csv(path, {"t_GPS_ns", "x_m", "received_GPS_ns", "fate"});
  csv.time(from_ns(1'426'464'000'000'000'001)).number(0.1).empty().text("blackout").end_row();
  csv.integer(std::int64_t{-5}).number(-2e-9).integer(std::uint64_t{7}).text("delivered").end_row();
  csv.close();
  EXPECT_EQ(content_of(path),
            "t_GPS_ns,x_m,received_GPS_ns,fate\n"
            "1426464000000000001,0.1,,blackout\n"
            "-5,-2e-09,7,delivered\n");
}

TEST_F(CsvWriterTest, AwkwardTextIsQuoted) {
  CsvWriter csv(path, {"text"});
  csv.text("a,b").end_row();
  csv.text("say \"no\"").end_row();
  csv.text("two\nlines").end_row();
  csv.close();
  EXPECT_EQ(content_of(path), "text\n\"a,b\"\n\"say \"\"no\"\"\"\n\"two\nlines\"\n");
}

TEST_F(CsvWriterTest, FixedNumbersFillSomeFieldsEach) {
  CsvWriter csv(path, {"x_m", "y_m", "n", "w"});
  csv.fixed({-6.9e6, 1.0 / 3}, 6).integer(std::int64_t{1}).fixed({0.7071067811865476}, 9).end_row();
  csv.fixed({std::numeric_limits<double>::quiet_NaN(), 2}, 1).number(0).fixed({1}, 0).end_row();
  EXPECT_THROW(csv.fixed({1, 2, 3, 4, 5}, 1), std::logic_error);
  csv.close();
  EXPECT_EQ(content_of(path), "x_m,y_m,n,w\n-6900000.000000,0.333333,1,0.707106781\nnan,2.0,0,1\n");
}

// In the order of the fields, whole however the text rounds.
TEST_F(CsvWriterTest, TheSinkGetsAllBitsOfTheValues) {
  std::string got;
  CsvWriter csv(path, {"x", "n", "what"});
  csv.give_values_to([&got](Bytes values) {
    got.append(reinterpret_cast<const char*>(values.data()), values.size());
  });
  csv.fixed({1.0 / 3}, 2).integer(std::uint64_t{7}).text("a,b").end_row();
  csv.number(-std::numeric_limits<double>::quiet_NaN()).integer(std::int64_t{-1}).empty().end_row();
  csv.close();
  const auto word = [](std::uint64_t value) {
    std::string bytes(8, '\0');
    for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<char>(value >> (8 * i));
    return bytes;
  };
  EXPECT_EQ(got, word(0x3FD5555555555555) + word(7) + word(3) + "a,b" + word(0x7ff8000000000000) +
                     word(~std::uint64_t{0}) + word(0));
}

TEST_F(CsvWriterTest, WhatWasWrittenIsThereWithoutClose) {
  { CsvWriter csv(path, {"a"}); }
  EXPECT_EQ(content_of(path), "a\n");
}

TEST_F(CsvWriterTest, LongFileIsComplete) {
  CsvWriter csv(path, {"i"});
  std::string expected = "i\n";
  for (std::int64_t i = 0; i < 100'000; ++i) {
    csv.integer(i).end_row();
    expected += std::to_string(i) + "\n";
  }
  csv.close();
  EXPECT_TRUE(content_of(path) == expected);
}

TEST_F(CsvWriterTest, RowOfAnotherLengthThanTheHeaderIsRefused) {
  CsvWriter csv(path, {"a", "b"});
  csv.number(1);
  EXPECT_THAT([&] { csv.end_row(); }, testing::ThrowsMessage<std::logic_error>(
                                          testing::HasSubstr("1 fields in a row of 2")));
  csv.number(2);
  EXPECT_THROW(csv.number(3), std::logic_error);
  csv.end_row();
  csv.number(4);
  EXPECT_THROW(csv.close(), std::logic_error);
}

TEST_F(CsvWriterTest, PathThatCannotBeWrittenIsNamed) {
  const std::filesystem::path nowhere = folder / "no_such_folder" / "table.csv";
  EXPECT_THAT(
      [&] { CsvWriter csv(nowhere, {"a"}); },
      testing::ThrowsMessage<std::runtime_error>(testing::AllOf(
          testing::HasSubstr(nowhere.string()), testing::HasSubstr("No such file or directory"))));
}

// /dev/full accepts being opened and refuses every byte.
TEST_F(CsvWriterTest, FullDiskIsReportedWithThePath) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  CsvWriter csv("/dev/full", {"a"});
  EXPECT_THAT([&] { csv.close(); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("/dev/full")));
}

TEST_F(CsvWriterTest, TableWithoutColumnsIsRefused) {
  EXPECT_THROW(CsvWriter(path, {}), std::invalid_argument);
}

TEST(OutputFileTest, OverwritingLeavesTheRestInPlace) {
  const ScratchFolder folder;
  OutputFile file(folder / "f");
  file.write("0123456789");
  file.overwrite(3, "abc");
  file.write("!");
  EXPECT_EQ(file.size(), 11u);
  EXPECT_THROW(file.overwrite(10, "xy"), std::out_of_range);
  file.close();
  EXPECT_EQ(content_of(file.path()), "012abc6789!");
  EXPECT_THROW(file.write("more"), std::logic_error);
}

TEST(OutputFileTest, BytesArriveAsTheyAre) {
  const ScratchFolder folder;
  OutputFile file(folder / "f");
  const ByteBuffer bytes{std::byte{0}, std::byte{'\n'}, std::byte{0xFF}, std::byte{'\r'}};
  file.write(bytes);
  file.close();
  EXPECT_EQ(content_of(file.path()), std::string("\0\n\xFF\r", 4));
}

}  // namespace
}  // namespace orrery
