/// Page and script of a campaign's report; sources in report/.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <string_view>

namespace orrery {

std::string_view campaign_html();
std::string_view campaign_script();

}  // namespace orrery
