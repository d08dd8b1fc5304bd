// One defect per library: DEFECT says which. A command of n bytes is answered with telemetry; the
// defect waits for a command whose first byte is 'x'.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <pthread.h>
#include <stdexcept>

#include "orrery_flight.hpp"

#define NULL_DEREFERENCE 1
#define STACK_OVERFLOW 2
#define ENDLESS_LOOP 3
#define UNGUARDED_THREAD 4
#define EXCEPTION 5
#define GLOBAL_STATE 6
#define LEAK 7
#define DOUBLE_FREE 8
#define OVERRUN 9
#define UNINITIALISED_READ 10

#define NOINLINE __attribute__((noinline))  // to be seen on the stack

namespace {

using orrery_abi::Bytes;
using orrery_abi::Host;
using orrery_abi::Port;

struct Solution {
  double position_m[3];
};

class Defective {
 public:
  Defective(Host host, const orrery_boot&) : host_(host) {}

  std::int32_t command(std::int64_t, Bytes message) {
    const char* text = static_cast<const char*>(message.data);
    if (message.size == 0) return ORRERY_REJECTED;
    std::uint32_t answer = message.size;
    if (text[0] == 'x') answer = misbehave(message);
    return host_.output(2, {&answer, sizeof answer});
  }
  std::int32_t tick(std::int64_t) { return ORRERY_OK; }

  static const Port<Defective> (&ports())[2] {
    static const Port<Defective> table[2] = {
        {1, ORRERY_IN, ORRERY_PACKET, "command", 64, &Defective::command},
        {2, ORRERY_OUT, ORRERY_PACKET, "telemetry", 4, nullptr}};
    return table;
  }

 private:
  std::uint32_t misbehave(Bytes message);

  Host host_;
  [[maybe_unused]] Solution* solution_ = nullptr;  // of the GNSS receiver; none yet
};

#if DEFECT == NULL_DEREFERENCE
NOINLINE double radius_m(const volatile Solution* solution) {
  return solution->position_m[0];
}
std::uint32_t Defective::misbehave(Bytes) {
  return static_cast<std::uint32_t>(radius_m(solution_));
}

#elif DEFECT == STACK_OVERFLOW
NOINLINE std::uint32_t parse_nested(const volatile char* text, std::uint32_t depth) {
  volatile char frame[512];
  frame[0] = *text;
  if (frame[0] == ')') return depth;  // the bracket that the sender forgot
  return parse_nested(text, depth + 1) + static_cast<std::uint32_t>(frame[0] == 0);
}
std::uint32_t Defective::misbehave(Bytes message) {
  return parse_nested(static_cast<const char*>(message.data), 0);
}

#elif DEFECT == ENDLESS_LOOP
volatile std::uint32_t expected = 8;
NOINLINE std::uint32_t collect(std::uint32_t received) {
  std::uint32_t total = 0;
  while (total != expected + 1) total = received;  // nobody sends the rest
  return total;
}
std::uint32_t Defective::misbehave(Bytes message) {
  return collect(message.size + 64);
}

#elif DEFECT == UNGUARDED_THREAD
void* write_log(void*) {
  return nullptr;
}
NOINLINE std::uint32_t start_logger() {
  pthread_t logger;
  if (pthread_create(&logger, nullptr, write_log, nullptr) != 0) return 1;
  return static_cast<std::uint32_t>(pthread_join(logger, nullptr)) + 1;  // no tail call
}
std::uint32_t Defective::misbehave(Bytes) {
  return start_logger();
}

#elif DEFECT == EXCEPTION
NOINLINE void check(std::uint32_t size) {
  if (size > 1) throw std::out_of_range("command of an unknown length");
}
std::uint32_t Defective::misbehave(Bytes message) {
  check(message.size);
  return 0;
}

#elif DEFECT == GLOBAL_STATE
std::uint32_t commands_heard = 0;  // of both spacecraft, where they share the library
std::uint32_t Defective::misbehave(Bytes) {
  return ++commands_heard;
}

#elif DEFECT == LEAK
char* volatile last_command = nullptr;  // and the one before is forgotten
NOINLINE void keep(const void* text, std::uint32_t size) {
  last_command = static_cast<char*>(std::malloc(size));
  std::memcpy(last_command, text, size);
}
std::uint32_t Defective::misbehave(Bytes message) {
  keep(message.data, message.size);
  return message.size;
}

#elif DEFECT == DOUBLE_FREE
void* volatile buffer = nullptr;
NOINLINE void discard() {
  std::free(buffer);
  asm volatile("");  // no tail call, which would leave this function off the stack
}
std::uint32_t Defective::misbehave(Bytes message) {
  buffer = std::malloc(message.size);
  discard();
  discard();  // on the way out, as on the way in
  return message.size;
}

#elif DEFECT == OVERRUN
NOINLINE std::uint32_t copy_name(const char* text, std::uint32_t size) {
  char* volatile name = static_cast<char*>(std::malloc(8));  // long enough for every name so far
  for (std::uint32_t i = 0; i < size; ++i) name[i] = text[i];
  const std::uint32_t first = static_cast<unsigned char>(name[0]);
  std::free(name);
  return first;
}
std::uint32_t Defective::misbehave(Bytes message) {
  return copy_name(static_cast<const char*>(message.data), message.size);
}

#elif DEFECT == UNINITIALISED_READ
struct Report {
  std::uint32_t bytes, mode;
};
NOINLINE std::uint32_t report(std::uint32_t bytes) {
  volatile Report* made = static_cast<volatile Report*>(std::malloc(sizeof(Report)));
  made->bytes = bytes;
  const std::uint32_t mode = made->mode;  // of which nobody thought
  std::free(const_cast<Report*>(made));
  return mode;
}
std::uint32_t Defective::misbehave(Bytes message) {
  return report(message.size);
}

#endif

}  // namespace

ORRERY_FLIGHT_LIBRARY(Defective, "defective", "1.0")
