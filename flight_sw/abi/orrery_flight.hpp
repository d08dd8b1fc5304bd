/// A class with typed inputs and outputs as an Orrery flight library. C++11, no dependency, no
/// allocation of its own beyond the one object. The C contract is in orrery_flight.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "orrery_flight.h"

namespace orrery_abi {

struct Bytes {
  const void* data;
  std::uint32_t size;
};

/// A row of an App's port table. `input` is null for outputs.
template <class App>
struct Port {
  std::uint32_t id;
  std::uint16_t direction, kind;
  const char* name;
  std::uint32_t max_bytes;
  std::int32_t (App::*input)(std::int64_t now_ns, Bytes);
};

/// What an App's constructor gets; copy it into a member. Calls cross to the host at once.
class Host {
 public:
  explicit Host(const orrery_host* host) : host_(host) {}
  std::int32_t output(std::uint32_t port, Bytes b) const {
    return host_->output(host_->context, port, b.data, b.size);
  }
  void request_tick(std::int64_t at_ns) const { host_->request_tick(host_->context, at_ns); }
  void log(std::int32_t level, const char* line) const { host_->log(host_->context, level, line); }
  const orrery_host* operator->() const { return host_; }

 private:
  const orrery_host* host_;
};

/// Thunks are noexcept: an escaping exception terminates where it was thrown, so the backtrace is
/// whole. So with g++; clang 14 unwinds to the thunk first, and there the backtrace begins.
template <class App>
struct Thunks {
  static std::int32_t create(void** self, const orrery_host* host,
                             const orrery_boot* boot) noexcept {
    *self = new App(Host(host), *boot);
    return ORRERY_OK;
  }
  static std::int32_t input(void* self, std::int64_t now_ns, std::uint32_t id, const void* data,
                            std::uint32_t bytes) noexcept {
    for (const Port<App>& p : App::ports()) {
      if (p.direction == ORRERY_IN && p.id == id) {
        return (static_cast<App*>(self)->*p.input)(now_ns, Bytes{data, bytes});
      }
    }
    return ORRERY_NOT_FOUND;
  }
  static std::int32_t tick(void* self, std::int64_t now_ns) noexcept {
    return static_cast<App*>(self)->tick(now_ns);
  }
  static void destroy(void* self) noexcept { delete static_cast<App*>(self); }
};

/// Fills the caller's own statics: a static in this template could become one per process
/// (STB_GNU_UNIQUE), and all copies of the library would share it.
template <class App, std::size_t N>
orrery_flight describe(const Port<App> (&table)[N], orrery_port (&ports)[N], const char* name,
                       const char* version) {
  for (std::size_t i = 0; i < N; ++i) {
    ports[i] = orrery_port{table[i].id, table[i].direction, table[i].kind, table[i].name,
                           table[i].max_bytes};
  }
  return orrery_flight{sizeof(orrery_flight),
                       ORRERY_ABI_VERSION,
                       name,
                       version,
                       ports,
                       static_cast<std::uint32_t>(N),
                       &Thunks<App>::create,
                       &Thunks<App>::input,
                       &Thunks<App>::tick,
                       &Thunks<App>::destroy};
}

}  // namespace orrery_abi

/// Once per library: makes class `App` its flight software. `App` offers
///   App(orrery_abi::Host, const orrery_boot&);  std::int32_t tick(std::int64_t now_ns);
///   static const Port<App> (&ports())[N];       and the member functions named in that table.
#define ORRERY_FLIGHT_LIBRARY(App, name, version)                                                 \
  extern "C" ORRERY_EXPORT const orrery_flight* ORRERY_FLIGHT_ENTRY(void) {                       \
    static orrery_port ports[sizeof(App::ports()) / sizeof(App::ports()[0])];                     \
    static const orrery_flight flight = orrery_abi::describe(App::ports(), ports, name, version); \
    return &flight;                                                                               \
  }
