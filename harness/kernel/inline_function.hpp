/// A callable kept inside the object: no allocation, ever. What does not fit does not compile.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>
#include <utility>

namespace orrery {

template <class Signature, std::size_t kCapacity>
class InlineFunction;

/// Move-only. Calling an empty one is undefined; test it first with operator bool.
template <class R, class... Args, std::size_t kCapacity>
class InlineFunction<R(Args...), kCapacity> {
 public:
  // Not defaulted: InlineFunction() would then fill the storage with zeros first.
  InlineFunction() noexcept {}

  template <class F>
  requires(!std::is_same_v<std::remove_cvref_t<F>, InlineFunction> &&
           std::is_invocable_r_v<R, std::remove_cvref_t<F>&, Args...>)
      InlineFunction(F&& f) {  // NOLINT(google-explicit-constructor): a lambda is an action
    using Held = std::remove_cvref_t<F>;
    static_assert(sizeof(Held) <= kCapacity, "the capture is too large: keep it elsewhere");
    static_assert(alignof(Held) <= alignof(std::max_align_t));
    static_assert(std::is_nothrow_move_constructible_v<Held>);
    ::new (static_cast<void*>(storage_)) Held(std::forward<F>(f));
    table_ = &kTable<Held>;
  }

  InlineFunction(InlineFunction&& other) noexcept { take(other); }
  InlineFunction& operator=(InlineFunction&& other) noexcept {
    if (this != &other) {
      reset();
      take(other);
    }
    return *this;
  }
  ~InlineFunction() { reset(); }

  explicit operator bool() const { return table_ != nullptr; }
  R operator()(Args... args) { return table_->call(storage_, std::forward<Args>(args)...); }

 private:
  struct Table {
    R (*call)(void*, Args...);
    void (*relocate)(void* from, void* to);  // null: copy the bytes
    void (*destroy)(void*);                  // null: nothing to do
  };

  template <class Held>
  static constexpr Table kTable = {
      [](void* held, Args... args) -> R {
        if constexpr (std::is_void_v<R>) {
          static_cast<void>((*static_cast<Held*>(held))(std::forward<Args>(args)...));
        } else {
          return (*static_cast<Held*>(held))(std::forward<Args>(args)...);
        }
      },
      std::is_trivially_copyable_v<Held> ? nullptr
                                         : +[](void* from, void* to) {
                                             ::new (to) Held(std::move(*static_cast<Held*>(from)));
                                             static_cast<Held*>(from)->~Held();
                                           },
      std::is_trivially_destructible_v<Held>
          ? nullptr
          : +[](void* held) { static_cast<Held*>(held)->~Held(); }};

  void reset() {
    if (table_ != nullptr && table_->destroy != nullptr) table_->destroy(storage_);
    table_ = nullptr;
  }
  void take(InlineFunction& other) {
    table_ = other.table_;
    if (table_ == nullptr) return;
    if (table_->relocate != nullptr) {
      table_->relocate(other.storage_, storage_);
    } else {
      // All of it: a copy of constant size is a few moves, and cheaper than knowing the size.
      std::memcpy(storage_, other.storage_, kCapacity);
    }
    other.table_ = nullptr;
  }

  alignas(std::max_align_t) std::byte storage_[kCapacity];
  const Table* table_ = nullptr;
};

}  // namespace orrery
