# Interface targets carry how the project's own code is compiled. None reaches a consumer.
#   orrery_numerics    what equal bits need, and the sanitizers (every simulator and flight target)
#   orrery_sanitizers  ORRERY_SANITIZE alone
#   orrery_warnings    warnings, and errors in CI

include(OrreryNumerics)
add_library(orrery_sanitizers INTERFACE)
if(ORRERY_SANITIZE)
  set(ORRERY_SANITIZE_LINK_OPTIONS -fsanitize=${ORRERY_SANITIZE})
  target_compile_options(orrery_sanitizers INTERFACE
    -fsanitize=${ORRERY_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(orrery_sanitizers INTERFACE ${ORRERY_SANITIZE_LINK_OPTIONS})
endif()

add_library(orrery_numerics INTERFACE)
target_compile_options(orrery_numerics INTERFACE ${ORRERY_NUMERIC_FLAGS})
target_link_libraries(orrery_numerics INTERFACE orrery_sanitizers)

add_library(orrery_warnings INTERFACE)
target_compile_options(orrery_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor>
  $<$<COMPILE_LANGUAGE:CXX>:-Woverloaded-virtual>
  $<$<BOOL:${ORRERY_WARNINGS_AS_ERRORS}>:-Werror>)
target_compile_options(orrery_warnings INTERFACE
  $<$<COMPILE_LANG_AND_ID:CXX,Clang>:-Wno-missing-field-initializers>
  $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-missing-field-initializers>)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_C_VISIBILITY_PRESET hidden)
