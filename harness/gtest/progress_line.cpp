#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/progress_line.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <sys/ioctl.h>
#include <unistd.h>

namespace orrery {
namespace {

constexpr double kFirst_s = 0.5, kPeriod_s = 0.2;

// Whether a line stands on the terminal. One per process, as there is one standard error.
bool& is_shown() {
  static bool shown = false;
  return shown;
}

double host_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// "3:12:00"
std::string clock_text(double seconds) {
  const auto s = static_cast<std::int64_t>(seconds);
  char text[32];
  std::snprintf(text, sizeof text, "%lld:%02d:%02d", static_cast<long long>(s / 3600),
                static_cast<int>(s / 60 % 60), static_cast<int>(s % 60));
  return text;
}

std::size_t terminal_columns() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

}  // namespace

std::string progress_text(SimTime epoch, SimTime begin, SimTime now, SimTime end, double spent_s) {
  const double done_s = to_seconds(now - begin);
  const double speed = spent_s > 0 ? done_s / spent_s : 0;
  std::string text = clock_text(to_seconds(now - epoch)) + " of " +
                     clock_text(to_seconds(end - epoch)) + " simulated";
  if (!(speed > 0)) return text;
  const double left_s = to_seconds(end - now) / speed;
  char rest[64];
  std::snprintf(rest, sizeof rest, ", %.0f x real time, ", speed);
  text += rest;
  return text + (left_s < 60 ? std::to_string(std::lround(left_s)) + " s" : clock_text(left_s)) +
         " left";
}

ProgressLine::ProgressLine(SimTime epoch, SimTime begin, SimTime end)
    : epoch_(epoch), begin_(begin), end_(end) {
  wanted_ = !flags().progress.has_value() && isatty(STDERR_FILENO) == 1;
  if (!wanted_) return;
  started_s_ = host_seconds();
  next_s_ = started_s_ + kFirst_s;
}

ProgressLine::~ProgressLine() {
  if (wanted_) hide();
}

bool ProgressLine::time_has_come() {
  return host_seconds() >= next_s_;
}

void ProgressLine::show(SimTime now, const std::string& last_event) {
  const double host_s = host_seconds();
  next_s_ = host_s + kPeriod_s;
  std::string text =
      progress_text(epoch_, begin_, now, end_, host_s - started_s_) + ", last " + last_event;
  const std::size_t room = terminal_columns() - 1;
  if (text.size() > room) text.resize(room);
  std::fprintf(stderr, "\r%s\033[K", text.c_str());
  std::fflush(stderr);
  is_shown() = true;
}

void ProgressLine::hide() {
  if (!is_shown()) return;
  is_shown() = false;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
}

}  // namespace orrery
