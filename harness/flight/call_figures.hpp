/// What calls of one kind have cost so far: a row of the paper's Table 5.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace orrery {

struct CallFigures {
  std::string call = {};  // an input port, "create" or "tick"
  std::uint64_t calls = 0;
  Duration host_mean{0}, host_max{0};          // for reports only: they repeat in no run
  Duration modelled_mean{0}, modelled_max{0};  // execution time in simulated time
  std::uint64_t work_mean = 0, work_max = 0;   // edges, where the library counts them
};

/// A table with a row per kind of call, for people.
std::string to_string(const std::vector<CallFigures>& figures);

}  // namespace orrery
