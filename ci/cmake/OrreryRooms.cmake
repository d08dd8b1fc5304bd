# Rooms: a folder with its headers beside its sources. Everyone includes <orrery/...>, in the tree
# through links in the build folder and installed as plain files.
set(ORRERY_INCLUDE_ROOT ${PROJECT_BINARY_DIR}/include)
file(MAKE_DIRECTORY ${ORRERY_INCLUDE_ROOT}/orrery)
foreach(wing IN ITEMS harness models fixtures)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${wing} ${ORRERY_INCLUDE_ROOT}/orrery/${wing} SYMBOLIC)
endforeach()
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/fixtures/orrery.hpp ${ORRERY_INCLUDE_ROOT}/orrery/orrery.hpp
  SYMBOLIC)

# ORRERY_UNITY: compiling sources in batches takes a third of the time, since what they share is parsed and
# instantiated once. Names in unnamed namespaces may then meet; sources with such names stand apart. With OFF
# or TESTS a build shows that each source of the libraries includes what it uses.
set(ORRERY_UNITY OFF CACHE STRING "Compile in batches: OFF, TESTS (test sources alone) or ON")
set_property(CACHE ORRERY_UNITY PROPERTY STRINGS OFF TESTS ON)
function(orrery_compile_in_batches target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  # A source is no header because another one includes it.
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)
endfunction()

# orrery_apart(source...): sources of the folder at hand that are never compiled in a batch.
function(orrery_apart)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# orrery_library(name [BATCHED] [EXPORT set]): the library orrery_<name> with the alias orrery::<name>. Installed
# with orreryTargets, or with a set of its own where it needs what not every user has. BATCHED: see
# ORRERY_UNITY.
function(orrery_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "BATCHED" "EXPORT" "")
  add_library(orrery_${name} STATIC)
  add_library(orrery::${name} ALIAS orrery_${name})
  set_target_properties(orrery_${name} PROPERTIES EXPORT_NAME ${name} VERIFY_INTERFACE_HEADER_SETS ON)
  target_compile_features(orrery_${name} PUBLIC cxx_std_20)
  # Read by orrery::flight_abi; everything that links this library has it, too.
  set_target_properties(orrery_${name} PROPERTIES ORRERY_SIMULATOR ON INTERFACE_ORRERY_SIMULATOR ON
    COMPATIBLE_INTERFACE_BOOL ORRERY_SIMULATOR)
  if(arg_BATCHED AND ORRERY_UNITY STREQUAL "ON")
    orrery_compile_in_batches(orrery_${name})
  endif()
  # Linked in the build tree only: neither flags nor warnings reach a consumer.
  target_link_libraries(orrery_${name} PRIVATE
    $<BUILD_INTERFACE:orrery_numerics> $<BUILD_INTERFACE:orrery_warnings>)
  # Whatever links code built with a sanitizer needs its runtime.
  target_link_options(orrery_${name} INTERFACE ${ORRERY_SANITIZE_LINK_OPTIONS})
  if(NOT arg_EXPORT)
    set_property(GLOBAL APPEND PROPERTY ORRERY_INSTALLED_TARGETS orrery_${name})
  endif()
endfunction()

