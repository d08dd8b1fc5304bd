# The program has no symbol of GoogleTest and no malloc of its own.
#   cmake -D NM=nm -D PROGRAM=file -P check_symbols.cmake
execute_process(COMMAND ${NM} --demangle ${PROGRAM} OUTPUT_VARIABLE symbols
  COMMAND_ERROR_IS_FATAL ANY)
if(NOT symbols MATCHES " T main\n" OR NOT symbols MATCHES "orrery::HarmonicGravity")
  message(FATAL_ERROR "${NM} shows no symbols of ${PROGRAM}")
endif()
foreach(unwanted IN ITEMS "testing::" " [TtWw] (malloc|free|calloc|realloc)\n")
  if(symbols MATCHES "[^\n]*${unwanted}")
    message(FATAL_ERROR "${PROGRAM} must not have: ${CMAKE_MATCH_0}")
  endif()
endforeach()
