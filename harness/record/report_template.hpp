/// The page around the data of a report.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string_view>

namespace orrery {

/// HTML with the word @DATA@ where the report's JSON goes.
std::string_view report_template();

}  // namespace orrery
