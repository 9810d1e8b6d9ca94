#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "server/runtime/timers.h"

namespace lpdeform {

/// Ends long calls that need no authentication, those of the health service and of reflection, as CANCELLED
/// once they have lasted for `after`, or at most a quarter longer. `Health/Watch` and reflection are streams
/// without end, which would otherwise keep their connections open for ever. Other calls are not affected. For
/// ServerBuilder's experimental().SetInterceptorCreators().
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> end_open_calls(
    const std::shared_ptr<Timers>& timers, Timers::Duration after);

}  // namespace lpdeform
