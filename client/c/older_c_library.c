/* Replacements for C library functions that the linked archives use but older C libraries do not have. The linker
 * prefers these definitions, and exports.map hides them. libstdc++'s std::random_device uses arc4random, and c-ares
 * uses arc4random_buf (both from glibc 2.36). C++ code compiled with the headers of glibc 2.38 or newer uses the C23
 * functions that parse numbers, which also accept "0b1". */
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/random.h>

void arc4random_buf(void* buffer, size_t bytes) {
  for (char* to = buffer; bytes > 0;) {
    const ssize_t got = getrandom(to, bytes, 0);
    if (got < 0 && errno != EINTR) abort();
    if (got <= 0) continue;
    to += got;
    bytes -= (size_t)got;
  }
}

unsigned int arc4random(void) {
  unsigned int result;
  arc4random_buf(&result, sizeof result);
  return result;
}

long __isoc23_strtol(const char* text, char** end, int base) {
  return strtol(text, end, base);
}

long long __isoc23_strtoll(const char* text, char** end, int base) {
  return strtoll(text, end, base);
}

unsigned long __isoc23_strtoul(const char* text, char** end, int base) {
  return strtoul(text, end, base);
}

unsigned long long __isoc23_strtoull(const char* text, char** end, int base) {
  return strtoull(text, end, base);
}

int __isoc23_sscanf(const char* text, const char* format, ...) {
  va_list values;
  va_start(values, format);
  const int count = vsscanf(text, format, values);
  va_end(values);
  return count;
}
