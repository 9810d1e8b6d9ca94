#pragma once

#include <cstdio>
#include <cstdlib>

/// Stops the program if one of our own invariants is broken. Active in every build. Never use it for a caller's
/// mistake, which is an absl::Status, or for how a solve ended, which is a StopReason.
#define LPDEFORM_CHECK(condition)                                                            \
  do {                                                                                       \
    if (!(condition)) {                                                                      \
      std::fprintf(stderr, "%s:%d: broken invariant: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                          \
    }                                                                                        \
  } while (false)
