/* What the archives that the library is linked from take from a newer C library than it has to need. The linker prefers these, and
 * exports.map hides them. libstdc++'s std::random_device takes arc4random (of glibc 2.36). */
#include <errno.h>
#include <stdlib.h>
#include <sys/random.h>

unsigned int arc4random(void) {
  unsigned int result;
  /* So few bytes come whole or not at all. */
  while (getrandom(&result, sizeof result, 0) != (ssize_t)sizeof result) {
    if (errno != EINTR) abort();
  }
  return result;
}
