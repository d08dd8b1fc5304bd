/// A text with one defect, and what must be said of it.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <stdexcept>
#include <string>

namespace orrery {

struct Defect {
  const char* name;
  std::string text;
  int line;
  const char* what;
};

inline void PrintTo(const Defect& defect, std::ostream* stream) {
  *stream << defect.name;
}

/// `text` with the first `old_part` replaced, which must be there.
inline std::string with(std::string text, const std::string& old_part,
                        const std::string& new_part) {
  const std::size_t at = text.find(old_part);
  EXPECT_NE(at, std::string::npos) << old_part;
  return at == std::string::npos ? text : text.replace(at, old_part.size(), new_part);
}

/// The number of the line in which `part` begins.
inline int line_of(const std::string& text, const std::string& part) {
  const std::string before = text.substr(0, text.find(part));
  return 1 + static_cast<int>(std::count(before.begin(), before.end(), '\n'));
}

/// `parse(text, source)` must throw std::invalid_argument naming source, line and `what`.
template <class Parse>
void expect_refused(Parse parse, const Defect& defect) {
  try {
    parse(defect.text, "made_up.txt");
    ADD_FAILURE() << defect.name << " was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("made_up.txt, line " +
                                                                std::to_string(defect.line) + ": "),
                                             testing::HasSubstr(defect.what)));
  }
}

}  // namespace orrery
