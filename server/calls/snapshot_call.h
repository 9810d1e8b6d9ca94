#pragma once

#include <memory>

#include "lpdeform/v1/service.grpc.pb.h"
#include "server/calls/backend.h"

namespace lpdeform {

/// The reactor of a SnapshotSession call. It belongs to gRPC.
grpc::ServerWriteReactor<v1::SnapshotSessionResponse>* snapshot_session(
    Backend& backend, std::shared_ptr<CallRecord> record, const v1::SnapshotSessionRequest& request);

}  // namespace lpdeform
