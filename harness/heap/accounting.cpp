#include <orrery/harness/heap/accounting.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <cstdlib>
#include <mutex>
#include <unordered_map>

// Of the sanitizers' runtime (sanitizer/allocator_interface.h); absent from other programs.
extern "C" [[gnu::weak]] int __sanitizer_install_malloc_and_free_hooks(
    void (*)(const volatile void*, std::size_t), void (*)(const volatile void*));

namespace orrery {
namespace {

class AccountingHeap final : public BlockHeap {
 public:
  explicit AccountingHeap(const HeapOptions& options) : BlockHeap(arena_, options, 16) {
    has_blocks_ = false;
  }

  void charge(std::uint64_t bytes) {
    add_live(bytes);
    ++allocations_;
    area_.top = area_.first + static_cast<Offset>(std::min(high_water_bytes(), kMaxLimit_bytes));
    if (live_bytes_ <= options_.limit_bytes) return;
    ++failures_;
    fail(HeapFault::Kind::kExhausted, nullptr, "malloc", bytes);
  }
  void credit(std::uint64_t bytes) {
    live_bytes_ -= bytes;
    ++frees_;
  }

  // Nobody allocates from here.
  void* allocate(std::size_t) noexcept override { std::abort(); }
  void* allocate_zeroed(std::size_t, std::size_t) noexcept override { std::abort(); }
  void* allocate_aligned(std::size_t, std::size_t) noexcept override { std::abort(); }
  void* reallocate(void*, std::size_t) noexcept override { std::abort(); }
  void release(void*) noexcept override { std::abort(); }
  std::uint64_t largest_free_bytes() const override { return 0; }
  std::uint64_t free_list_length() const override { return 0; }
  bool check() override { return true; }

 private:
  alignas(16) std::byte arena_[64];
};

// Who is charged for a block, and how much.
struct Account {
  SimulatedHeap* heap;
  std::size_t bytes;
};
struct Ledger {
  std::mutex mutex;
  std::unordered_map<const volatile void*, Account> accounts;  // never iterated for output
};
Ledger& ledger() {
  static Ledger* const all = new Ledger;  // until the very end: frees come after destructors
  return *all;
}

thread_local constinit bool keeping_books = false;  // what the ledger allocates is not charged

class KeepingBooks {
 public:
  KeepingBooks() : outside_(nullptr) { keeping_books = true; }
  ~KeepingBooks() { keeping_books = false; }

 private:
  HeapGuard outside_;
};

AccountingHeap& account_of(SimulatedHeap& heap) {
  return static_cast<AccountingHeap&>(heap.blocks());
}

void on_malloc(const volatile void* block, std::size_t bytes) {
  SimulatedHeap* heap = current_heap;
  if (heap == nullptr || keeping_books || block == nullptr) return;
  {
    const KeepingBooks guard;
    const std::lock_guard lock(ledger().mutex);
    ledger().accounts[block] = {heap, bytes};
  }
  account_of(*heap).charge(bytes);  // may not return
}

void on_free(const volatile void* block) {
  if (keeping_books || block == nullptr) return;
  const KeepingBooks guard;
  const std::lock_guard lock(ledger().mutex);
  const auto account = ledger().accounts.find(block);
  if (account == ledger().accounts.end()) return;
  account_of(*account->second.heap).credit(account->second.bytes);
  ledger().accounts.erase(account);
}

}  // namespace

bool heap_accounting_available() {
  return __sanitizer_install_malloc_and_free_hooks != nullptr && !heap_simulation_available();
}

std::unique_ptr<BlockHeap> make_accounting_heap(const HeapOptions& options) {
  return std::make_unique<AccountingHeap>(options);
}

namespace internal {

void install_accounting() {
  static std::once_flag once;
  std::call_once(once, [] {
    ledger();
    __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free);
  });
}

void forget_accounts(const SimulatedHeap* heap) {
  const KeepingBooks guard;
  const std::lock_guard lock(ledger().mutex);
  std::erase_if(ledger().accounts, [heap](const auto& entry) { return entry.second.heap == heap; });
}

}  // namespace internal
}  // namespace orrery
