#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {

/// Returns the result of `work`, or its exception as an error: RESOURCE_EXHAUSTED OUT_OF_MEMORY, INTERNAL EXCEPTION.
/// For thread functions and the C interface, which no exception may leave.
template <typename Work>
absl::Status guarded(Work work) {
  const auto internal = [](const char* text) { return make_fault({Reason::kException, "", ""}, text); };
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return make_fault({Reason::kOutOfMemory, "", ""}, "Out of memory.");
  } catch (const std::exception& exception) {
    return internal(exception.what());
  } catch (...) {
    return internal("Something was thrown that is no std::exception.");
  }
}

}  // namespace lpdeform::client
