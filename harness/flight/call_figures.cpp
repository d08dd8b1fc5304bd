#include <orrery/harness/flight/call_figures.hpp>

#include <cstdio>

namespace orrery {

std::string to_string(const std::vector<CallFigures>& figures) {
  constexpr const char* kHead = "%-16s %12s %14s %14s %18s %18s %12s %12s\n";
  constexpr const char* kRow = "%-16s %12llu %14.3f %14.3f %18.3f %18.3f %12llu %12llu\n";
  char line[256];
  std::snprintf(line, sizeof line, kHead, "call", "calls", "host mean us", "host max us",
                "modelled mean us", "modelled max us", "work mean", "work max");
  std::string text = line;
  const auto us = [](Duration d) { return 1e6 * to_seconds(d); };
  for (const CallFigures& f : figures) {
    std::snprintf(line, sizeof line, kRow, f.call.c_str(), static_cast<unsigned long long>(f.calls),
                  us(f.host_mean), us(f.host_max), us(f.modelled_mean), us(f.modelled_max),
                  static_cast<unsigned long long>(f.work_mean),
                  static_cast<unsigned long long>(f.work_max));
    text += line;
  }
  return text;
}

}  // namespace orrery
