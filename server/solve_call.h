#pragma once

#include "lpdeform/v1/service.grpc.pb.h"
#include "server/backend.h"

namespace lpdeform {

/// A Solve call; belongs to gRPC once made. `backend` outlives it.
grpc::ServerWriteReactor<v1::SolveResponse>* solve(Backend& backend, std::shared_ptr<CallRecord> record,
                                                   const v1::SolveRequest& request);

}  // namespace lpdeform
