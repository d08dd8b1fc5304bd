/// Pending events, earliest first.
#pragma once

#include <orrery/harness/kernel/event.hpp>

#include <cstddef>

namespace orrery {

class EventQueue {
 public:
  std::size_t size() const { return 0; }
};

}  // namespace orrery
