// Links libraries of its own: a message is answered with what they have counted, as text; 'x' makes
// one of them see a null pointer.
#include <cstdio>

#include "orrery_flight.hpp"

extern "C" int count_outer();
extern "C" int count_inner();

namespace {

using orrery_abi::Bytes;
using orrery_abi::Host;
using orrery_abi::Port;

class Linked {
 public:
  Linked(Host host, const orrery_boot&) : host_(host) {}
  std::int32_t count(std::int64_t, Bytes) {
    char text[16];
    const int length = std::snprintf(text, sizeof text, "%d", count_outer());
    return host_.output(2, {text, static_cast<std::uint32_t>(length)});
  }
  std::int32_t tick(std::int64_t) { return count_inner(); }
  static const Port<Linked> (&ports())[2] {
    static const Port<Linked> table[2] = {
        {1, ORRERY_IN, ORRERY_PACKET, "count", 64, &Linked::count},
        {2, ORRERY_OUT, ORRERY_PACKET, "counted", 64, nullptr}};
    return table;
  }

 private:
  Host host_;
};

}  // namespace

ORRERY_FLIGHT_LIBRARY(Linked, "linked", "1.0")
