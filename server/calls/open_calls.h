#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "server/runtime/timers.h"

namespace lpdeform {

/// Ends calls that anybody may make, of the health service and of reflection, as CANCELLED once they have lasted so long:
/// `Health/Watch` and reflection are streams without end, and would keep their connection for ever. Other calls are not looked
/// at. They end within a quarter more than that. For ServerBuilder's experimental().SetInterceptorCreators().
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> end_open_calls(
    const std::shared_ptr<Timers>& timers, Timers::Duration after);

}  // namespace lpdeform
