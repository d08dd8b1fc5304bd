/// Calls that are made later, in the order in which they were put, by a thread of their own: so
/// that a simulation does not wait for what it records to be formatted, hashed and written.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <string_view>
#include <sys/types.h>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace orrery {

namespace internal {

template <class T>
constexpr bool kIsView = std::is_same_v<T, std::string_view> || std::is_same_v<T, Bytes>;

// Arguments lie one behind the other, each at a multiple of 8 bytes; of a view its content.
constexpr std::size_t in_words(std::size_t bytes) {
  return (bytes + 7) / 8 * 8;
}

template <class T>
std::size_t carried_bytes(const T& value) {
  if constexpr (kIsView<T>) return sizeof(std::uint64_t) + in_words(value.size());
  return in_words(sizeof(T));
}

template <class T>
void carry(std::byte*& to, const T& value) {
  if constexpr (kIsView<T>) {
    const std::uint64_t size = value.size();
    std::memcpy(to, &size, sizeof size);
    if (size > 0) std::memcpy(to + sizeof size, value.data(), size);
  } else {
    static_assert(std::is_trivially_copyable_v<T>, "a CallQueue copies arguments as bytes");
    std::memcpy(to, &value, sizeof value);
  }
  to += carried_bytes(value);
}

// A view, or a reference to where the value lies: memcpy has begun its life there.
template <class T>
std::conditional_t<kIsView<T>, T, const T&> take(const std::byte*& from) {
  if constexpr (kIsView<T>) {
    std::uint64_t size = 0;
    std::memcpy(&size, from, sizeof size);
    const T value(reinterpret_cast<typename T::const_pointer>(from + sizeof size), size);
    from += carried_bytes(value);
    return value;
  } else {
    static_assert(alignof(T) <= alignof(std::uint64_t));
    const auto* value = reinterpret_cast<const T*>(from);
    from += in_words(sizeof(T));
    return *std::launder(value);
  }
}

}  // namespace internal

/// What is called sees the same calls in the same order whatever the threads' timing, so what it
/// writes depends on the calls alone.
///
/// Arguments  std::string_view and Bytes, whose content is copied, and what can be copied as bytes.
///            A struct that holds a view is one of the latter by its type: pass its parts.
/// Memory     Blocks of 256 KiB, 16 at most: put() waits while all are full.
/// Errors     After a call that throws no further one is made; put() or finish() throws the same.
/// Forks      Only after finish(), which ends the thread; the next full block starts another one.
///            In a child made otherwise (a death test's) calls are dropped.
class CallQueue {
 public:
  CallQueue() = default;
  /// Makes the calls that are left; an error of theirs is lost.
  ~CallQueue();
  CallQueue(const CallQueue&) = delete;
  CallQueue& operator=(const CallQueue&) = delete;

  /// Calls `(target.*method)(arguments...)`, soon. `target` is not for others until finish().
  template <class Target, class... Parameters>
  void put(Target& target, void (Target::*method)(Parameters...),
           const std::type_identity_t<std::remove_cvref_t<Parameters>>&... arguments) {
    const Maker maker = &make<Target, Parameters...>;
    const Method<Target, Parameters...> kept = method;
    Target* const whose = &target;
    std::byte* to =
        room(internal::carried_bytes(maker) + internal::carried_bytes(whose) +
             (internal::carried_bytes(kept) + ... + internal::carried_bytes(arguments)));
    internal::carry(to, maker);
    internal::carry(to, whose);
    internal::carry(to, kept);
    (internal::carry(to, arguments), ...);
  }

  /// Returns when all calls were made and the thread has ended.
  void finish();

 private:
  // In a block a call begins with the function that knows the types of the rest.
  using Maker = void (*)(const std::byte*& at);
  template <class Target, class... Parameters>
  using Method = void (Target::*)(Parameters...);
  template <class Target, class... Parameters>
  static void make(const std::byte*& at) {
    Target* const target = internal::take<Target*>(at);
    const auto method = internal::take<Method<Target, Parameters...>>(at);
    // Braces: taken from left to right.
    const std::tuple<decltype(internal::take<std::remove_cvref_t<Parameters>>(at))...> arguments{
        internal::take<std::remove_cvref_t<Parameters>>(at)...};
    std::apply([&](const auto&... each) { (target->*method)(each...); }, arguments);
  }
  struct Block {
    std::unique_ptr<std::byte[]> data = {};
    std::size_t capacity = 0, used = 0;
  };

  std::byte* room(std::size_t bytes) {
    if (open_.capacity - open_.used < bytes) next_block(bytes);
    return open_.data.get() + std::exchange(open_.used, open_.used + bytes);
  }
  void next_block(std::size_t bytes);
  void hand_over();
  void make_calls();
  void make_calls_of(const Block& block);
  bool is_orphan() const;
  void end_thread();
  bool has_failed();
  void rethrow_error();

  Block open_;         // being filled
  pid_t process_ = 0;  // in which the thread runs
  std::thread thread_;
  std::mutex mutex_;  // of what follows
  std::condition_variable has_full_, has_empty_;
  std::vector<Block> full_, empty_;  // the first of full_ is the oldest
  std::size_t blocks_ = 0;
  bool is_ending_ = false;
  std::exception_ptr error_;
};

}  // namespace orrery
