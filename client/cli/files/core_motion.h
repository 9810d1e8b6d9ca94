#pragma once

#include "client/cpp/types.h"
#include "core/problem/handles.h"

namespace lpdeform::cli {

/// Convert a handle's motion between core and the client library; each is the inverse of the other.
HandleMotion to_core(const client::Motion& motion);
client::Motion to_client(const HandleMotion& motion);

}  // namespace lpdeform::cli
