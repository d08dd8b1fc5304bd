#include <orrery/harness/flight/crash_report.hpp>

#include <csignal>
#include <cstdio>
#include <cstring>

namespace orrery {
namespace {

std::string in_hex(std::uintptr_t value) {
  char text[32];
  std::snprintf(text, sizeof text, "0x%zx", static_cast<std::size_t>(value));
  return text;
}

std::string frame_line(std::size_t number, const StackFrame& frame) {
  std::string line = "    #" + std::to_string(number) + " " + in_hex(frame.address);
  if (!frame.function.empty()) line += " " + frame.function;
  if (!frame.object.empty()) line += " (" + frame.object + "+" + in_hex(frame.offset) + ")";
  return line + "\n";
}

std::string first_bytes(const ByteBuffer& bytes) {
  constexpr std::size_t kMost = 64;
  std::string text;
  for (std::size_t i = 0; i < bytes.size() && i < kMost; ++i) {
    char hex[4];
    std::snprintf(hex, sizeof hex, "%02x ", static_cast<unsigned>(bytes[i]));
    text += hex;
  }
  return bytes.size() > kMost ? text + "..." : text;
}

// Nothing if there are no frames.
std::string stack_text(const std::string& title, const std::vector<StackFrame>& frames) {
  if (frames.empty()) return "";
  std::string text = "  " + title + ", innermost first:\n";
  for (std::size_t i = 0; i < frames.size(); ++i) text += frame_line(i, frames[i]);
  return text;
}

}  // namespace

const char* to_string(CrashKind kind) {
  switch (kind) {
    case CrashKind::kSignal:
      return "signal";
    case CrashKind::kAbort:
      return "abort";
    case CrashKind::kException:
      return "uncaught exception";
    case CrashKind::kExit:
      return "exit";
    case CrashKind::kTargetLost:
      return "lost target";
    case CrashKind::kFatalStatus:
      return "status ORRERY_FATAL";
    case CrashKind::kUnknownStatus:
      return "unknown status";
    case CrashKind::kBootFailure:
      return "boot failure";
    case CrashKind::kHeapFault:
      return "heap fault";
    case CrashKind::kHeapExhausted:
      return "heap exhausted";
    case CrashKind::kNoProgress:
      return "no progress";
    case CrashKind::kStackOverflow:
      return "stack overflow";
    case CrashKind::kWorkBudget:
      return "work budget exceeded";
    case CrashKind::kForbiddenCall:
      return "forbidden call";
    case CrashKind::kTimeout:
      return "timeout";
  }
  return "unknown crash";
}

std::string to_string(const std::vector<StackFrame>& frames) {
  std::string text;
  for (std::size_t i = 0; i < frames.size(); ++i) text += frame_line(i, frames[i]);
  return text;
}

std::string to_string(const CrashReport& report) {
  std::string text = report.spacecraft + "/" + report.process + " (" + report.library +
                     ") crashed in " + report.call;
  if (!report.port.empty()) text += " on port " + report.port;
  text +=
      " at " + to_string(report.t) + ": " + to_string(report.kind) + ": " + report.message + "\n";
  if (!report.input.empty()) {
    text += "  input, " + std::to_string(report.input.size()) +
            " bytes: " + first_bytes(report.input) + "\n";
  }
  if (report.work != 0) text += "  work: " + std::to_string(report.work) + " edges\n";
  return text + stack_text("stack", report.backtrace) +
         stack_text("the block was allocated at " + to_string(report.block_allocated) + " by",
                    report.block_allocated_by) +
         stack_text("and freed at " + to_string(report.block_freed) + " by", report.block_freed_by);
}

}  // namespace orrery
