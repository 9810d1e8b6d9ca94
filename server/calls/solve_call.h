#pragma once

#include "lpdeform/v1/service.grpc.pb.h"
#include "server/calls/backend.h"
#include "server/wire/frame_slices.h"

namespace lpdeform {

/// A Solve call; it belongs to gRPC once it is made. `backend` outlives it.
using SolveReactor = grpc::ServerWriteReactor<Outgoing<v1::SolveResponse>>;
SolveReactor* solve(Backend& backend, std::shared_ptr<CallRecord> record, const v1::SolveRequest& request);

}  // namespace lpdeform
