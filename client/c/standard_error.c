/* Some of the linked archives refer directly to the C library's variable stderr, which only executables may do. The
 * linker replaces it by the variable below (--wrap=stderr), which is the same stream. */
#include <stdio.h>

extern FILE* __real_stderr;
FILE* __wrap_stderr;

__attribute__((constructor(101))) static void take_the_real_one(void) {
  __wrap_stderr = __real_stderr;
}
