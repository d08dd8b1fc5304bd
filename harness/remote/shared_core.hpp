/// One core for two processes that take turns.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <sched.h>
#include <sys/types.h>
#include <thread>
#include <vector>

namespace orrery {

/// Keeps a thread and the child processes that it calls on one core, since a wake-up across cores
/// costs several times a switch within one. Which core is the system's choice, made anew every
/// 50 ms of host time: for one exchange the thread may run wherever it might before, and then they
/// all stay where it is. Concerns speed only.
///
/// A child that sets its affinity itself is left alone from then on. Where the thread has but one
/// core nothing is done. A thread that is started meanwhile inherits the one core, unless by
/// worker_thread().
class SharedCore {
 public:
  /// Of the calling thread; one for all that it calls.
  static std::shared_ptr<SharedCore> of_this_thread();
  SharedCore();
  SharedCore(const SharedCore&) = delete;
  SharedCore& operator=(const SharedCore&) = delete;

  /// Before a child is started, which inherits the core: set later it might undo a choice of its
  /// own.
  void hold();
  /// Started by this thread since hold().
  void join(pid_t child);
  /// Before it is waited for; -1: none was started. The last one gives the thread its cores back.
  /// Any thread.
  void leave(pid_t child);
  /// Before each exchange. In another thread it does nothing.
  void take_turn(std::int64_t host_now_ns) {
    if (host_now_ns >= next_ns_ && std::this_thread::get_id() == thread_) choose(host_now_ns);
  }

  /// Nobody else ran where they take turns in the last 10 ms of host time or longer: the processor
  /// time of this thread and its children was 0.9 of that. To be asked before each exchange; false
  /// in another thread.
  bool has_to_itself(std::int64_t host_now_ns) {
    if (std::this_thread::get_id() != thread_) return false;
    if (host_now_ns >= next_measurement_ns_) measure(host_now_ns);
    return has_to_itself_;
  }
  /// For tests: what is not measured any more; nothing: it is again.
  void assume_to_itself(std::optional<bool> is) {
    has_to_itself_ = is.value_or(false);
    next_measurement_ns_ = is ? INT64_MAX : 0;
    processor_ns_ = -1;
  }

 private:
  void choose(std::int64_t host_now_ns);
  void measure(std::int64_t host_now_ns);
  void stay();
  void let_go();

  std::thread::id thread_ = std::this_thread::get_id();
  pid_t tid_;
  std::mutex mutex_;
  std::vector<pid_t> children_;  // that share the core
  std::vector<pid_t> callees_;   // all that were started and have not left
  cpu_set_t home_{};             // of the thread, before
  cpu_set_t core_{};             // where they are
  bool loose_ = false;
  std::atomic<std::int64_t> next_ns_{INT64_MAX};  // INT64_MAX: the thread is free

  bool has_to_itself_ = false;
  std::int64_t measured_ns_ = 0, next_measurement_ns_ = 0;
  std::int64_t processor_ns_ = -1;  // at measured_ns_; -1: there are others since
};

}  // namespace orrery
