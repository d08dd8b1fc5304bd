/// Numbers as text, the same in every locale.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <string>

namespace orrery {

/// Shortest decimal that reads back as the same double: "0.1", "1e+300", "nan", "inf".
std::string to_text(double value);

/// The lowest `digits` hexadecimal digits, leading zeros kept. 1 <= digits <= 16.
std::string hex_digits(std::uint64_t value, int digits);

}  // namespace orrery