# orrery_room(library ROOM wing/room HEADERS ... SOURCES ... APART ...): adds a room to a library.
# Headers are public; paths are relative to the room. APART: those of the sources that no batch takes in.
function(orrery_room library)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "ROOM" "HEADERS;SOURCES;APART")
  list(TRANSFORM arg_APART PREPEND ${PROJECT_SOURCE_DIR}/${arg_ROOM}/)
  set_source_files_properties(${arg_APART} TARGET_DIRECTORY orrery_${library}
    PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  list(TRANSFORM arg_HEADERS PREPEND ${ORRERY_INCLUDE_ROOT}/orrery/${arg_ROOM}/)
  list(TRANSFORM arg_SOURCES PREPEND ${PROJECT_SOURCE_DIR}/${arg_ROOM}/)
  target_sources(orrery_${library}
    PUBLIC FILE_SET HEADERS BASE_DIRS ${ORRERY_INCLUDE_ROOT} FILES ${arg_HEADERS}
    PRIVATE ${arg_SOURCES})
endfunction()

# Most of a build's time goes into test sources: templates of GoogleTest, instantiated once. They are
# optimised little, with line numbers only; what they link is built as the build type says. Under the
# sanitizers they are not optimised and are watched for addresses alone, which takes a third of the time:
# the code under test is watched for undefined behaviour, too.
set(orrery_test_options "$<$<CONFIG:RelWithDebInfo>:-O1;-g1>")
if(ORRERY_SANITIZE)
  set(orrery_test_options "$<$<CONFIG:RelWithDebInfo>:-O0;-g1>")
endif()
if(ORRERY_SANITIZE MATCHES undefined)
  list(APPEND orrery_test_options -fno-sanitize=undefined)
endif()
add_library(orrery_test_options INTERFACE)
target_compile_options(orrery_test_options INTERFACE ${orrery_test_options}
  # g++ 12 sees overruns in std::string's operator+ that are none (GCC bug 105329).
  "$<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-array-bounds;-Wno-restrict;-Wno-stringop-overflow>"
  $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fpch-preprocess>   # what ccache needs to see through it
  "$<$<COMPILE_LANG_AND_ID:CXX,Clang>:SHELL:-Xclang -fno-pch-timestamp>")

# Call it last: the options must follow those of everything else that the target links.
function(orrery_compile_as_test name)
  target_link_libraries(${name} PRIVATE orrery_test_options)
  if(ORRERY_UNITY)
    orrery_compile_in_batches(${name})
  endif()
endfunction()

# GoogleTest and the standard headers that tests use, parsed once for all suites. An executable, since a
# precompiled header serves only those that are compiled with the same flags.
function(orrery_precompile_for_suites)
  add_executable(orrery_precompiled EXCLUDE_FROM_ALL ${PROJECT_SOURCE_DIR}/test_suites/precompiled.cpp)
  target_link_libraries(orrery_precompiled PRIVATE GTest::gmock orrery_numerics orrery_warnings)
  orrery_compile_as_test(orrery_precompiled)
  target_precompile_headers(orrery_precompiled PRIVATE
    <gmock/gmock.h> <gtest/gtest.h> <algorithm> <array> <cmath> <cstdint> <cstring> <fstream> <functional>
    <limits> <map> <memory> <optional> <random> <sstream> <stdexcept> <string> <string_view> <vector>)
endfunction()

# The same for the programs that fly something: all of them include <orrery/orrery.hpp>.
function(orrery_precompile_for_flight_suites)
  orrery_add_program_that_flies(orrery_flight_precompiled ${PROJECT_SOURCE_DIR}/test_suites/precompiled.cpp)
  set_target_properties(orrery_flight_precompiled PROPERTIES EXCLUDE_FROM_ALL ON)
  orrery_use_project_flags(orrery_flight_precompiled)
  orrery_compile_as_test(orrery_flight_precompiled)
  target_precompile_headers(orrery_flight_precompiled PRIVATE
    $<$<COMPILE_LANGUAGE:CXX>:<orrery/orrery.hpp$<ANGLE-R>>)
endfunction()

# orrery_flight_suite(name ...): orrery_add_test for a program of the project itself.
function(orrery_flight_suite name)
  orrery_add_test(${name} ${ARGN})
  orrery_compile_as_test(${name})
  target_precompile_headers(${name} REUSE_FROM orrery_flight_precompiled)
endfunction()

# orrery_suite(name SOURCES ... LINK ... LABELS ...): a GoogleTest program of the project itself that
# needs no flight library. Programs that fly something use orrery_flight_suite.
function(orrery_suite name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "TIMEOUT" "SOURCES;LINK;LABELS")
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK} GTest::gmock GTest::gtest_main
    orrery_numerics orrery_warnings)
  orrery_compile_as_test(${name})
  target_precompile_headers(${name} REUSE_FROM orrery_precompiled)
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  target_compile_definitions(${name} PRIVATE ORRERY_REFERENCE_DATA="${ORRERY_REFERENCE_DATA}")
  if("validation" IN_LIST arg_LABELS)
    target_compile_definitions(${name} PRIVATE
      ORRERY_MODELS_README="${PROJECT_SOURCE_DIR}/models/README.md")
    set_property(GLOBAL APPEND PROPERTY ORRERY_VALIDATION_PROGRAMS ${name})
  endif()
  orrery_discover_tests(${name} "${arg_LABELS}" ${arg_TIMEOUT})
endfunction()

# orrery_bench(name SOURCES ... LINK ...): a Google Benchmark program. ctest runs each briefly, so that
# none rots; no time is asserted.
function(orrery_bench name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LINK")
  if(NOT ORRERY_BENCHMARKS)
    return()
  endif()
  find_package(benchmark REQUIRED)
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK} benchmark::benchmark_main
    orrery_numerics orrery_warnings)
  add_test(NAME ${name} COMMAND ${name} --benchmark_min_time=0.01)
  set_tests_properties(${name} PROPERTIES LABELS bench TIMEOUT 300)
endfunction()
