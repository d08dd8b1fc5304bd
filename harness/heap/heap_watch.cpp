#include <orrery/harness/heap/heap_watch.hpp>
#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>
#include <orrery/harness/kernel/sim_state.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace orrery {
namespace {

// Steele, Lea & Flood, Fast splittable pseudorandom number generators (2014): mix64.
std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

CallStack stack_here() {
  std::array<void*, 24> frames;
  const internal::ProcessHooks* hooks = internal::process_hooks;
  const int count =
      hooks == nullptr ? 0 : hooks->call_stack(frames.data(), static_cast<int>(frames.size()));
  return CallStack(frames.begin(), frames.begin() + count);
}

std::uintptr_t number_of(const void* address) {
  return reinterpret_cast<std::uintptr_t>(address);
}

}  // namespace

void HeapWatch::fail_allocations(std::function<bool(std::uint64_t)> refuse) {
  refuse_ = std::move(refuse);
  requests_ = 0;
}

bool HeapWatch::refuses() {
  const HeapGuard outside(nullptr);
  ++number_;
  ++requests_;
  if (!refuse_ || !refuse_(requests_)) return false;
  ++refused_;
  errno = ENOMEM;
  return true;
}

// A function of (seed, number of the request, place): two seeds differ in every word.
void HeapWatch::fill(void* begin, std::size_t bytes) const {
  std::byte* to = static_cast<std::byte*>(begin);
  const std::uint64_t key = mixed(rules_.seed * 0x9E3779B97F4A7C15u + number_);
  for (std::size_t i = 0; i < bytes; i += 8) {
    const std::uint64_t word = mixed(key + i);
    std::memcpy(to + i, &word, std::min<std::size_t>(8, bytes - i));
  }
}

void HeapWatch::allocated(void* made, std::uint64_t bytes, std::size_t usable) {
  const HeapGuard outside(nullptr);
  if (rules_.fill) fill(made, usable);
  if (trace_) trace_->malloc(made, bytes);
  enter(made, bytes);
}

void HeapWatch::zeroed(void* made, std::uint64_t bytes) {
  const HeapGuard outside(nullptr);
  if (trace_) trace_->calloc(made, bytes);
  enter(made, bytes);
}

void HeapWatch::aligned(void* made, std::uint64_t bytes, std::uint64_t alignment,
                        std::size_t usable) {
  const HeapGuard outside(nullptr);
  if (rules_.fill) fill(made, usable);
  if (trace_) trace_->memalign(made, bytes, alignment);
  enter(made, bytes);
}

void HeapWatch::reallocated(const void* old, std::size_t old_usable, void* made,
                            std::uint64_t bytes, std::size_t usable) {
  const HeapGuard outside(nullptr);
  if (rules_.fill && usable > old_usable) {
    fill(static_cast<std::byte*>(made) + old_usable, usable - old_usable);
  }
  if (trace_) trace_->realloc(old, made, bytes);
  leave(old);
  enter(made, bytes);
}

void HeapWatch::released(const void* block) {
  const HeapGuard outside(nullptr);
  if (trace_) trace_->free(block);
  leave(block);
}

// Dead blocks that the new one covers are forgotten.
void HeapWatch::enter(const void* made, std::uint64_t bytes) {
  if (!rules_.track_sites) return;
  const std::uintptr_t begin = number_of(made);
  auto site = sites_.lower_bound(begin);
  if (site != sites_.begin()) {
    const auto before = std::prev(site);
    if (!before->second.live && before->first + before->second.bytes > begin) sites_.erase(before);
  }
  while (site != sites_.end() && site->first < begin + std::max<std::uint64_t>(bytes, 1)) {
    site = sites_.erase(site);
  }
  sites_[begin] = {.block = made,
                   .bytes = bytes,
                   .number = number_,
                   .allocated_at = from_ns(sim_now),
                   .allocated_by = stack_here()};
}

void HeapWatch::leave(const void* block) {
  if (!rules_.track_sites) return;
  const auto site = sites_.find(number_of(block));
  if (site == sites_.end() || !site->second.live) return;
  site->second.live = false;
  site->second.freed_at = from_ns(sim_now);
  site->second.freed_by = stack_here();
}

const HeapSite* HeapWatch::site_of(const void* address) const {
  auto site = sites_.upper_bound(number_of(address));
  if (site == sites_.begin()) return nullptr;
  --site;
  const std::uint64_t distance = number_of(address) - site->first;
  return distance < std::max<std::uint64_t>(site->second.bytes, 8) ? &site->second : nullptr;
}

std::vector<HeapLeak> HeapWatch::live_since(std::uint64_t after, std::uint64_t until) const {
  std::vector<HeapLeak> leaks;  // in order of address until sorted: equal stacks are found by value
  for (const auto& [address, site] : sites_) {
    if (!site.live || site.number <= after || site.number > until) continue;
    auto leak = std::find_if(leaks.begin(), leaks.end(), [&site = site](const HeapLeak& known) {
      return known.allocated_by == site.allocated_by;
    });
    if (leak == leaks.end()) {
      leak = leaks.insert(leaks.end(), {0, 0, site.allocated_at, site.allocated_by});
    }
    ++leak->blocks;
    leak->bytes += site.bytes;
    leak->first = std::min(leak->first, site.allocated_at);
  }
  std::stable_sort(leaks.begin(), leaks.end(), [](const HeapLeak& a, const HeapLeak& b) {
    return a.bytes != b.bytes ? a.bytes > b.bytes : a.first < b.first;
  });
  return leaks;
}

}  // namespace orrery
