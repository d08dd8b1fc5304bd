#include <orrery/harness/gtest/flags.hpp>
#include <orrery/harness/gtest/seeds.hpp>

#include <ostream>
#include <stdexcept>
#include <vector>

namespace orrery {

testing::internal::ParamGenerator<RunId> Seeds(int n) {
  if (n < 1)
    throw std::invalid_argument("Seeds: n = " + std::to_string(n) + ", expected at least 1");
  if (flags().run) return testing::ValuesIn({RunId{flags().seed + *flags().run, *flags().run}});
  const int count = flags().runs.value_or(n);
  std::vector<RunId> runs;
  for (int i = 0; i < count; ++i) {
    runs.push_back({flags().seed + static_cast<std::uint64_t>(i), static_cast<std::uint32_t>(i)});
  }
  return testing::ValuesIn(runs);
}

void PrintTo(const RunId& run, std::ostream* os) {
  *os << "seed " << run.seed << " (run " << run.index << ")";
}

}  // namespace orrery
