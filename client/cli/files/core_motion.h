#pragma once

#include "client/cpp/types.h"
#include "core/problem/handles.h"

namespace lpdeform::cli {

/// A handle's motion as core has it, and as the client library has it; each is the other's inverse.
HandleMotion to_core(const client::Motion& motion);
client::Motion to_client(const HandleMotion& motion);

}  // namespace lpdeform::cli
