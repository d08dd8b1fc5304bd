# Two interface targets carry how the project's own code is compiled. Neither reaches a consumer.
#   orrery_numerics  what equal bits need (every simulator and flight target)
#   orrery_warnings  warnings, and errors in CI

# A compiler may fold libm calls on constants or rewrite pow(x, 2); g++ and clang do so differently,
# and -O0 differs from -O2. Keeping the calls as calls is what makes builds agree.
set(orrery_libm_functions
  acos acosh asin asinh atan atan2 atanh cbrt cos cosh exp exp2 expm1 fmod hypot log log10 log1p log2
  pow remainder sin sincos sinh tan tanh)
set(ORRERY_NUMERIC_FLAGS -ffp-contract=off -fno-fast-math)
foreach(function IN LISTS orrery_libm_functions)
  list(APPEND ORRERY_NUMERIC_FLAGS -fno-builtin-${function})
endforeach()

add_library(orrery_numerics INTERFACE)
target_compile_options(orrery_numerics INTERFACE ${ORRERY_NUMERIC_FLAGS})
if(ORRERY_SANITIZE)
  target_compile_options(orrery_numerics INTERFACE
    -fsanitize=${ORRERY_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(orrery_numerics INTERFACE -fsanitize=${ORRERY_SANITIZE})
endif()

add_library(orrery_warnings INTERFACE)
target_compile_options(orrery_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor
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
