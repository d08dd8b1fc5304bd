/// Numbers as the written files have them: the same bytes in every locale.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <string>

namespace orrery {

/// Appends the shortest decimal that reads back as the same double: "0.1", "1e-09", "-0", "nan"
/// (whatever the sign and the payload), "inf", "-inf".
void append_number(std::string& out, double value);
void append_number(std::string& out, std::int64_t value);
void append_number(std::string& out, std::uint64_t value);

/// Appends with exactly `decimals` digits after the point, rounded to nearest.
/// @throws std::invalid_argument  not finite, or decimals outside 0 to 17.
void append_fixed(std::string& out, double value, int decimals);

}  // namespace orrery
