#pragma once

#include <memory>

#include "server/runtime/log.h"

namespace lpdeform {

/// Redirects gRPC's own log from stderr to `log`, as events "grpc", from now on for the whole process. The
/// events name the place in gRPC's source, not the text: its texts quote headers, tokens among them.
void take_grpc_log(const std::shared_ptr<const Log>& log);

}  // namespace lpdeform
