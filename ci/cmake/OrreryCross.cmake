# Flight libraries for other processors, from the sources of those for this one: what
# orrery_add_flight_library(... CROSS armhf armel arm64) builds with Debian's cross compilers. Where one is
# missing it says so and leaves that processor out; a test that asks for it is told the package's name.
# With ORRERY_CROSS off nothing is built for other processors.
include_guard(GLOBAL)
option(ORRERY_CROSS "Build flight libraries for the processors that they name, too" ON)

#   armhf  ARMv7 with VFP       armel  ARMv5T, soft float: also for an ARM1176       arm64  ARMv8
set(orrery_cross_triplet_armhf arm-linux-gnueabihf)
set(orrery_cross_triplet_armel arm-linux-gnueabi)
set(orrery_cross_triplet_arm64 aarch64-linux-gnu)

# lib<name>.<processor>.so beside lib<name>.so, and the host program that serves it. Static libraries of
# the same build that the library links are compiled in from their sources.
function(orrery_cross_build name)
  if(NOT ORRERY_CROSS)
    return()
  endif()
  foreach(processor IN LISTS ARGN)
    if(NOT DEFINED orrery_cross_triplet_${processor})
      message(FATAL_ERROR "orrery_add_flight_library(${name}): CROSS ${processor} is not known; "
        "armhf, armel and arm64 are")
    endif()
    set(triplet ${orrery_cross_triplet_${processor}})
    find_program(ORRERY_CROSS_CC_${processor} ${triplet}-gcc)
    find_program(ORRERY_CROSS_CXX_${processor} ${triplet}-g++)
    mark_as_advanced(ORRERY_CROSS_CC_${processor} ORRERY_CROSS_CXX_${processor})
    if(NOT ORRERY_CROSS_CC_${processor} OR NOT ORRERY_CROSS_CXX_${processor})
      message(STATUS "${name}: not built for ${processor}, as ${triplet}-g++ is missing "
        "(Debian package g++-${triplet})")
      continue()
    endif()
    orrery_cross_target_program(${processor})
    orrery_cross_library(${name} ${processor})
  endforeach()
endfunction()

function(orrery_cross_library name processor)
  set(objects "")
  set(first "")   # made before any object: generated headers
  get_target_property(links ${name} LINK_LIBRARIES)
  foreach(target IN ITEMS ${name} LISTS links)
    if(NOT TARGET ${target})
      continue()
    endif()
    get_target_property(type ${target} TYPE)
    if(NOT target STREQUAL name AND NOT type STREQUAL "STATIC_LIBRARY")
      continue()
    endif()
    get_target_property(dependencies ${target} MANUALLY_ADDED_DEPENDENCIES)
    if(dependencies AND NOT target STREQUAL name)
      list(APPEND first ${dependencies})
    endif()
    get_property(maker GLOBAL PROPERTY ORRERY_CROSS_MAKER_${target}.${processor})
    if(maker)
      list(APPEND first ${maker})
    endif()
    orrery_cross_objects(${name} ${processor} ${target})
  endforeach()
  set(output ${CMAKE_CURRENT_BINARY_DIR}/lib${name}.${processor}.so)
  add_custom_command(OUTPUT ${output}
    COMMAND ${ORRERY_CROSS_CXX_${processor}} -shared -Wl,--no-undefined ${objects} -o ${output} -lm
    DEPENDS ${objects} VERBATIM COMMENT "Linking ${processor} flight library ${name}")
  add_custom_target(${name}.${processor} DEPENDS ${output})
  if(first)
    add_dependencies(${name}.${processor} ${first})
  endif()
  add_dependencies(${name} ${name}.${processor} orrery-flight-target.${processor})
  set(beside ${PROJECT_BINARY_DIR}/orrery_cross)
  set_property(TARGET ${name} APPEND PROPERTY ORRERY_CROSS_FILES "${name}@${processor}=${output}"
    "orrery-flight-target@${processor}=${beside}/orrery-flight-target.${processor}"
    "orrery-instruction-count@${processor}=${beside}/orrery-instruction-count.so")
endfunction()

# Appends to `objects` those of the sources of `target`, seen with its own include folders. A static
# library that several flight libraries link is compiled once; C++ sources with the same UNITY_GROUP
# are compiled as one.
function(orrery_cross_objects name processor target)
  get_property(compiled GLOBAL PROPERTY ORRERY_CROSS_OBJECTS_${target}.${processor})
  if(compiled)
    set(objects ${objects} ${compiled} PARENT_SCOPE)
    return()
  endif()
  set(compiled "")
  set(groups "")
  set(includes "$<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>")
  set(place ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${name}.${processor})
  get_target_property(folder ${target} SOURCE_DIR)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${folder})
    if(NOT source MATCHES "\\.(c|cc|cpp|cxx)$")
      continue()
    endif()
    get_source_file_property(group ${source} TARGET_DIRECTORY ${target} UNITY_GROUP)
    if(group AND NOT source MATCHES "\\.c$")
      list(APPEND groups ${group})
      list(APPEND group_${group} ${source})
    else()
      orrery_cross_object(${source})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES groups)
  foreach(group IN LISTS groups)
    list(TRANSFORM group_${group} REPLACE "(.+)" "#include \"\\1\"")
    list(JOIN group_${group} "\n" text)
    file(CONFIGURE OUTPUT ${place}/${target}_${group}.cpp CONTENT "${text}\n" @ONLY)
    orrery_cross_object(${place}/${target}_${group}.cpp)
  endforeach()
  set_property(GLOBAL PROPERTY ORRERY_CROSS_OBJECTS_${target}.${processor} ${compiled})
  set_property(GLOBAL PROPERTY ORRERY_CROSS_MAKER_${target}.${processor} ${name}.${processor})
  set(objects ${objects} ${compiled} PARENT_SCOPE)
