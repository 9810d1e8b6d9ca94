#pragma once

#include "absl/status/status.h"
#include "client/c/lpdeform.h"

namespace lpdeform::engine {

/// Writes `status` to the caller's struct, which may be NULL; returns its code.
lpdeform_code tell(const absl::Status& status, lpdeform_error* error);

/// Copies as much of `text` as there is room for, never half a UTF-8 character. A cut text ends in "...". `size`: bytes
/// of `into`.
void copy_text(std::string_view text, char* into, std::size_t size);

}  // namespace lpdeform::engine
