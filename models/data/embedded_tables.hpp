/// The text of the tables in models/data, compiled in. Sources and licences: README.md beside this
/// file.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string_view>

namespace orrery::embedded {

/// GGM05S to degree and order 60, ICGEM layout; read it with GravityField::parse.
std::string_view ggm05s_d60();

}  // namespace orrery::embedded
