#pragma once

#include <memory>

#include "server/runtime/log.h"

namespace lpdeform {

/// Sends what gRPC has to say of itself to `log` in place of stderr, as events "grpc", from now on for the whole process. They
/// say where in gRPC, not what: its texts quote headers, tokens among them.
void take_grpc_log(const std::shared_ptr<const Log>& log);

}  // namespace lpdeform
