#pragma once

#include "core/problem/hold.h"
#include "lpdeform/v1/service.pb.h"

namespace lpdeform {

// How a handle is held, between messages and values. These are the only functions of the server that name the kinds.

/// Exactly where the message says none, or one of a newer client. A weight that is left out takes its default.
Hold decode_hold(const v1::Handle& message);

/// Sets the field that decode_hold reads; none for Exactly.
void encode_hold(const Hold& hold, v1::Handle& out);

/// The name of the kind, as GetSession tells it.
v1::HandleKind kind_of(const Hold& hold);

}  // namespace lpdeform
