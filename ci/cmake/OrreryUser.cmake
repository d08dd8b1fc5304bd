# What a user calls. The same file serves the build tree, FetchContent and an installed Orrery.
#
#   orrery_add_flight_library(<name> SOURCES <file>... [LINK <target>...] [COUNT_WORK]
#                             [CROSS armhf|armel|arm64...])
#   orrery_add_test(<name> SOURCES <file>... FLIGHT <target>... [LINK <target>...]
#                   [LABELS <label>...] [TIMEOUT <seconds>] [SHARDS <n>])
include_guard(GLOBAL)
include(${CMAKE_CURRENT_LIST_DIR}/OrreryCross.cmake)

# A package of flight software as a module that the harness can load, lib<name>.so.
#
# It sees orrery::flight_abi and LINK, and of the simulator nothing: including one of its headers is a
# compile error. Hidden visibility leaves the entry point as the only exported symbol; asserts stay in
# every build type. With COUNT_WORK it counts the edges of its control flow (orrery_work.h), for work
# budgets and modelled execution time. With CROSS it is built for those processors, too, for
# --orrery_target=SPACECRAFT=qemu-arm (OrreryCross.cmake). The property ORRERY_FLIGHT_LIBRARY of the target is TRUE.
function(orrery_add_flight_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "COUNT_WORK" "" "SOURCES;LINK;CROSS")
  orrery_check_arguments("orrery_add_flight_library(${name})" SOURCES)
  foreach(target IN LISTS arg_LINK)
    if(target MATCHES "^orrery(::|_)(kernel|models|harness|fixtures|allocator|main)$")
      message(FATAL_ERROR "orrery_add_flight_library(${name}): LINK ${target} is the simulator, "
        "which flight software must not see; it may link orrery::flight_abi and its own libraries")
    endif()
  endforeach()

  include(${CMAKE_CURRENT_FUNCTION_LIST_DIR}/OrreryNumerics.cmake)
  add_library(${name} MODULE ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE orrery::flight_abi ${arg_LINK})
  target_compile_definitions(${name} PRIVATE ORRERY_FLIGHT_BUILD)
  target_compile_options(${name} PRIVATE ${ORRERY_NUMERIC_FLAGS} $<$<COMPILE_LANGUAGE:C,CXX>:-UNDEBUG>
    # Templates of the standard library have default visibility whatever we say. As STB_GNU_UNIQUE
    # their statics would be one for all instances of the library; clang never emits that binding.
    $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fno-gnu-unique>)
  set_target_properties(${name} PROPERTIES
    PREFIX lib   # so that the loader can rename a copy in place
    C_VISIBILITY_PRESET hidden
    CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON
    POSITION_INDEPENDENT_CODE ON
    ORRERY_FLIGHT_LIBRARY TRUE)
  if(arg_COUNT_WORK)
    orrery_count_work(${name})
  endif()
  orrery_refuse_undefined_symbols(${name})
  orrery_use_project_flags(${name})
  orrery_cross_build(${name} ${arg_CROSS})
endfunction()

# A GoogleTest program that flies the libraries in FLIGHT: SHARED, MODULE or IMPORTED targets, which
# tests name as they are named here. Links orrery::fixtures, our main and the allocator.
#
# ctest gets one entry per test, or, with SHARDS n, n entries that share the tests between them.
function(orrery_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "TIMEOUT;SHARDS" "SOURCES;FLIGHT;LINK;LABELS")
  orrery_check_arguments("orrery_add_test(${name})" SOURCES)
  if(DEFINED arg_SHARDS AND NOT arg_SHARDS MATCHES "^[1-9][0-9]*$")
    message(FATAL_ERROR "orrery_add_test(${name}): SHARDS ${arg_SHARDS} is not a positive number")
  endif()

  orrery_add_program_that_flies(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK})
  orrery_use_project_flags(${name})
  orrery_name_flight_targets(${name} ${arg_FLIGHT})
  if(DEFINED arg_SHARDS)
    orrery_add_shards(${name} ${arg_SHARDS} "${arg_LABELS}" "${arg_TIMEOUT}")
  else()
    orrery_discover_tests(${name} "${arg_LABELS}" "${arg_TIMEOUT}")
  endif()
endfunction()

# ---- internal

function(orrery_add_program_that_flies name)
  include(${CMAKE_CURRENT_FUNCTION_LIST_DIR}/OrreryNumerics.cmake)
  add_executable(${name} ${ARGN})
  target_link_libraries(${name} PRIVATE orrery::fixtures orrery::main orrery::allocator)
  target_compile_options(${name} PRIVATE ${ORRERY_NUMERIC_FLAGS})
endfunction()

# Reads the arg_* of the caller's cmake_parse_arguments.
function(orrery_check_arguments call required)
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "${call}: unknown arguments: ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_${required})
    message(FATAL_ERROR "${call}: ${required} is missing or empty")
  endif()
endfunction()

# The file of the counter lies beside this one where Orrery is installed.
function(orrery_count_work name)
  set(counter ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/orrery_work.cpp)
  if(NOT EXISTS ${counter})
    set(counter ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../../flight_sw/abi/orrery_work.cpp)
  endif()
  target_sources(${name} PRIVATE ${counter})
  target_compile_options(${name} PRIVATE
    $<$<COMPILE_LANG_AND_ID:C,GNU>:-fsanitize-coverage=trace-pc>
    $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fsanitize-coverage=trace-pc>
    $<$<COMPILE_LANG_AND_ID:C,Clang>:-fsanitize-coverage=edge,no-prune,trace-pc>
    $<$<COMPILE_LANG_AND_ID:CXX,Clang>:-fsanitize-coverage=edge,no-prune,trace-pc>)
