#include <orrery/harness/kernel/text.hpp>
#include <orrery/harness/remote/pace.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <stdexcept>
#include <string>
#include <time.h>

namespace orrery {
namespace {

std::int64_t host_now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

void sleep_until(std::int64_t host_ns) {
  const timespec until{.tv_sec = host_ns / 1'000'000'000, .tv_nsec = host_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) continue;
}

}  // namespace

Pace::Pace(const PaceSetting& setting) : setting_(setting) {
  if (!(setting.rate >= 0 && std::isfinite(setting.rate))) {
    throw std::invalid_argument("Pace: rate = " + to_text(setting.rate) +
                                "; it is 0 (none) or more, and finite");
  }
  if (setting.deadline < Duration{0}) {
    throw std::invalid_argument("Pace: deadline = " + to_string(setting.deadline) +
                                "; it is 0 or more");
  }
}

Duration Pace::wait_for(SimTime t) {
  if (begin_host_ns_ < 0) {
    begin_host_ns_ = host_now_ns();
    begin_ = t;
  }
  const double since_begin_ns = static_cast<double>((t - begin_).count()) / setting_.rate;
  const std::int64_t due_ns = begin_host_ns_ + static_cast<std::int64_t>(since_begin_ns);
  if (due_ns > host_now_ns()) sleep_until(due_ns);
  const Duration late{std::max<std::int64_t>(0, host_now_ns() - due_ns)};
  ++figures_.events;
  sum_ += late;
  figures_.most_lateness = std::max(figures_.most_lateness, late);
  if (missed(late)) ++figures_.missed;
  return late;
}

PaceFigures Pace::figures() const {
  PaceFigures figures = figures_;
  if (figures.events > 0) {
    figures.mean_lateness = sum_ / static_cast<std::int64_t>(figures.events);
  }
  return figures;
}

std::string to_string(const Pace& pace) {
  const PaceFigures f = pace.figures();
  return to_text(pace.setting().rate) + " x real time: " + std::to_string(f.events) + " events, " +
         to_string(f.mean_lateness) + " late on average, " + to_string(f.most_lateness) +
         " at most; " + std::to_string(f.missed) + " missed " + to_string(pace.setting().deadline);
}

}  // namespace orrery
