#pragma once

#include "lpdeform/v1/service.grpc.pb.h"
#include "server/calls/backend.h"
#include "server/wire/frame_slices.h"
#include "server/wire/received.h"

namespace lpdeform {

// The calls that carry frames. They belong to gRPC once they are made; `backend` outlives them.

using StreamFramesReactor = grpc::ServerWriteReactor<Outgoing<v1::StreamFramesResponse>>;
StreamFramesReactor* stream_frames(Backend& backend, std::shared_ptr<CallRecord> record,
                                   const v1::StreamFramesRequest& request);

using StreamSessionsReactor = grpc::ServerWriteReactor<Outgoing<v1::StreamSessionsResponse>>;
StreamSessionsReactor* stream_sessions(Backend& backend, std::shared_ptr<CallRecord> record,
                                       const v1::StreamSessionsRequest& request);

using DeformReactor = grpc::ServerBidiReactor<Received<v1::DeformRequest>, Outgoing<v1::DeformResponse>>;
DeformReactor* deform(Backend& backend, std::shared_ptr<CallRecord> record);

}  // namespace lpdeform
