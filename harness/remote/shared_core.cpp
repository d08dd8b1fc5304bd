#include <orrery/harness/remote/shared_core.hpp>

#include <algorithm>
#include <ctime>
#include <unistd.h>

namespace orrery {
namespace {

// 0: there is no such process.
std::int64_t processor_time_ns(clockid_t clock) {
  timespec t{};
  if (clock_gettime(clock, &t) != 0) return 0;
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

}  // namespace

std::shared_ptr<SharedCore> SharedCore::of_this_thread() {
  thread_local const auto shared = std::make_shared<SharedCore>();
  return shared;
}

SharedCore::SharedCore() : tid_(gettid()) {}

void SharedCore::hold() {
  const std::lock_guard lock(mutex_);
  if (children_.empty() && sched_getaffinity(0, sizeof home_, &home_) != 0) return;
  if (CPU_COUNT(&home_) < 2) return;
  stay();
  loose_ = false;
  for (const pid_t child : children_) sched_setaffinity(child, sizeof core_, &core_);
  next_ns_ = 0;
}

void SharedCore::join(pid_t child) {
  const std::lock_guard lock(mutex_);
  if (next_ns_ != INT64_MAX) children_.push_back(child);
  callees_.push_back(child);
  processor_ns_ = -1;
}

void SharedCore::leave(pid_t child) {
  const std::lock_guard lock(mutex_);
  std::erase(children_, child);
  std::erase(callees_, child);
  processor_ns_ = -1;
  if (children_.empty() && next_ns_ != INT64_MAX) let_go();
}

void SharedCore::choose(std::int64_t host_now_ns) {
  constexpr std::int64_t kPeriod_ns = 50'000'000;
  const std::lock_guard lock(mutex_);
  std::erase_if(children_, [this](pid_t child) {
    cpu_set_t now;
    return sched_getaffinity(child, sizeof now, &now) != 0 || !CPU_EQUAL(&now, &core_);
  });
  if (children_.empty()) {
    let_go();
    return;
  }
  if (!loose_) {
    sched_setaffinity(0, sizeof home_, &home_);
    loose_ = true;
    return;
  }
  loose_ = false;
  stay();
  for (const pid_t child : children_) sched_setaffinity(child, sizeof core_, &core_);
  next_ns_ = host_now_ns + kPeriod_ns;
}

void SharedCore::measure(std::int64_t host_now_ns) {
  constexpr std::int64_t kPeriod_ns = 10'000'000;
  const std::lock_guard lock(mutex_);
  std::int64_t used_ns = processor_time_ns(CLOCK_THREAD_CPUTIME_ID);
  for (const pid_t callee : callees_) {
    clockid_t clock{};
    if (clock_getcpuclockid(callee, &clock) == 0) used_ns += processor_time_ns(clock);
  }
  has_to_itself_ =
      processor_ns_ >= 0 && 10 * (used_ns - processor_ns_) >= 9 * (host_now_ns - measured_ns_);
  processor_ns_ = used_ns;
  measured_ns_ = host_now_ns;
  next_measurement_ns_ = host_now_ns + kPeriod_ns;
}

void SharedCore::stay() {
  CPU_ZERO(&core_);
  CPU_SET(std::max(0, sched_getcpu()), &core_);
  sched_setaffinity(0, sizeof core_, &core_);
}

void SharedCore::let_go() {
  sched_setaffinity(tid_, sizeof home_, &home_);
  loose_ = false;
  next_ns_ = INT64_MAX;
}

}  // namespace orrery
