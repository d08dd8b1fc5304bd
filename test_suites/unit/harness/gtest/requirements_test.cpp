#include <orrery/harness/gtest/requirements.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace orrery {
namespace {

namespace fs = std::filesystem;
using internal::RequirementRow;
using internal::update_requirements;
using testing::HasSubstr;
using testing::ThrowsMessage;

class RequirementsTest : public testing::Test {
 protected:
  RequirementsTest() {
    std::string pattern = (fs::temp_directory_path() / "orrery_requirements_XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~RequirementsTest() override { fs::remove_all(folder_); }

  std::string table() const {
    std::ifstream in(folder_ / "requirements.csv");
    return {std::istreambuf_iterator<char>(in), {}};
  }

  fs::path folder_;
};

TEST_F(RequirementsTest, ALaterResultReplacesItsOwnRowAlone) {
  update_requirements(folder_, {{"A-2", "T.b", "1", "failed"}, {"A-1", "T.b", "1", "failed"}});
  update_requirements(folder_, {{"A-1", "T.b", "1", "passed"}, {"A-1", "T.b", "2", "failed"}});
  EXPECT_EQ(table(),
            "requirement,test,seed,result\nA-1,T.b,1,passed\nA-1,T.b,2,failed\nA-2,T.b,1,failed\n");
}

// Eight programs, twenty results each, side by side: none is lost.
TEST_F(RequirementsTest, ProgramsThatRunSideBySideLoseNothing) {
  constexpr int kPrograms = 8, kResults = 20;
  std::vector<pid_t> programs;
  for (int p = 0; p < kPrograms; ++p) {
    const pid_t program = fork();
    if (program == 0) {
      for (int i = 0; i < kResults; ++i) {
        const std::string test = "T.p" + std::to_string(p) + "t" + std::to_string(i);
        update_requirements(folder_, {{"A-1", test, "1", "passed"}});
      }
      _exit(0);
    }
    ASSERT_GT(program, 0);
    programs.push_back(program);
  }
  for (const pid_t program : programs) {
    int status = -1;
    ASSERT_EQ(waitpid(program, &status, 0), program);
    EXPECT_EQ(status, 0);
  }
  std::istringstream lines(table());
  std::set<std::string> rows;
  for (std::string line; std::getline(lines, line);) rows.insert(line);
  EXPECT_EQ(rows.size(), 1u + kPrograms * kResults);  // with the header
  EXPECT_TRUE(rows.count("A-1,T.p7t19,1,passed"));
}

TEST_F(RequirementsTest, ATableThatIsNoneIsRefusedByItsLine) {
  std::ofstream(folder_ / "requirements.csv") << "requirement,test,seed,result\nA-1,T.b\n";
  EXPECT_THAT(
      [&] {
        update_requirements(folder_, {{"A-1", "T.b", "1", "passed"}});
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("requirements.csv:2: \"A-1,T.b\"")));
}

TEST_F(RequirementsTest, IdsHaveNoSpacesOrCommas) {
  for (const char* id : {"", "GNC 042", "GNC,042", "GNC\"042"}) {
    EXPECT_THAT([&] { TEST_REQUIREMENT(id); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("accepted: letters, digits and")));
  }
}

}  // namespace
}  // namespace orrery
