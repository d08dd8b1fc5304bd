/// What the C library tells flight code of time and chance: the spacecraft's clock and the run's
/// random streams in place of the host's.
#pragma once

#include <orrery/harness/flight/flight_options.hpp>
#include <orrery/harness/kernel/random.hpp>

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <memory>
#include <optional>

namespace orrery::internal {

/// UTC as POSIX counts it, of what an onboard clock shows (GPS). Leap seconds up to that of
/// 2017-01-01, the last one (IERS Bulletin C).
std::int64_t unix_ns(std::int64_t onboard_ns);

/// Of one process.
///
/// Clock    Within a call it reads start + 1 us per earlier read + sleeps; realtime is the onboard
///          clock, everything else counts from `create`, whatever the onboard clock does. While
///          static constructors run there is no clock yet: it reads 0, the GPS epoch.
/// Chance   rand() and random() go on from the run's stream "rand" until srand(); what promises
///          entropy draws from the stream "entropy".
/// Strict   The call ends the process, by name. Threads do so with HostServices::kVirtual as well.
class VirtualServices {
 public:
  explicit VirtualServices(const FlightProcessOptions& options);

  void begin_call(SimTime truth, std::int64_t onboard_ns, bool boots);
  /// Time that clock reads and sleeps of this call took: it lengthens the execution time.
  Duration spent() const { return Duration(reads_ * kRead_ns + slept_ns_); }

  // As flight code, of the function of that name. False: use the host's.
  bool read_clock(const char* function, clockid_t clock, std::int64_t& ns);
  bool sleep(const char* function, std::int64_t ns);
  bool sleep_until(const char* function, clockid_t clock, std::int64_t ns);
  bool random_bytes(const char* function, void* to, std::size_t bytes);
  bool random_number(const char* function, std::int32_t& number);  // 0 ... 2^31 - 1
  bool seed(const char* function, unsigned value);
  bool start_thread(const char* function);

  /// What the realtime clock shows, without counting as a read of it.
  std::int64_t unix_now_ns() const { return now_ns(CLOCK_REALTIME); }

 private:
  static constexpr std::int64_t kRead_ns = 1000;

  bool takes(const char* function) const;
  std::int64_t now_ns(clockid_t clock) const;
  RandomStream& stream(const char* purpose);

  HostServices mode_;
  const FlightProcessOptions& options_;
  std::unique_ptr<RandomStreams> own_random_;
  std::optional<RandomStream> seeded_;  // since srand()
  std::int64_t onboard_ns_ = 0, since_boot_ns_ = 0;
  SimTime booted_;
  std::int64_t reads_ = 0, slept_ns_ = 0;
};

/// Makes the interposed functions of this program (services.cpp of harness/heap) come here.
void install_service_hooks();

}  // namespace orrery::internal
