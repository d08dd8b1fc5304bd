#include <orrery/harness/flight/flight_stack.hpp>
#include <orrery/harness/kernel/hash.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>

#include <bitset>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string>
#include <sys/mman.h>
#include <vector>

#if defined(__x86_64__) && !defined(ORRERY_ADDRESS_SANITIZER)
#define ORRERY_SWITCHES_STACKS
#endif

#ifdef ORRERY_SWITCHES_STACKS
// orrery_call_on_stack(function, argument, top). %rbp holds the caller's stack and the unwinder is
// told so: debuggers see through. Flight stacks lie below the program's, as an inner frame should.
extern "C" void orrery_call_on_stack(void (*function)(void*), void* argument, void* top);
asm(R"(
  .text
  .hidden orrery_call_on_stack
  .globl orrery_call_on_stack
  .type orrery_call_on_stack, @function
orrery_call_on_stack:
  .cfi_startproc
  pushq %rbp
  .cfi_def_cfa_offset 16
  .cfi_offset %rbp, -16
  movq %rsp, %rbp
  .cfi_def_cfa_register %rbp
  movq %rdx, %rsp
  movq %rdi, %rax
  movq %rsi, %rdi
  callq *%rax
  movq %rbp, %rsp
  popq %rbp
  .cfi_def_cfa %rsp, 8
  ret
  .cfi_endproc
  .size orrery_call_on_stack, .-orrery_call_on_stack
)");
#endif

namespace orrery::internal {
namespace {

constexpr std::uintptr_t kBase = 0x3000'0000'0000;  // above the arenas (Arena::kBase)
constexpr std::uintptr_t kSlot_bytes = 64 * 1024 * 1024;
constexpr std::size_t kSlots = 1024;
constexpr std::uint64_t kGuard_bytes = 1024 * 1024;
constexpr std::uint64_t kPage_bytes = 4096;

struct Slots {
  std::mutex mutex;
  std::bitset<kSlots> used;
};
Slots& slots() {
  static Slots all;
  return all;
}

std::size_t take_slot() {
  Slots& all = slots();
  const std::lock_guard lock(all.mutex);
  for (std::size_t i = 0; i < kSlots; ++i) {
    if (all.used[i]) continue;
    all.used[i] = true;
    return i;
  }
  throw std::runtime_error("no address is free for another stack: " + std::to_string(kSlots) +
                           " processes are alive");
}

void give_back_slot(std::size_t slot) {
  Slots& all = slots();
  const std::lock_guard lock(all.mutex);
  all.used[slot] = false;
}

}  // namespace

bool FlightStack::available() {
#ifdef ORRERY_SWITCHES_STACKS
  return true;
#else
  return false;
#endif
}

FlightStack::FlightStack(std::uint64_t bytes)
    : slot_(take_slot()), bytes_((bytes + kPage_bytes - 1) / kPage_bytes * kPage_bytes) {
  void* place = reinterpret_cast<void*>(kBase + slot_ * kSlot_bytes);
  void* memory =
      mmap(place, kGuard_bytes + bytes_, PROT_NONE,
           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED_NOREPLACE | MAP_STACK, -1, 0);
  guard_ = static_cast<std::byte*>(memory);
  bottom_ = guard_ + kGuard_bytes;
  if (memory != place || mprotect(bottom_, bytes_, PROT_READ | PROT_WRITE) != 0) {
    const std::string reason = std::strerror(errno);
    if (memory != MAP_FAILED) munmap(memory, kGuard_bytes + bytes_);
    give_back_slot(slot_);
    throw std::runtime_error("no memory for a stack of " + std::to_string(bytes) +
                             " bytes: " + reason);
  }
}

FlightStack::~FlightStack() {
  munmap(guard_, kGuard_bytes + bytes_);
  give_back_slot(slot_);
}

bool FlightStack::guards(const void* address) const {
  return address >= guard_ && address < bottom_;
}

// Fresh pages are zero and not there: no paint is needed, which would make them all be there.
std::uint64_t FlightStack::high_water_bytes() const {
  std::vector<unsigned char> resident(bytes_ / kPage_bytes);
  if (mincore(bottom_, bytes_, resident.data()) != 0) return 0;
  for (std::size_t page = 0; page < resident.size(); ++page) {
    if ((resident[page] & 1) == 0) continue;
    const std::byte* begin = bottom_ + page * kPage_bytes;
    for (std::uint64_t i = 0; i < kPage_bytes; ++i) {
      if (begin[i] != std::byte{0}) return bytes_ - page * kPage_bytes - i;
    }
  }
  return 0;
}

void FlightStack::overwrite_used(std::uint64_t seed) {
  constexpr std::uint64_t kWord_bytes = sizeof(std::uint64_t);
  std::byte* const top = bottom_ + bytes_;
  const std::uint64_t words = high_water_bytes() / kWord_bytes;  // whole ones: the rest stays zero
  for (std::uint64_t i = 1; i <= words; ++i) {
    const std::uint64_t drawn = hash_word(seed, i);
    std::memcpy(top - i * kWord_bytes, &drawn, kWord_bytes);
  }
}

void FlightStack::call(void (*function)(void*), void* argument) const {
#ifdef ORRERY_SWITCHES_STACKS
  orrery_call_on_stack(function, argument, bottom_ + bytes_);
#else
  function(argument);
#endif
}

}  // namespace orrery::internal
