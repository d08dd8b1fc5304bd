/// The NovAtel logs of the reference data; tests are skipped where they are absent.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "../../../unit/models/gnss/novatel_reencode.hpp"

namespace orrery::novatel {

class NovatelLogs : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(ORRERY_REFERENCE_DATA) / "novatel";
    if (!std::filesystem::exists(folder_)) {
      GTEST_SKIP() << "no NovAtel logs in " << folder_ << " (ORRERY_REFERENCE_DATA)";
    }
  }
  std::string text(const std::string& file) const {
    std::ifstream stream(folder_ / file, std::ios::binary);
    EXPECT_TRUE(stream) << folder_ / file;
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  ByteBuffer binary(const std::string& file) const {
    const std::string content = text(file);
    const Bytes bytes = std::as_bytes(std::span(content));
    return {bytes.begin(), bytes.end()};
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace orrery::novatel
