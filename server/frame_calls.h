#pragma once

#include "lpdeform/v1/service.grpc.pb.h"
#include "server/backend.h"
#include "server/received.h"

namespace lpdeform {

// The calls that carry frames. They belong to gRPC once made; `backend` outlives them.

grpc::ServerWriteReactor<v1::StreamFramesResponse>* stream_frames(Backend& backend,
                                                                  std::shared_ptr<CallRecord> record,
                                                                  const v1::StreamFramesRequest& request);

grpc::ServerWriteReactor<v1::StreamSessionsResponse>* stream_sessions(
    Backend& backend, std::shared_ptr<CallRecord> record, const v1::StreamSessionsRequest& request);

grpc::ServerBidiReactor<Received<v1::DeformRequest>, v1::DeformResponse>* deform(
    Backend& backend, std::shared_ptr<CallRecord> record);

}  // namespace lpdeform
