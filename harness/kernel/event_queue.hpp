/// Pending events, earliest first.
#pragma once

#include <cstddef>
#include <orrery/harness/kernel/event.hpp>

namespace orrery {

class EventQueue {
 public:
  std::size_t size() const { return 0; }
};

}  // namespace orrery
