// A static whose constructor crashes: "c" does so, "u" uses it.
#include <cstdlib>

#include "orrery_flight.hpp"

namespace {

using orrery_abi::Bytes;
using orrery_abi::Host;
using orrery_abi::Port;

struct Table {
  explicit Table(bool crashes) : value(7) {
    if (crashes) std::abort();
  }
  unsigned char value;
};

const Table& the_table(bool crashes) {
  static const Table table(crashes);
  return table;
}

class HalfRun {
 public:
  HalfRun(Host host, const orrery_boot&) : host_(host) {}
  std::int32_t order(std::int64_t, Bytes message) {
    const char what = *static_cast<const char*>(message.data);
    if (what == 'n') return ORRERY_OK;
    host_.output(2, {&the_table(what == 'c').value, 1});
    return ORRERY_OK;
  }
  std::int32_t tick(std::int64_t) { return ORRERY_OK; }
  static const Port<HalfRun> (&ports())[2] {
    static const Port<HalfRun> table[2] = {
        {1, ORRERY_IN, ORRERY_PACKET, "order", 8, &HalfRun::order},
        {2, ORRERY_OUT, ORRERY_PACKET, "values", 8, nullptr}};
    return table;
  }

 private:
  Host host_;
};

}  // namespace

ORRERY_FLIGHT_LIBRARY(HalfRun, "half_run", "1.0")
