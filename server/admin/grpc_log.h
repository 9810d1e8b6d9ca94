#pragma once

#include <memory>

#include "server/runtime/log.h"

namespace lpdeform {

/// Redirects gRPC's own log from stderr to `log`, as events "grpc", from now on for the whole process. The
/// events name the place in gRPC's source, not the text: its texts quote headers, tokens among them. Newer
/// gRPC logs by Abseil; then the same holds for all that does, such as protobuf. Without a log, gRPC's errors
/// go to stderr, and nothing else of it.
void take_grpc_log(const std::shared_ptr<const Log>& log);

}  // namespace lpdeform
