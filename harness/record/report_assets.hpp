/// The parts of report.html and index.html that are the same in all of them; sources in report/.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace orrery {

std::string_view report_html();
std::string_view index_html();
std::string_view report_style();
std::string_view report_script();

/// `page` with each "{{name}}" replaced by its text; texts are not searched in turn.
std::string filled_in(std::string_view page,
                      const std::vector<std::pair<std::string_view, std::string_view>>& texts);

}  // namespace orrery
