// Sends its targets in the order of their addresses: a set of pointers sorts by where they lie.
#include <memory>
#include <set>
#include <vector>

#include "orrery_flight.hpp"

namespace {

struct Target {
  unsigned char number;
  char rest[100];
};

class PointerOrder {
 public:
  PointerOrder(orrery_abi::Host host, const orrery_boot& boot) : host_(host) {
    for (unsigned char number = 0; number < 8; ++number) {
      targets_.push_back(std::unique_ptr<Target>(new Target{number, {}}));
      in_order_.insert(targets_.back().get());
    }
    host_.request_tick(boot.now_ns);
  }
  std::int32_t tick(std::int64_t now_ns) {
    unsigned char numbers[8];
    std::uint32_t n = 0;
    for (const Target* target : in_order_) numbers[n++] = target->number;
    host_.output(1, {numbers, n});
    host_.request_tick(now_ns + 10000000000);
    return ORRERY_OK;
  }
  using P = orrery_abi::Port<PointerOrder>;
  static const P (&ports())[1] {
    static const P table[1] = {{1, ORRERY_OUT, ORRERY_PACKET, "crosslink", 64, nullptr}};
    return table;
  }

 private:
  orrery_abi::Host host_;
  std::vector<std::unique_ptr<Target>> targets_;
  std::set<const Target*> in_order_;
};

}  // namespace

ORRERY_FLIGHT_LIBRARY(PointerOrder, "pointer_order", "1.0")
