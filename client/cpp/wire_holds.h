#pragma once

#include "client/cpp/types.h"
#include "lpdeform/v1/handle.pb.h"

namespace lpdeform::client {

// How a handle is held, between plain types and messages.

/// Nothing is set for Exactly.
void to_wire(const Hold& hold, v1::Handle& out);

/// Of a handle that the server made. Exactly where the hold is missing, or one of a newer server.
Hold hold_from_wire(const v1::Handle& message);

}  // namespace lpdeform::client
