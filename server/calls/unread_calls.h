#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "server/calls/backend.h"

namespace lpdeform {

/// Reports unary calls whose message cannot be parsed, so that no handler sees it. gRPC alone would end them
/// as UNIMPLEMENTED or INTERNAL without details. Here they are counted and logged like others, and end with
/// INVALID_ARGUMENT MESSAGE_UNREADABLE. `Deform` reports such messages itself (received.h). Messages that are
/// too large or compressed cannot be reported: gRPC ends these calls before its C++ side sees them. `backend`
/// outlives the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> tell_of_unread_calls(Backend& backend);

}  // namespace lpdeform
