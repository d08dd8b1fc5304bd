// Draws from a generator whose seed is the host's entropy.
#include <random>

#include "orrery_flight.hpp"

namespace {

class Unseeded {
 public:
  Unseeded(orrery_abi::Host host, const orrery_boot& boot)
      : host_(host), generator_(std::random_device{}()) {
    host_.request_tick(boot.now_ns);
  }
  std::int32_t tick(std::int64_t now_ns) {
    const std::uint64_t drawn = generator_();
    host_.output(1, {&drawn, sizeof drawn});
    host_.request_tick(now_ns + 10000000000);
    return ORRERY_OK;
  }
  using P = orrery_abi::Port<Unseeded>;
  static const P (&ports())[1] {
    static const P table[1] = {{1, ORRERY_OUT, ORRERY_PACKET, "crosslink", 64, nullptr}};
    return table;
  }

 private:
  orrery_abi::Host host_;
  std::mt19937_64 generator_;
};

}  // namespace

ORRERY_FLIGHT_LIBRARY(Unseeded, "unseeded", "1.0")
