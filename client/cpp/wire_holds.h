#pragma once

#include "client/cpp/types.h"
#include "lpdeform/v1/handle.pb.h"

namespace lpdeform::client {

// Converts holds between plain types and messages.

/// Sets nothing for Exactly.
void to_wire(const Hold& hold, v1::Handle& out);

/// The hold of a handle that the server made. Exactly if the hold is missing, or of a kind that only newer servers
/// know.
Hold hold_from_wire(const v1::Handle& message);

}  // namespace lpdeform::client
