#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/virtual_services.hpp>
#include <orrery/harness/heap/interposition.hpp>

#include <chrono>
#include <cstdio>
#include <cstring>

namespace orrery::internal {
namespace {

using namespace std::chrono;

constexpr std::int64_t kGpsEpoch_unix_s = 315'964'800;  // 1980-01-06

constexpr sys_days kLeapSeconds[] = {
    1981y / 7 / 1, 1982y / 7 / 1, 1983y / 7 / 1, 1985y / 7 / 1, 1988y / 1 / 1, 1990y / 1 / 1,
    1991y / 1 / 1, 1992y / 7 / 1, 1993y / 7 / 1, 1994y / 7 / 1, 1996y / 1 / 1, 1997y / 7 / 1,
    1999y / 1 / 1, 2006y / 1 / 1, 2009y / 1 / 1, 2012y / 7 / 1, 2015y / 7 / 1, 2017y / 1 / 1};

// Own streams of a process outside of a run.
constexpr std::uint64_t kNoSeed = 0;

}  // namespace

std::int64_t unix_ns(std::int64_t onboard_ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  std::int64_t leaps = 0;
  for (const sys_days day : kLeapSeconds) {
    const std::int64_t begins_s =
        seconds(day.time_since_epoch()).count() - kGpsEpoch_unix_s + leaps + 1;
    if (onboard_ns < begins_s * kSecond_ns) break;
    ++leaps;
  }
  return onboard_ns + (kGpsEpoch_unix_s - leaps) * kSecond_ns;
}

VirtualServices::VirtualServices(const FlightProcessOptions& options)
    : mode_(options.services), options_(options) {
  if (options.random == nullptr) own_random_ = std::make_unique<RandomStreams>(kNoSeed);
}

void VirtualServices::begin_call(SimTime truth, std::int64_t onboard_ns, bool boots) {
  if (boots) booted_ = truth;
  onboard_ns_ = onboard_ns;
  since_boot_ns_ = to_ns(truth - booted_);
  reads_ = slept_ns_ = 0;
}

bool VirtualServices::takes(const char* function) const {
  if (mode_ != HostServices::kStrict) return mode_ == HostServices::kVirtual;
  char message[96];
  std::snprintf(message, sizeof message, "%s called, which this test forbids", function);
  end_running_call(CrashKind::kForbiddenCall, message);
  return false;
}

std::int64_t VirtualServices::now_ns(clockid_t clock) const {
  const std::int64_t in_call_ns = reads_ * kRead_ns + slept_ns_;
  const bool civil = clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE;
  return civil ? unix_ns(onboard_ns_ + in_call_ns) : since_boot_ns_ + in_call_ns;
}

bool VirtualServices::read_clock(const char* function, clockid_t clock, std::int64_t& ns) {
  if (!takes(function)) return false;
  ns = now_ns(clock);
  ++reads_;
  return true;
}

bool VirtualServices::sleep(const char* function, std::int64_t ns) {
  if (!takes(function)) return false;
  slept_ns_ += ns > 0 ? ns : 0;
  return true;
}

bool VirtualServices::sleep_until(const char* function, clockid_t clock, std::int64_t ns) {
  return sleep(function, ns - now_ns(clock));
}

RandomStream& VirtualServices::stream(const char* purpose) {
  RandomStreams& streams = own_random_ != nullptr ? *own_random_ : *options_.random;
  return streams.stream(options_.spacecraft, options_.process, purpose);
}

bool VirtualServices::random_bytes(const char* function, void* to, std::size_t bytes) {
  if (!takes(function)) return false;
  for (std::size_t i = 0; i < bytes; i += sizeof(std::uint64_t)) {
    std::uint64_t bits = 0;
    {
      const SimulatorScope scope;  // a stream's first draw makes it
      bits = stream("entropy").bits();
    }
    std::memcpy(static_cast<char*>(to) + i, &bits, std::min(bytes - i, sizeof bits));
  }
  return true;
}

bool VirtualServices::random_number(const char* function, std::int32_t& number) {
  if (!takes(function)) return false;
  const SimulatorScope scope;
  RandomStream& source = seeded_ ? *seeded_ : stream("rand");
  number = static_cast<std::int32_t>(source.bits() >> 33);
  return true;
}

bool VirtualServices::seed(const char* function, unsigned value) {
  if (!takes(function)) return false;
  seeded_.emplace(value);
  return true;
}

bool VirtualServices::start_thread(const char* function) {
  if (mode_ == HostServices::kHost) return false;
  char message[96];
  std::snprintf(message, sizeof message, "%s called: flight code runs in one thread", function);
  end_running_call(CrashKind::kForbiddenCall, message);
  return false;
}

// ---- the hooks

namespace {

VirtualServices* services() {
  return flight_code_is_running() ? running_process()->services : nullptr;
}

constexpr ServiceHooks kServiceHooks = {
    [](const char* function, clockid_t clock, std::int64_t& ns) {
      VirtualServices* s = services();
      return s != nullptr && s->read_clock(function, clock, ns);
    },
    [](const char* function, std::int64_t ns) {
      VirtualServices* s = services();
      return s != nullptr && s->sleep(function, ns);
    },
    [](const char* function, clockid_t clock, std::int64_t ns) {
      VirtualServices* s = services();
      return s != nullptr && s->sleep_until(function, clock, ns);
    },
    [](const char* function, void* to, std::size_t bytes) {
      VirtualServices* s = services();
      return s != nullptr && s->random_bytes(function, to, bytes);
    },
    [](const char* function, std::int32_t& number) {
      VirtualServices* s = services();
      return s != nullptr && s->random_number(function, number);
    },
    [](const char* function, unsigned value) {
      VirtualServices* s = services();
      return s != nullptr && s->seed(function, value);
    },
    [](const char* function) {
      VirtualServices* s = services();
      return s != nullptr && s->start_thread(function);
    }};

}  // namespace

void install_service_hooks() {
  service_hooks = &kServiceHooks;
}

}  // namespace orrery::internal
