# Libraries that Debian ships without a CMake package. Consumers of an installed Orrery come through
# here too.

# orrery_find_library(TARGET ERFA::erfa HEADER erfa.h LIBRARY erfa PACKAGE liberfa-dev)
function(orrery_find_library)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "TARGET;HEADER;LIBRARY;PACKAGE" "")
  if(TARGET ${arg_TARGET})
    return()
  endif()
  string(TOUPPER ${arg_LIBRARY} prefix)
  find_path(${prefix}_INCLUDE_DIR ${arg_HEADER})
  find_library(${prefix}_LIBRARY ${arg_LIBRARY})
  if(NOT ${prefix}_INCLUDE_DIR OR NOT ${prefix}_LIBRARY)
    message(FATAL_ERROR "${arg_LIBRARY} was not found: install Debian's ${arg_PACKAGE}, "
      "or set ${prefix}_INCLUDE_DIR and ${prefix}_LIBRARY")
  endif()
  add_library(${arg_TARGET} UNKNOWN IMPORTED GLOBAL)   # GLOBAL: for users of FetchContent
  set_target_properties(${arg_TARGET} PROPERTIES
    IMPORTED_LOCATION ${${prefix}_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${${prefix}_INCLUDE_DIR})
endfunction()

macro(orrery_find_erfa)
  orrery_find_library(TARGET ERFA::erfa HEADER erfa.h LIBRARY erfa PACKAGE liberfa-dev)
endmacro()

macro(orrery_find_nettle)
  orrery_find_library(TARGET nettle::nettle HEADER nettle/sha2.h LIBRARY nettle PACKAGE nettle-dev)
endmacro()

# SUNDIALS has a CMake package. QUIET or REQUIRED.
macro(orrery_find_sundials how)
  if(NOT TARGET SUNDIALS::arkode)
    find_package(SUNDIALS 6.4 ${how} COMPONENTS arkode nvecserial)
  endif()
endmacro()

# OpenCV for tests, as the target orrery_opencv_calib3d: Debian's packages of single modules have no CMake
# package. Nothing where it is absent.
macro(orrery_find_opencv_calib3d)
  find_path(OPENCV4_INCLUDE_DIR opencv2/calib3d.hpp PATH_SUFFIXES opencv4)
  find_library(OPENCV_CALIB3D_LIBRARY opencv_calib3d)
  find_library(OPENCV_CORE_LIBRARY opencv_core)
  if(NOT TARGET orrery_opencv_calib3d AND OPENCV4_INCLUDE_DIR AND OPENCV_CALIB3D_LIBRARY AND OPENCV_CORE_LIBRARY)
    add_library(orrery_opencv_calib3d INTERFACE)
    target_include_directories(orrery_opencv_calib3d SYSTEM INTERFACE ${OPENCV4_INCLUDE_DIR})
    target_link_libraries(orrery_opencv_calib3d INTERFACE ${OPENCV_CALIB3D_LIBRARY} ${OPENCV_CORE_LIBRARY})
  endif()
endmacro()
