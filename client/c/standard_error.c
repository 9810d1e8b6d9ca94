/* Some of the archives that the library is linked from name the C library's variable stderr directly, as only executables may. The
 * linker gives them this one in its place (--wrap=stderr), which is the same stream. */
#include <stdio.h>

extern FILE* __real_stderr;
FILE* __wrap_stderr;

__attribute__((constructor(101))) static void take_the_real_one(void) {
  __wrap_stderr = __real_stderr;
}
