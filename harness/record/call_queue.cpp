#include <orrery/harness/kernel/worker_thread.hpp>
#include <orrery/harness/record/call_queue.hpp>

#include <algorithm>
#include <unistd.h>

namespace orrery {
namespace {

// A block stays in the second cache of a processor; handing one over costs some microseconds.
constexpr std::size_t kBlockBytes = 256 * 1024;
constexpr std::size_t kMostBlocks = 16;

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
    process_ = getpid();
    thread_ = worker_thread([this] { make_calls(); });
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
