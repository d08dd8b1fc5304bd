/* A dependency with a hidden static: one count for all that link it in one program. */
static unsigned next_sequence_number;
#if defined(__GNUC__)
__attribute__((visibility("default")))
#endif
unsigned
sequence_number(void) {
  return ++next_sequence_number;
}
