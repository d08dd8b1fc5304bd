#include <orrery/harness/record/folder_comparison.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <sys/wait.h>

#include "scratch_folder.hpp"

namespace orrery {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;

const std::string kTruth =
    "t_GPS_ns,r_ECI_m_x,r_ECI_m_y\n1000000000,1,2\n3000000000,3,4\n6000000000,5,6\n";

struct FolderComparisonTest : testing::Test {
  FolderComparisonTest() {
    for (const char* side : {"a", "b"}) {
      write(side, "truth/dsc.csv", kTruth);
      write(side, "truth/osc.csv", kTruth);
      write(side, "summary.json", "{\n  \"seed\": 1,\n  \"wall_s\": 1.5\n}\n");
      write(side, "gnss/dsc.nov", std::string("\xaa\x44\x12\0\1", 5));
    }
  }
  void write(const std::string& side, const std::string& file, const std::string& content) {
    const fs::path path = root / side / file;
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << content;
  }
  std::vector<FileDifference> compare() { return compare_folders(root / "a", root / "b"); }
  std::string first() {
    const std::vector<FileDifference> all = compare();
    return all.empty() ? "equal" : all.front().file + ": " + all.front().text;
  }
  ScratchFolder root;
};

TEST_F(FolderComparisonTest, EqualFoldersHaveNoDifference) {
  EXPECT_THAT(compare(), IsEmpty());
}

TEST_F(FolderComparisonTest, WhatEqualRunsMayWriteOtherwiseIsIgnored) {
  write("b", "summary.json", "{\n  \"seed\": 1,\n  \"wall_s\": 99\n}\n");
  write("b", "manifest.json", "{}\n");
  EXPECT_EQ(first(), "equal");
  write("b", "summary.json", "{\n  \"seed\": 2,\n  \"wall_s\": 99\n}\n");
  EXPECT_EQ(first(), "summary.json: line 2: \"  \"seed\": 1,\" and \"  \"seed\": 2,\"");
}

TEST_F(FolderComparisonTest, ATableNamesColumnRowAndTime) {
  write("b", "truth/dsc.csv", "t_GPS_ns,r_ECI_m_x,r_ECI_m_y\n1000000000,1,2\n3000000000,3,4.5\n");
  EXPECT_EQ(first(), "truth/dsc.csv: r_ECI_m_y is \"4\" and \"4.5\" in row 2, 2 s after the first");
}

TEST_F(FolderComparisonTest, TheEarliestDifferenceComesFirstWhateverItsFile) {
  write("b", "truth/dsc.csv", kTruth + "9000000000,7,8\n");
  write("b", "truth/osc.csv", "t_GPS_ns,r_ECI_m_x,r_ECI_m_y\n1000000000,0,2\n");
  write("b", "gnss/dsc.nov", std::string("\xaa\x44\x13\0\1", 5));
  EXPECT_THAT(compare(), ElementsAre(Field(&FileDifference::file, "truth/osc.csv"),
                                     Field(&FileDifference::file, "truth/dsc.csv"),
                                     Field(&FileDifference::file, "gnss/dsc.nov")));
  EXPECT_EQ(compare()[1].text,
            "the end of the file and \"9000000000,7,8\" in row 4, 8 s after the first");
  EXPECT_EQ(compare()[2].text, "byte 2 differs (5 and 5 bytes)");
}

TEST_F(FolderComparisonTest, OtherColumnsAndOtherFilesAreSaid) {
  write("b", "truth/dsc.csv", "t_GPS_ns,r_ECI_m_z\n1000000000,1\n");
  write("a", "links/dsc-osc.csv", "sent_GPS_ns\n");
  EXPECT_THAT(first(), testing::HasSubstr("links/dsc-osc.csv: is only in "));
  EXPECT_EQ(compare()[1].text,
            "the columns are \"t_GPS_ns,r_ECI_m_x,r_ECI_m_y\" and \"t_GPS_ns,r_ECI_m_z\"");
}

TEST_F(FolderComparisonTest, AMissingFolderIsNamed) {
  EXPECT_THAT([&] { compare_folders(root / "a", root / "c"); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::HasSubstr("c is not a folder that can be read")));
}

int exit_code(const std::string& arguments) {
  const int status = std::system((ORRERY_COMPARE " " + arguments + " > /dev/null 2>&1").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST_F(FolderComparisonTest, TheProgramSaysSoByItsExitCode) {
  const std::string a = (root / "a").string(), b = (root / "b").string();
  EXPECT_EQ(exit_code(a + " " + b), 0);
  write("b", "truth/dsc.csv", "t_GPS_ns\n");
  EXPECT_EQ(exit_code(a + " " + b), 1);
  EXPECT_EQ(exit_code(a + " " + (root / "c").string()), 2);
  EXPECT_EQ(exit_code(a), 2);
  EXPECT_EQ(exit_code("--help"), 0);
}

}  // namespace
}  // namespace orrery
