/// Units that several of these tests count in.
#pragma once

#include <numbers>

namespace orrery {

inline constexpr double kDegree = std::numbers::pi / 180;
inline constexpr double kArcsecond = kDegree / 3600;

}  // namespace orrery
