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
  set(sources "")
  set(generated "")
  set(includes "$<TARGET_PROPERTY:${name},INCLUDE_DIRECTORIES>")
  get_target_property(links ${name} LINK_LIBRARIES)
  foreach(target IN ITEMS ${name} LISTS links)
    if(NOT TARGET ${target})
      continue()
    endif()
    get_target_property(type ${target} TYPE)
    get_target_property(folder ${target} SOURCE_DIR)
    if(NOT target STREQUAL name AND NOT type STREQUAL "STATIC_LIBRARY")
      continue()
    endif()
    # What a static library generates for itself, such as tables.
    if(NOT target STREQUAL name)
      list(APPEND includes "$<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>")
      get_target_property(first ${target} MANUALLY_ADDED_DEPENDENCIES)
      if(first)
        list(APPEND generated ${first})
      endif()
    endif()
    get_target_property(files ${target} SOURCES)
    foreach(file IN LISTS files)
      cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY ${folder})
      if(file MATCHES "\\.(c|cc|cpp|cxx)$")
        list(APPEND sources ${file})
      endif()
    endforeach()
  endforeach()
  set(output ${CMAKE_CURRENT_BINARY_DIR}/lib${name}.${processor}.so)
  set(objects "")
  foreach(source IN LISTS sources)
    cmake_path(GET source FILENAME file)
    string(SHA1 place ${source})
    string(SUBSTRING ${place} 0 8 place)
    set(object ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${name}.${processor}/${place}_${file}.o)
    if(source MATCHES "\\.c$")
      set(compiler ${ORRERY_CROSS_CC_${processor}})
    else()
      # Notes that GCC 7 passes some classes otherwise than GCC 6 did: all of it is compiled here.
      set(compiler ${ORRERY_CROSS_CXX_${processor}} -std=c++17 -Wno-psabi)
    endif()
    add_custom_command(OUTPUT ${object}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${name}.${processor}
      COMMAND ${compiler} -O2 -g -fPIC -fvisibility=hidden ${ORRERY_NUMERIC_FLAG_LIST}
        "-I$<JOIN:${includes},;-I>" -DORRERY_FLIGHT_BUILD
        -MMD -MF ${object}.d -c ${source} -o ${object}
      DEPENDS ${source} ${generated} DEPFILE ${object}.d
      COMMAND_EXPAND_LISTS VERBATIM
      COMMENT "Building ${processor} object of ${name}: ${file}")
    list(APPEND objects ${object})
  endforeach()
  add_custom_command(OUTPUT ${output}
    COMMAND ${ORRERY_CROSS_CXX_${processor}} -shared -Wl,--no-undefined ${objects} -o ${output} -lm
    DEPENDS ${objects} VERBATIM COMMENT "Linking ${processor} flight library ${name}")
  add_custom_target(${name}.${processor} DEPENDS ${output})
  add_dependencies(${name} ${name}.${processor} orrery-flight-target.${processor})
  set_property(TARGET ${name} APPEND PROPERTY ORRERY_CROSS_FILES "${name}@${processor}=${output}"
    "orrery-flight-target@${processor}=${PROJECT_BINARY_DIR}/orrery_cross/orrery-flight-target.${processor}")
endfunction()

# Once per processor. The sources lie beside this file where Orrery is installed.
function(orrery_cross_target_program processor)
  if(TARGET orrery-flight-target.${processor})
    return()
  endif()
  set(host ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/target)
  set(abi "$<TARGET_PROPERTY:orrery::flight_abi,INTERFACE_INCLUDE_DIRECTORIES>")
  set(sources ${host}/orrery_flight_target.c ${host}/orrery_wire.c)
  if(NOT EXISTS ${host})
    set(host ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../../flight_sw)
    set(sources ${host}/host/orrery_flight_target.c ${host}/abi/orrery_wire.c)
  endif()
  set(output ${PROJECT_BINARY_DIR}/orrery_cross/orrery-flight-target.${processor})
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/orrery_cross
    COMMAND ${ORRERY_CROSS_CC_${processor}} -std=c99 -O2 -g "-I$<JOIN:${abi},;-I>" ${sources}
      -o ${output} -ldl
    DEPENDS ${sources} COMMAND_EXPAND_LISTS VERBATIM
    COMMENT "Building orrery-flight-target for ${processor}")
  add_custom_target(orrery-flight-target.${processor} DEPENDS ${output})
endfunction()
