# install(EXPORT) and orreryConfig.cmake. Headers of the simulator go below include/orrery, the flight
# ABI's to an include root of its own, so that flight software cannot see the one through the other.
include(CMakePackageConfigHelpers)
set(orrery_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/orrery)

get_property(orrery_installed_targets GLOBAL PROPERTY ORRERY_INSTALLED_TARGETS)
get_property(orrery_installed_programs GLOBAL PROPERTY ORRERY_INSTALLED_PROGRAMS)
# What `cmake --install` needs, without tests and benchmarks.
add_custom_target(orrery_package DEPENDS ${orrery_installed_targets} ${orrery_installed_programs})
install(TARGETS ${orrery_installed_programs} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS ${orrery_installed_targets} EXPORT orreryTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  OBJECTS DESTINATION ${CMAKE_INSTALL_LIBDIR}/orrery
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS orrery_flight_abi EXPORT orreryTargets
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/orrery_flight_abi)
install(EXPORT orreryTargets NAMESPACE orrery:: DESTINATION ${orrery_package_dir})
if(TARGET orrery_reference)   # apart, so that the package is of use without SUNDIALS
  add_dependencies(orrery_package orrery_reference)
  install(TARGETS orrery_reference EXPORT orreryReferenceTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT orreryReferenceTargets NAMESPACE orrery:: DESTINATION ${orrery_package_dir})
endif()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/orreryConfig.cmake.in
  ${PROJECT_BINARY_DIR}/orreryConfig.cmake INSTALL_DESTINATION ${orrery_package_dir}
  NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/orreryConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)   # below 1.0 a minor version may break its users
install(FILES
  ${PROJECT_BINARY_DIR}/orreryConfig.cmake
  ${PROJECT_BINARY_DIR}/orreryConfigVersion.cmake
  ${CMAKE_CURRENT_LIST_DIR}/OrreryDependencies.cmake
  ${CMAKE_CURRENT_LIST_DIR}/OrreryCross.cmake
  ${CMAKE_CURRENT_LIST_DIR}/OrreryNumerics.cmake
  ${CMAKE_CURRENT_LIST_DIR}/OrreryUser.cmake
  ${PROJECT_SOURCE_DIR}/flight_sw/abi/orrery_work.cpp
  DESTINATION ${orrery_package_dir})
install(FILES   # built by users for other processors
  ${PROJECT_SOURCE_DIR}/flight_sw/abi/orrery_wire.c
  ${PROJECT_SOURCE_DIR}/flight_sw/host/orrery_flight_library.h
  ${PROJECT_SOURCE_DIR}/flight_sw/host/orrery_flight_target.c
  ${PROJECT_SOURCE_DIR}/harness/remote/instruction_count.c
  DESTINATION ${orrery_package_dir}/target)
foreach(file IN ITEMS target_heap.cpp block_heap.cpp first_fit_heap.cpp recency_list.cpp
    first_fit_heap.hpp recency_list.hpp tagged_heap.hpp page_array.hpp)
  install(FILES ${PROJECT_SOURCE_DIR}/harness/heap/${file}
    DESTINATION ${orrery_package_dir}/target/orrery/harness/heap)
endforeach()
