// formation_keeping with an archive of its telemetry; ARCHIVE says what the archive does to memory.
// Every six hours a frame is prepared in a buffer and becomes an entry.
//   SOUND          The newest of 400 entries takes the place of the oldest; the buffer is freed.
//   FRAGMENTATION  So it does; but the buffer is shrunk to the entry where it lies: what is left of
//                  its place is too small for the next buffer.
//   LEAK           The one entry that there is gives way to the next, and is never freed.
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "orrery_flight.h"

#define SOUND 1
#define FRAGMENTATION 2
#define LEAK 3

extern "C" const orrery_flight* formation_keeping_entry(void);

namespace {

constexpr std::uint32_t kTelemetry = 7;  // formation_keeping's output port
constexpr std::int64_t kPeriod_ns = std::int64_t{6 * 3600} * 1000000000;

constexpr std::size_t kEntries = ARCHIVE == LEAK ? 1 : 400;
constexpr std::size_t kEntryBytes = 48;
constexpr std::size_t kBufferBytes = 2500;  // more than the package leaves free after boot

void* entries[kEntries];
std::int64_t* times[kEntries];  // between the entries, so that freed ones do not join
std::size_t oldest = 0;
std::int64_t now_ns;

// All are there from boot, so that what is live stays the same.
void prepare() {
  for (std::size_t i = 0; i < kEntries; ++i) {
    entries[i] = std::calloc(1, kEntryBytes);
    times[i] = static_cast<std::int64_t*>(std::calloc(1, sizeof(std::int64_t)));
  }
}

void* prepared(const void* frame, std::uint32_t bytes) {
  void* const buffer = std::calloc(1, kBufferBytes);
  if (buffer != nullptr) std::memcpy(buffer, frame, bytes < kBufferBytes ? bytes : kBufferBytes);
  return buffer;
}

void* copied_entry(const void* frame, std::uint32_t bytes) {
  void* const entry = std::malloc(kEntryBytes);
  void* const buffer = prepared(frame, bytes);
  if (entry != nullptr && buffer != nullptr) std::memcpy(entry, buffer, kEntryBytes);
  std::free(buffer);
  return entry;
}

void keep(const void* frame, std::uint32_t bytes) {
  void* const entry = ARCHIVE == FRAGMENTATION ? std::realloc(prepared(frame, bytes), kEntryBytes)
                                               : copied_entry(frame, bytes);
  if (entry == nullptr) return;
  if (ARCHIVE != LEAK) std::free(entries[oldest]);
  entries[oldest] = entry;
  if (times[oldest] != nullptr) *times[oldest] = now_ns;
  oldest = (oldest + 1) % kEntries;
}

const orrery_host* real_host;
orrery_host host;  // as the package sees it
std::int64_t last_slot = -1;

std::int32_t output(void* context, std::uint32_t port, const void* data, std::uint32_t bytes) {
  if (port == kTelemetry && now_ns / kPeriod_ns != last_slot) {
    last_slot = now_ns / kPeriod_ns;
    keep(data, bytes);
  }
  return real_host->output(context, port, data, bytes);
}

std::int32_t create(void** self, const orrery_host* given, const orrery_boot* boot) {
  real_host = given;
  host = *given;
  host.output = &output;
  now_ns = boot->now_ns;
  prepare();
  return formation_keeping_entry()->create(self, &host, boot);
}

std::int32_t input(void* self, std::int64_t t_ns, std::uint32_t port, const void* data,
                   std::uint32_t bytes) {
  now_ns = t_ns;
  return formation_keeping_entry()->input(self, t_ns, port, data, bytes);
}

}  // namespace

extern "C" ORRERY_EXPORT const orrery_flight* ORRERY_FLIGHT_ENTRY(void) {
  static orrery_flight flight;
  flight = *formation_keeping_entry();
  flight.create = &create;
  flight.input = &input;
  return &flight;
}