endfunction()

# Of one source, for orrery_cross_objects: appends to its `compiled`.
macro(orrery_cross_object path)
  set(source ${path})
  cmake_path(GET source FILENAME file)
  string(SHA1 hash ${source})
  string(SUBSTRING ${hash} 0 8 hash)
  set(object ${place}/${hash}_${file}.o)
  set(compiler ${ORRERY_CROSS_CC_${processor}})
  if(NOT file MATCHES "\\.c$")
    # Notes that GCC 7 passes some classes otherwise than GCC 6 did: all of it is compiled here.
    set(compiler ${ORRERY_CROSS_CXX_${processor}} -std=c++17 -Wno-psabi)
  endif()
  add_custom_command(OUTPUT ${object}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${place}
    COMMAND ${compiler} -O2 -g -fPIC -fvisibility=hidden ${ORRERY_NUMERIC_FLAG_LIST}
      "-I$<JOIN:${includes},;-I>" -DORRERY_FLIGHT_BUILD
      -MMD -MF ${object}.d -c ${source} -o ${object}
    DEPENDS ${source} DEPFILE ${object}.d
    COMMAND_EXPAND_LISTS VERBATIM
    COMMENT "Building ${processor} object of ${name}: ${file}")
  list(APPEND compiled ${object})
endmacro()

# Once per processor: orrery-flight-target with its simulated heap. Once: the plugin that counts
# instructions. The sources lie beside this file where Orrery is installed.
function(orrery_cross_target_program processor)
  if(TARGET orrery-flight-target.${processor})
    return()
  endif()
  set(c ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/target)
  set(heap ${c}/orrery/harness/heap)
  set(plugin ${c}/instruction_count.c)
  set(serve ${c}/orrery_flight_target.c ${c}/orrery_wire.c)
  set(headers "")
  if(NOT EXISTS ${c})
    cmake_path(SET root NORMALIZE ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../..)
    set(heap ${root}/harness/heap)
    set(plugin ${root}/harness/remote/instruction_count.c)
    set(serve ${root}/flight_sw/host/orrery_flight_target.c ${root}/flight_sw/abi/orrery_wire.c)
    file(GLOB headers ${root}/flight_sw/host/*.h ${root}/flight_sw/abi/*.h ${heap}/*.hpp)
  endif()
  set(sources "")
  foreach(part IN ITEMS target_heap block_heap first_fit_heap recency_list)
    list(APPEND sources ${heap}/${part}.cpp)
  endforeach()
  set(place ${PROJECT_BINARY_DIR}/orrery_cross)
  set(output ${place}/orrery-flight-target.${processor})
  set(abi "$<TARGET_PROPERTY:orrery::flight_abi,INTERFACE_INCLUDE_DIRECTORIES>")
  set(kernel "$<TARGET_PROPERTY:orrery::kernel,INTERFACE_INCLUDE_DIRECTORIES>")
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${place}
    # Loops over the bytes of a number become straight: to an emulator each turn is a block.
    COMMAND ${ORRERY_CROSS_CC_${processor}} -std=c99 -O3 -g "-I$<JOIN:${abi},;-I>" -r ${serve} -o ${output}.o
    # The C library's malloc is replaced: the compiler must not know what malloc does.
    COMMAND ${ORRERY_CROSS_CXX_${processor}} -std=c++20 -O2 -g -fno-builtin -Wno-narrowing
      "-I$<JOIN:${abi},;-I>" "-I$<JOIN:${kernel},;-I>" -I${c} ${sources} ${output}.o -o ${output} -ldl
    DEPENDS ${serve} ${sources} ${headers} COMMAND_EXPAND_LISTS VERBATIM
    COMMENT "Building orrery-flight-target for ${processor}")
  add_custom_target(orrery-flight-target.${processor} DEPENDS ${output})
  if(NOT TARGET orrery-instruction-count)
    add_custom_command(OUTPUT ${place}/orrery-instruction-count.so
      COMMAND ${CMAKE_COMMAND} -E make_directory ${place}
      COMMAND ${CMAKE_C_COMPILER} -std=c11 -Wall -Wextra -Werror -O2 -fPIC -shared -fvisibility=hidden
        ${plugin} -o ${place}/orrery-instruction-count.so
      DEPENDS ${plugin} VERBATIM COMMENT "Building the plugin that counts instructions")
    add_custom_target(orrery-instruction-count DEPENDS ${place}/orrery-instruction-count.so)
  endif()
  add_dependencies(orrery-flight-target.${processor} orrery-instruction-count)
endfunction()
