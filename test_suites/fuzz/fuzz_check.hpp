/// What every fuzz target of a reader does: any text is read or refused in the one documented way.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string_view>

namespace orrery {

/// Ends the program, so that libFuzzer keeps the input.
inline void fuzz_check(bool ok, const char* what) {
  if (ok) return;
  std::fprintf(stderr, "property violated: %s\n", what);
  std::abort();
}

/// What `parse(text, "fuzz_input")` gives, or none if it throws std::invalid_argument that names
/// the source. Any other exception escapes and is a finding.
template <class Parse>
auto parsed_or_refused(Parse parse, const std::uint8_t* data, std::size_t size)
    -> std::optional<decltype(parse(std::string_view(), std::string_view()))> {
  try {
    return parse(std::string_view(reinterpret_cast<const char*>(data), size), "fuzz_input");
  } catch (const std::invalid_argument& error) {
    const std::string_view what = error.what();
    fuzz_check(what.find("fuzz_input") != what.npos, "a refusal names its source");
    return {};
  }
}

}  // namespace orrery
