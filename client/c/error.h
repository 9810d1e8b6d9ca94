#pragma once

#include "absl/status/status.h"
#include "client/c/lpdeform.h"

namespace lpdeform::engine {

/// Says `status` in the caller's struct, which may be NULL; returns its code.
lpdeform_code tell(const absl::Status& status, lpdeform_error* error);

}  // namespace lpdeform::engine
