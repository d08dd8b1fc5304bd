/// Which sanitizers this is compiled with: g++ and clang say so in different ways.
///   ORRERY_ADDRESS_SANITIZER       addresses, and with it leaks
///   ORRERY_SANITIZER_OWNS_MALLOC   any that brings an allocator and services of its own
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define ORRERY_ADDRESS_SANITIZER
#endif
#if __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define ORRERY_SANITIZER_OWNS_MALLOC
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) && !defined(ORRERY_ADDRESS_SANITIZER)
#define ORRERY_ADDRESS_SANITIZER
#endif
#if defined(__SANITIZE_THREAD__) || defined(ORRERY_ADDRESS_SANITIZER)
#ifndef ORRERY_SANITIZER_OWNS_MALLOC
#define ORRERY_SANITIZER_OWNS_MALLOC
#endif
#endif
