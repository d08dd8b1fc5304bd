// Asks the C library for time and chance: one letter of a message, one question; numbers come back
// as 8 little-endian bytes each on "answers".
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <pthread.h>
#include <random>
#include <sys/random.h>
#include <sys/time.h>
#include <thread>
#include <unistd.h>

#include "orrery_flight.hpp"
#include "orrery_messages.h"

namespace {

using orrery_abi::Bytes;
using orrery_abi::Host;
using orrery_abi::Port;

std::int64_t read(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return t.tv_sec * 1000000000 + t.tv_nsec;
}

void* nothing(void*) {
  return nullptr;
}

class Questions {
 public:
  Questions(Host host, const orrery_boot&) : host_(host) {}

  std::int32_t ask(std::int64_t, Bytes message) {
    for (std::uint32_t i = 0; i < message.size; ++i) {
      answer(static_cast<const char*>(message.data)[i]);
    }
    return ORRERY_OK;
  }
  std::int32_t tick(std::int64_t) { return ORRERY_OK; }

  static const Port<Questions> (&ports())[2] {
    static const Port<Questions> table[2] = {
        {1, ORRERY_IN, ORRERY_PACKET, "ask", 64, &Questions::ask},
        {2, ORRERY_OUT, ORRERY_PACKET, "answers", 8, nullptr}};
    return table;
  }

 private:
  void say(std::int64_t value) {
    unsigned char bytes[8];
    orrery_put_i64(bytes, value);
    host_.output(2, {bytes, 8});
  }

  void answer(char question) {
    timespec half = {0, 500000000};
    std::uint64_t bits = 0;
    switch (question) {
      case 'r':
        return say(read(CLOCK_REALTIME));
      case 'm':
        return say(read(CLOCK_MONOTONIC));
      case 't':
        return say(time(nullptr));
      case 'v': {
        timeval t{};
        gettimeofday(&t, nullptr);
        return say(t.tv_sec * 1000000 + t.tv_usec);
      }
      case 'c':
        return say(std::chrono::duration_cast<std::chrono::nanoseconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count());
      case 's':
        return say(std::chrono::duration_cast<std::chrono::nanoseconds>(
                       std::chrono::steady_clock::now().time_since_epoch())
                       .count());
      case 'k':
        return say(clock());
      case 'N':
        return say(nanosleep(&half, nullptr));
      case 'U':
        return say(usleep(250000));
      case 'S':
        return say(static_cast<std::int64_t>(sleep(2)));
      case 'F':
        std::this_thread::sleep_for(std::chrono::milliseconds(125));
        return;
      case 'A': {
        const std::int64_t until = read(CLOCK_MONOTONIC) + 1000000000;
        timespec t = {until / 1000000000, until % 1000000000};
        return say(clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr));
      }
      case '1':
        return say(rand());
      case '2':
        return say(random());
      case '3':
        srand(42);
        return;
      case '4':
        return say(std::random_device()());
      case '5':
        getrandom(&bits, sizeof bits, 0);
        return say(static_cast<std::int64_t>(bits));
      case '6':
        getentropy(&bits, sizeof bits);
        return say(static_cast<std::int64_t>(bits));
      case 'T': {
        pthread_t thread;
        pthread_create(&thread, nullptr, nothing, nullptr);
        pthread_join(thread, nullptr);
        return say(1);
      }
      default:
        return;
    }
  }

  Host host_;
};

}  // namespace

ORRERY_FLIGHT_LIBRARY(Questions, "questions", "1.0")
