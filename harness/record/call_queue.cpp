#include <orrery/harness/record/call_queue.hpp>

#include <algorithm>
#include <csignal>
#include <sched.h>
#include <unistd.h>

namespace orrery {
namespace {

// A block stays in the second cache of a processor; handing one over costs some microseconds.
constexpr std::size_t kBlockBytes = 256 * 1024;
constexpr std::size_t kMostBlocks = 16;

/// While it lives, threads that begin take no signals: those of a test program are for its own.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_;
};

// Of the program as it was started: a thread may keep to one of them since (SharedCore).
const cpu_set_t kCores = [] {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  sched_getaffinity(0, sizeof cores, &cores);
  return cores;
}();

}  // namespace

CallQueue::~CallQueue() {
  try {
    finish();
  } catch (...) {
    end_thread();
  }
}

// In a child that was made while the thread ran, and has no such thread.
bool CallQueue::is_orphan() const {
  return thread_.joinable() && getpid() != process_;
}

void CallQueue::finish() {
  if (is_orphan()) {
    open_.used = 0;
    thread_.detach();
    return;
  }
  if (open_.used > 0 && !has_failed()) hand_over();
  end_thread();
  rethrow_error();
}

// When it has made all calls that it was given.
void CallQueue::end_thread() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  has_full_.notify_one();
  thread_.join();
  is_ending_ = false;
}

bool CallQueue::has_failed() {
  const std::lock_guard lock(mutex_);
  return error_ != nullptr;
}

void CallQueue::next_block(std::size_t bytes) {
  if (open_.used > 0) hand_over();
  if (open_.capacity >= bytes) return;
  if (bytes > kBlockBytes) {
    open_ = {std::make_unique<std::byte[]>(bytes), bytes};
    return;
  }
  std::unique_lock lock(mutex_);
  if (empty_.empty() && blocks_ < kMostBlocks) {
    ++blocks_;
    empty_.push_back({std::make_unique<std::byte[]>(kBlockBytes), kBlockBytes});
  }
  has_empty_.wait(lock, [this] { return !empty_.empty(); });
  open_ = std::move(empty_.back());
  empty_.pop_back();
}

void CallQueue::hand_over() {
  if (is_orphan()) {
    open_.used = 0;
    return;
  }
  rethrow_error();
  if (!thread_.joinable()) {
    const SignalsBlocked blocked;
    process_ = getpid();
    thread_ = std::thread([this] {
      sched_setaffinity(0, sizeof kCores, &kCores);
      make_calls();
    });
  }
  {
    const std::lock_guard lock(mutex_);
    full_.push_back(std::exchange(open_, {}));
  }
  has_full_.notify_one();
}

void CallQueue::make_calls() {
  std::unique_lock lock(mutex_);
  for (;;) {
    has_full_.wait(lock, [this] { return !full_.empty() || is_ending_; });
    if (full_.empty()) return;
    Block block = std::move(full_.front());
    full_.erase(full_.begin());
    if (!error_) {
      lock.unlock();
      std::exception_ptr error;
      try {
        make_calls_of(block);
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      error_ = error;
    }
    if (block.capacity != kBlockBytes) continue;  // made for one long call
    block.used = 0;
    empty_.push_back(std::move(block));
    has_empty_.notify_one();
  }
}

void CallQueue::make_calls_of(const Block& block) {
  const std::byte* at = block.data.get();
  const std::byte* const end = at + block.used;
  while (at < end) internal::take<Maker>(at)(at);
}

void CallQueue::rethrow_error() {
  const std::lock_guard lock(mutex_);
  if (error_) std::rethrow_exception(error_);
}

}  // namespace orrery
