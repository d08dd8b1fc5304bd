/// What an event is, and in what order events run.
#pragma once

#include <orrery/harness/kernel/inline_function.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <compare>
#include <cstdint>

namespace orrery {

/// Order of events at one instant. An event may be pushed at the current instant in an earlier
/// phase (a delivery without delay); it runs next.
enum class Phase : std::uint8_t {
  kFault = 0,     // faults and clock steps
  kDevice = 1,    // devices and truth
  kDelivery = 2,  // input to flight software
  kTick = 3,      // flight software's own timer
  kOutput = 4,    // outputs leave flight software
  kTest = 5,      // callbacks of the test
  kRecorder = 6,  // recording; never in the fingerprint
};

/// Spacecraft, links and the test are owners; ids follow the order of declaration.
using OwnerId = std::uint16_t;

/// What an event does, for fingerprint, traces and messages. Define one constant per kind; `id` is
/// part of the fingerprint and must not depend on the order of loading.
/// 1-99 kernel and fixtures, 100-199 flight computer, 200-299 models, 1000- users.
struct EventKind {
  std::uint16_t id;
  const char* name;
};

/// Total order of events: (t, phase, destination, origin, the origin's own counter). There is no
/// global counter, so the order does not depend on how many threads run.
struct EventKey {
  SimTime t;
  Phase phase = Phase::kDevice;
  OwnerId destination = 0;
  OwnerId origin = 0;
  std::uint64_t counter = 0;
  friend auto operator<=>(const EventKey&, const EventKey&) = default;
};

/// Small callable without allocation. 48 bytes hold a pointer or two and a payload index.
using Action = InlineFunction<void(), 48>;

/// Names a scheduled event for cancellation. A handle of an event that has run, or was cancelled,
/// is stale and harmless.
struct EventHandle {
  std::uint32_t slot = 0;
  std::uint32_t generation = 0;  // 0: names nothing
  friend bool operator==(const EventHandle&, const EventHandle&) = default;
};

}  // namespace orrery