endfunction()

# A symbol that nobody defines would otherwise be found when the library is loaded, or when it is
# called. clang leaves the sanitizers' symbols undefined on purpose: the executable brings them.
function(orrery_refuse_undefined_symbols name)
  get_directory_property(options COMPILE_OPTIONS)
  set(flags "${CMAKE_C_FLAGS} ${CMAKE_CXX_FLAGS} ${options} ${ORRERY_SANITIZE}")
  if(CMAKE_BUILD_TYPE)
    string(TOUPPER ${CMAKE_BUILD_TYPE} config)
    string(APPEND flags " ${CMAKE_C_FLAGS_${config}} ${CMAKE_CXX_FLAGS_${config}}")
  endif()
  if(NOT ORRERY_SANITIZE AND NOT flags MATCHES "-fsanitize")
    target_link_options(${name} PRIVATE LINKER:--no-undefined)
  endif()
endfunction()

# In Orrery's own tree: warnings, and the sanitizers everywhere that its libraries have them.
function(orrery_use_project_flags name)
  if(TARGET orrery_sanitizers)
    target_link_libraries(${name} PRIVATE orrery_sanitizers)
  endif()
  if(TARGET orrery_warnings AND PROJECT_NAME STREQUAL "orrery")
    target_link_libraries(${name} PRIVATE orrery_warnings)
  endif()
endfunction()

# Compiles into `name` a table from the names of flight targets to their files, so that neither a test
# nor its command line holds a path.
function(orrery_name_flight_targets name)
  set(table "")
  foreach(target IN LISTS ARGN)
    orrery_check_flight_target(${name} ${target})
    add_dependencies(${name} ${target})
    string(APPEND table "    {R\"~(${target})~\", R\"~($<TARGET_FILE:${target}>)~\"},\n")
    get_target_property(others ${target} ORRERY_CROSS_FILES)
    foreach(other IN LISTS others)
      if(other MATCHES "^(.*@.*)=(.*)$")
        string(APPEND table "    {R\"~(${CMAKE_MATCH_1})~\", R\"~(${CMAKE_MATCH_2})~\"},\n")
      endif()
    endforeach()
  endforeach()
  if(NOT table)
    return()
  endif()
  set(file ${CMAKE_CURRENT_BINARY_DIR}/${name}_flight_targets_$<CONFIG>.cpp)
  file(GENERATE OUTPUT ${file} CONTENT
"// Written by orrery_add_test(${name}).
#include <orrery/harness/flight/flight_library.hpp>

namespace {
struct FlightTarget {
  const char* name;
  const char* path;
};
const FlightTarget kFlightTargets[] = {
${table}};
const bool kRegistered = [] {
  for (const FlightTarget& t : kFlightTargets) orrery::register_flight_target(t.name, t.path);
  orrery::register_source_folder(R\"~(${CMAKE_CURRENT_SOURCE_DIR})~\");
  return true;
}();
}  // namespace
")
  target_sources(${name} PRIVATE ${file})
endfunction()

function(orrery_check_flight_target test target)
  if(NOT TARGET ${target})
    message(FATAL_ERROR "orrery_add_test(${test}): FLIGHT ${target} is not a target; "
      "define it before the test, or import it")
  endif()
  get_target_property(type ${target} TYPE)
  if(NOT type MATCHES "^(SHARED|MODULE|UNKNOWN)_LIBRARY$")
    message(FATAL_ERROR "orrery_add_test(${test}): FLIGHT ${target} is of type ${type}; "
      "a SHARED, MODULE or IMPORTED library is needed")
  endif()
endfunction()

# Tests are listed when ctest runs, not when the program is built: a build for other hardware works,
# and a program that cannot start fails in ctest. Listing takes longer than CMake's 5 s on a busy host.
# Names stay those of --gtest_filter. gtest_discover_tests cannot pass on a list of labels.
function(orrery_discover_tests name labels timeout)
  include(GoogleTest)
  set(properties "")
  if(timeout)
    set(properties PROPERTIES TIMEOUT ${timeout})
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
    NO_PRETTY_TYPES NO_PRETTY_VALUES TEST_LIST ${name}_tests ${properties})
  # LeakSanitizer's own tracer can crash when the program is over and the test has passed: seen with one
  # test that unloads libraries with thread-local storage, in some environments. That is no leak and no
  # failure; it counts as skipped, where it can be seen.
  if(ORRERY_SANITIZE MATCHES address)
    set(file ${CMAKE_CURRENT_BINARY_DIR}/${name}_tracer.cmake)
    file(WRITE ${file} "if(${name}_tests)
  set_tests_properties(\${${name}_tests} PROPERTIES
    SKIP_REGULAR_EXPRESSION \"PASSED  . 1 test..Tracer caught signal\")
endif()
")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${file})
  endif()
  if(labels)
    set(file ${CMAKE_CURRENT_BINARY_DIR}/${name}_labels.cmake)
    file(WRITE ${file} "if(${name}_tests)
  set_tests_properties(\${${name}_tests} PROPERTIES LABELS \"${labels}\")
endif()
")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${file})
  endif()
endfunction()

function(orrery_add_shards name count labels timeout)
  foreach(number RANGE 1 ${count})
    math(EXPR index "${number} - 1")
    set(entry ${name}.shard${number}of${count})
    add_test(NAME ${entry} COMMAND ${name})
    set_tests_properties(${entry} PROPERTIES
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${count};GTEST_SHARD_INDEX=${index}" LABELS "${labels}")
    if(timeout)
      set_tests_properties(${entry} PROPERTIES TIMEOUT ${timeout})
    endif()
  endforeach()
endfunction()
