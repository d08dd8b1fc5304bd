#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>

#include <gtest/gtest.h>

#include <cerrno>
#include <cstring>
#include <dlfcn.h>
#include <optional>
#include <string>
#include <vector>

namespace orrery {
namespace {

class InterposerTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns malloc";
    warm_up_libraries();
    library_ = dlopen(ORRERY_HOOK_PROBE, RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(library_, nullptr) << dlerror();
  }
  void TearDown() override {
    if (library_ != nullptr) dlclose(library_);
  }
  template <class F>
  F* symbol(const char* name) {
    F* f = reinterpret_cast<F*>(dlsym(library_, name));
    EXPECT_NE(f, nullptr) << name;
    return f;
  }

  SimulatedHeap heap_{{.limit_bytes = 1 << 20}};
  void* library_ = nullptr;
};

TEST_F(InterposerTest, EveryHookIsTaken) {
  EXPECT_EQ(verify_interposition(), "");
}

TEST_F(InterposerTest, EveryAllocationOfALibraryComesFromTheCurrentHeap) {
  const auto release = symbol<void(void*)>("probe_free");
  for (const char* name :
       {"probe_malloc", "probe_calloc", "probe_memalign", "probe_aligned_alloc",
        "probe_posix_memalign", "probe_valloc", "probe_pvalloc", "probe_new", "probe_new_wide"}) {
    const auto allocate = symbol<void*(std::size_t)>(name);
    void* p = nullptr;
    {
      const HeapGuard guard(&heap_);
      p = allocate(24);
    }
    EXPECT_EQ(SimulatedHeap::owner_of(p), &heap_) << name;
    EXPECT_EQ(heap_.blocks().figures().live_blocks, 1u) << name;
    release(p);  // by address: no heap is current
    EXPECT_EQ(heap_.blocks().live_bytes(), 0u) << name;
    void* outside = allocate(24);
    EXPECT_EQ(SimulatedHeap::owner_of(outside), nullptr) << name;
    const HeapGuard guard(&heap_);
    release(outside);
  }
}

TEST_F(InterposerTest, ReallocStaysWhereTheBlockIs) {
  for (const char* name : {"probe_realloc", "probe_reallocarray"}) {
    const auto resize = symbol<void*(void*, std::size_t)>(name);
    void* outside = resize(nullptr, 24);
    void* inside = nullptr;
    {
      const HeapGuard guard(&heap_);
      inside = resize(nullptr, 24);
      outside = resize(outside, 1000);
    }
    inside = resize(inside, 1000);
    EXPECT_EQ(SimulatedHeap::owner_of(outside), nullptr) << name;
    EXPECT_EQ(SimulatedHeap::owner_of(inside), &heap_) << name;
    EXPECT_EQ(symbol<std::size_t(void*)>("probe_malloc_usable_size")(inside), 1000u) << name;
    EXPECT_GE(symbol<std::size_t(void*)>("probe_malloc_usable_size")(outside), 1000u) << name;
    resize(inside, 0);
    EXPECT_EQ(heap_.blocks().live_bytes(), 0u) << name;
    free(outside);
  }
}

TEST_F(InterposerTest, WhatTheStandardLibraryAllocatesForALibraryCounts) {
  const auto grow = symbol<std::size_t(std::size_t)>("probe_string");
  {
    const HeapGuard guard(&heap_);
    EXPECT_EQ(grow(1000), 1000u);
  }
  // libstdc++ doubles from 15: 30, 60, ... 1920 characters in 7 blocks.
  EXPECT_EQ(heap_.blocks().allocations(), 7u);
  EXPECT_EQ(heap_.blocks().live_bytes(), 0u);
}

TEST_F(InterposerTest, PastTheLimitNewThrowsBadAlloc) {
  const HeapGuard guard(&heap_);
  EXPECT_EQ(symbol<int()>("probe_throw_bad_alloc")(), 1);
  EXPECT_EQ(heap_.blocks().figures().failures, 1u);
  errno = 0;
  EXPECT_EQ(symbol<void*(std::size_t)>("probe_malloc")(1 << 21), nullptr);
  EXPECT_EQ(errno, ENOMEM);
}

TEST_F(InterposerTest, AnExceptionThatLeavesTheHeapIsReleasedOutside) {
  const auto throws = symbol<void()>("probe_throw");
  try {
    const HeapGuard guard(&heap_);
    throws();
  } catch (const std::string& text) {
    EXPECT_EQ(text.size(), 56u);
    EXPECT_GT(heap_.blocks().live_bytes(), 56u);
  }
  EXPECT_EQ(heap_.blocks().live_bytes(), 0u);
}

TEST_F(InterposerTest, ThreadLocalStorageIsTheLoadersNotTheHeaps) {
  const HeapGuard guard(&heap_);
  *symbol<long*()>("probe_thread_local")() = 1;
  EXPECT_EQ(heap_.blocks().allocations(), 0u);
}

TEST_F(InterposerTest, BlocksOfADroppedHeapAreIgnored) {
  std::vector<int>* left = nullptr;
  {
    const HeapGuard guard(&heap_);
    left = symbol<std::vector<int>*()>("probe_vector")();
  }
  const std::uint64_t live = heap_.blocks().live_bytes();
  heap_.drop();
  symbol<void(void*)>("probe_free")(left);
  EXPECT_EQ(symbol<void*(void*, std::size_t)>("probe_realloc")(left, 10), nullptr);
  EXPECT_EQ(heap_.blocks().live_bytes(), live);
}

TEST_F(InterposerTest, AnotherHeapsBlockIsForeignToFlightCode) {
  SimulatedHeap other({.limit_bytes = 1 << 20});
  const auto allocate = symbol<void*(std::size_t)>("probe_malloc");
  const auto release = symbol<void(void*)>("probe_free");
  void* block = nullptr;
  {
    const HeapGuard guard(&other);
    block = allocate(24);
  }
  std::optional<HeapFault> fault;
  heap_.blocks().set_fault_handler(
      [](void* found, const HeapFault& f) {
        static_cast<std::optional<HeapFault>*>(found)->emplace(f);
      },
      &fault);
  {
    const HeapGuard guard(&heap_);
    release(block);
  }
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->kind, HeapFault::Kind::kForeignPointer);
  EXPECT_EQ(other.blocks().figures().live_blocks, 1u);
  release(block);
  EXPECT_EQ(other.blocks().figures().live_blocks, 0u);
}

TEST_F(InterposerTest, EqualCallsGiveEqualPointersInTheNextHeap) {
  const auto allocate = symbol<void*(std::size_t)>("probe_malloc");
  void* first[2] = {};
  for (void*& p : first) {
    SimulatedHeap heap({.limit_bytes = 1 << 20});
    const HeapGuard guard(&heap);
    allocate(100);
    p = allocate(100);
  }
  EXPECT_EQ(first[0], first[1]);
}

}  // namespace
}  // namespace orrery
