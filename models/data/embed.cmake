# Run at build time: cmake -D INPUT=<table> -D OUTPUT=<cpp> -D FUNCTION=<name> -P embed.cmake
# Writes the bytes of a table as a C++ source that defines orrery::embedded::<name>(). An array of bytes,
# because string literals above 65536 characters are beyond what compilers must accept.
file(READ ${INPUT} bytes HEX)
string(LENGTH "${bytes}" digits)
math(EXPR size "${digits} / 2")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
string(REPEAT "0x..," 20 row)
string(REGEX REPLACE "(${row})" "\\1\n" bytes "${bytes}")
get_filename_component(table ${INPUT} NAME)
file(WRITE ${OUTPUT} "// Made from models/data/${table} by embed.cmake.
#include <orrery/models/data/embedded_tables.hpp>

namespace orrery::embedded {
namespace {
constexpr unsigned char kBytes[] = {
${bytes}};
}  // namespace

std::string_view ${FUNCTION}() {
  return {reinterpret_cast<const char*>(kBytes), ${size}};
}

}  // namespace orrery::embedded
")
