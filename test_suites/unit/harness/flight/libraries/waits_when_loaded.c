/* Its constructor tells on one descriptor that it has begun, and ends when it may read from
 * another. */
#include <stdlib.h>
#include <unistd.h>

__attribute__((constructor)) static void wait(void) {
  const char* begun = getenv("ORRERY_TEST_BEGUN");
  const char* may_end = getenv("ORRERY_TEST_MAY_END");
  char byte = 0;
  if (begun == NULL || may_end == NULL) return;
  if (write(atoi(begun), &byte, 1) == 1) byte = (char)read(atoi(may_end), &byte, 1);
}
