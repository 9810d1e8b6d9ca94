#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "server/calls/backend.h"

namespace lpdeform {

/// Tells of unary calls whose message no handler sees, because it cannot be parsed: gRPC would end them as UNIMPLEMENTED, without a
/// word. They are counted and logged as others are, and end with INVALID_ARGUMENT MESSAGE_UNREADABLE. What comes on `Deform` tells
/// of itself (received.h). Of messages that are too large or compressed nothing is known here: gRPC ends these calls before there
/// is one for its C++ side. `backend` outlives the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> tell_of_unread_calls(Backend& backend);

}  // namespace lpdeform
