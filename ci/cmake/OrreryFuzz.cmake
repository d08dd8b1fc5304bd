# orrery_fuzz(name SOURCES ... [LINK ...] [RUNS n]): a libFuzzer program, which ctest runs for `n` inputs
# (default 20000) under the address and undefined-behaviour sanitizers, label `fuzz`.
#
# SOURCES holds LLVMFuzzerTestOneInput and the sources of the project that it is to explore: only they
# are instrumented, what LINK brings is not. Inputs start from corpus/<name>/ beside the caller; those
# that reach new code are kept in found/<name>/ of the build folder. To run longer: <name> found/<name>.
#
# Without clang and its libFuzzer, or with ORRERY_FUZZ off, the function does nothing.
include(CheckCXXSourceCompiles)

set(CMAKE_REQUIRED_FLAGS -fsanitize=fuzzer,address,undefined)
check_cxx_source_compiles("#include <cstddef>
extern \"C\" int LLVMFuzzerTestOneInput(const unsigned char*, std::size_t) { return 0; }"
  ORRERY_HAS_LIBFUZZER)
unset(CMAKE_REQUIRED_FLAGS)
option(ORRERY_FUZZ "Build the fuzz targets, which needs clang and libFuzzer" ${ORRERY_HAS_LIBFUZZER})

function(orrery_fuzz name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "RUNS" "SOURCES;LINK")
  if(NOT ORRERY_FUZZ)
    return()
  endif()
  if(NOT arg_RUNS)
    set(arg_RUNS 20000)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK} orrery_numerics orrery_warnings)
  target_compile_options(${name} PRIVATE
    -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(${name} PRIVATE -fsanitize=fuzzer,address,undefined)

  set(found ${CMAKE_CURRENT_BINARY_DIR}/found/${name})
  file(MAKE_DIRECTORY ${found})
  set(seeds ${CMAKE_CURRENT_SOURCE_DIR}/corpus/${name})
  if(NOT IS_DIRECTORY ${seeds})
    set(seeds "")
  endif()
  # The first folder receives what is found, the others are only read.
  add_test(NAME ${name} COMMAND ${name} -runs=${arg_RUNS} -seed=1
    -artifact_prefix=${CMAKE_CURRENT_BINARY_DIR}/${name}- ${found} ${seeds})
  set_tests_properties(${name} PROPERTIES LABELS fuzz TIMEOUT 300)
endfunction()
