// orrery-compare A B: where two output folders part. Exit code 0: equal, 1: different, 2: trouble.
#include <orrery/harness/record/folder_comparison.hpp>

#include <cstdio>
#include <exception>
#include <string_view>
#include <vector>

namespace {

constexpr const char* kUsage =
    "usage: orrery-compare A B\n\n"
    "Compares two folders that --orrery_out has written, of one run or of many, and shows the "
    "first\n"
    "difference in words. Host times and manifest.json are ignored: equal runs differ in them.\n"
    "Exit code: 0 equal, 1 different, 2 something could not be read.\n";

int compare(const char* a, const char* b) {
  const std::vector<orrery::FileDifference> differences = orrery::compare_folders(a, b);
  if (differences.empty()) {
    std::printf("equal\n");
    return 0;
  }
  std::printf("%s: %s\n", differences.front().file.c_str(), differences.front().text.c_str());
  for (std::size_t i = 1; i < differences.size(); ++i) {
    std::printf("%s %s", i == 1 ? "also differ:" : ",", differences[i].file.c_str());
  }
  if (differences.size() > 1) std::printf("\n");
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") {
    std::fputs(kUsage, stdout);
    return 0;
  }
  if (argc != 3) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  try {
    return compare(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "orrery-compare: %s\n", error.what());
    return 2;
  }
}
