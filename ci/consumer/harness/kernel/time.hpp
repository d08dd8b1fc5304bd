// Named like a header of Orrery's: whoever includes "harness/kernel/time.hpp" here wants this one.
#pragma once

namespace acme {
constexpr bool kOwnTimeHeader = true;
}
