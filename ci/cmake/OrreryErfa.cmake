# Debian's liberfa ships a pkg-config file and no CMake package. Consumers of an installed Orrery come
# through here too.
if(NOT TARGET ERFA::erfa)
  find_path(ERFA_INCLUDE_DIR erfa.h)
  find_library(ERFA_LIBRARY erfa)
  if(NOT ERFA_INCLUDE_DIR OR NOT ERFA_LIBRARY)
    message(FATAL_ERROR "ERFA was not found: install Debian's liberfa-dev, "
      "or set ERFA_INCLUDE_DIR and ERFA_LIBRARY")
  endif()
  add_library(ERFA::erfa UNKNOWN IMPORTED GLOBAL)   # GLOBAL: for users of FetchContent
  set_target_properties(ERFA::erfa PROPERTIES
    IMPORTED_LOCATION ${ERFA_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${ERFA_INCLUDE_DIR})
endif()
