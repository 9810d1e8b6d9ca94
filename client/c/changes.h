#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "client/c/lpdeform.h"
#include "client/c/space.h"
#include "client/cpp/types.h"

namespace lpdeform::engine {

// Converts structs of the C interface to changes in the server's coordinates. Errors: ARGUMENT_MISSING, ENUM_UNKNOWN,
// ROTATION_NOT_FINITE, HANDLE_CHANGED_TWICE; the server checks everything else.

absl::StatusOr<client::Update> read_update(const lpdeform_update& update, const Space& space);
absl::StatusOr<client::Update> read_resizing(const lpdeform_resizing& resizing, const Space& space);
absl::StatusOr<client::Handle> read_handle(const lpdeform_handle& handle, const Space& space);
absl::StatusOr<client::Motion> read_motion(const lpdeform_motion& motion, const Space& space);
absl::StatusOr<client::Settings> read_settings(const lpdeform_settings& settings, const Space& space);

}  // namespace lpdeform::engine
