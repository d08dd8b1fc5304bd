/// The lines of the accuracy table in models/README.md: measured here, written by ci/accuracy.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

namespace orrery {

struct Accuracy {
  std::string what;     // "orbit, RK4 on elements, 10 s, a day of 60x60 gravity"
  std::string against;  // "reference propagator"
  double accepted = 0;  // the largest error, or its largest size, that passes
  std::string unit;
};

/// Two digits: "0.42", "5", "1000".
inline std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value >= 99.5 && value < 1e6 ? "%.0f" : "%.2g", value);
  return text;
}

inline std::string models_readme() {
  std::ifstream file(ORRERY_MODELS_README);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The observed error must be at most the accepted one, and the page must have the line: its figure
/// may be of another day, but neither the line nor what it promises may be missing.
inline void expect_accuracy(const Accuracy& line, double observed) {
  EXPECT_LE(observed, line.accepted) << line.what << " [" << line.unit << "]";
  const std::string accepted = short_number(line.accepted) + " " + line.unit;
  testing::Test::RecordProperty(
      "accuracy: " + line.what,
      line.against + " | " + short_number(observed) + " " + line.unit + " | " + accepted);
  const std::string page = models_readme();
  const std::size_t at = page.find("\n| " + line.what + " | " + line.against + " |");
  if (at == page.npos)
    FAIL() << "models/README.md has no line for '" << line.what << "', '" << line.against
           << "': run ci/accuracy";
  const std::string row = page.substr(at + 1, page.find('\n', at + 1) - at - 1);
  EXPECT_NE(row.find("| " + accepted + " |"), row.npos)
      << "models/README.md promises something else than " << accepted << ": run ci/accuracy\n"
      << row;
}

}  // namespace orrery
