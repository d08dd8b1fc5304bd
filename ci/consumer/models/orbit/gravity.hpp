// Named like a header of Orrery's: whoever includes "models/orbit/gravity.hpp" here wants this one.
#pragma once

namespace acme {
constexpr bool kOwnGravityHeader = true;
}
