// A page in headless Chromium, and what it says of itself with #selftest.
#pragma once

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>
#include <string>

namespace orrery {

inline std::string output_of(const std::string& command, int& status) {
  std::string text;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return text;
  char part[4096];
  for (std::size_t n; (n = fread(part, 1, sizeof part, pipe)) > 0;) text.append(part, n);
  status = pclose(pipe);
  return text;
}

inline bool has_chromium() {
  int status = 0;
  return !output_of("command -v chromium 2>/dev/null", status).empty();
}

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

/// What the page says of its own drawing; empty, with a failure, if it says nothing.
inline nlohmann::json measured(const std::filesystem::path& page,
                               const std::filesystem::path& profile) {
  const std::string command =
      "timeout 100 chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
      "--disable-background-networking --disable-component-update --disable-sync "
      "--user-data-dir='" +
      profile.string() +
      "' --window-size=1280,900 "
      "--virtual-time-budget=3000 --dump-dom 'file://" +
      page.string() + "#selftest' 2>/dev/null";
  int status = 0;
  const std::string dom = output_of(command, status);
  const std::string begin = "<pre id=\"selftest\">";
  const std::size_t at = dom.find(begin);
  EXPECT_NE(at, std::string::npos) << "chromium ended with status " << status << " and printed\n"
                                   << dom.substr(0, 2000);
  if (at == std::string::npos) return {};
  const std::size_t end = dom.find("</pre>", at);
  const std::string text = dom.substr(at + begin.size(), end - at - begin.size());
  return nlohmann::json::parse(
      replaced(replaced(replaced(text, "&lt;", "<"), "&gt;", ">"), "&amp;", "&"));
}

}  // namespace orrery
