# Every public header of the simulator must stop with our message where ORRERY_FLIGHT_BUILD is defined.
#   cmake -D COMPILER=.. -D INCLUDE_ROOT=.. -D ABI_ROOT=.. -D HEADERS=list.txt -P this
file(STRINGS ${HEADERS} headers)
list(LENGTH headers count)
if(count LESS 5)
  message(FATAL_ERROR "${HEADERS} lists ${count} headers; where are the others?")
endif()

# preprocess(<header> <result> <message>)
function(preprocess header result_variable message_variable)
  execute_process(
    COMMAND ${COMPILER} -std=c++20 -E -Wfatal-errors -DORRERY_FLIGHT_BUILD
      -I${INCLUDE_ROOT} -I${ABI_ROOT} -x c++ ${header}
    RESULT_VARIABLE result ERROR_VARIABLE message OUTPUT_QUIET)
  set(${result_variable} ${result} PARENT_SCOPE)
  set(${message_variable} "${message}" PARENT_SCOPE)
endfunction()

# The headers that flight software may include, so that a failure below is due to the header.
foreach(header IN ITEMS orrery_flight.h orrery_flight.hpp orrery_messages.h)
  preprocess(${ABI_ROOT}/${header} result message)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "flight software cannot include ${header}:\n${message}")
  endif()
endforeach()

set(open "")
foreach(header IN LISTS headers)
  preprocess(${header} result message)
  if(result EQUAL 0 OR NOT message MATCHES "flight software sees orrery_flight.h")
    list(APPEND open "${header}: exit ${result}\n${message}")
  endif()
endforeach()
if(open)
  list(JOIN open "\n" open)
  message(FATAL_ERROR "flight software could include these headers; each must include "
    "<orrery/harness/kernel/simulator_only.hpp>, directly or through another:\n${open}")
endif()
message(STATUS "${count} headers refuse a flight build")
