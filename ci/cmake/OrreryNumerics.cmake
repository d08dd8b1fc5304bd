# Compiler flags that equal bits need, for the simulator, for flight software and for the devices and
# forces in a user's tests. Installed with the package, so that both sides use one list.

# A compiler may fold libm calls on constants or rewrite pow(x, 2); g++ and clang do so differently,
# and -O0 differs from -O2. Keeping the calls as calls is what makes builds agree.
set(orrery_libm_functions
  acos acosh asin asinh atan atan2 atanh cbrt cos cosh exp exp2 expm1 fmod hypot log log10 log1p log2
  pow remainder sin sincos sinh tan tanh)
set(orrery_numeric_flags -ffp-contract=off -fno-fast-math)
foreach(function IN LISTS orrery_libm_functions)
  list(APPEND orrery_numeric_flags -fno-builtin-${function})
endforeach()
# Other languages of a target (assembler, Fortran) do not know these flags.
set(ORRERY_NUMERIC_FLAG_LIST ${orrery_numeric_flags})
set(ORRERY_NUMERIC_FLAGS "$<$<COMPILE_LANGUAGE:C,CXX>:${orrery_numeric_flags}>")
