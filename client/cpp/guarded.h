#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {

/// What `work` returns, or as an error what it throws: RESOURCE_EXHAUSTED OUT_OF_MEMORY, INTERNAL EXCEPTION. For the ends of
/// threads and the border to C, which no exception may pass.
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
