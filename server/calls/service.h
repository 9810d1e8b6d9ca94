#pragma once

#include "lpdeform/v1/service.grpc.pb.h"
#include "server/calls/backend.h"

namespace lpdeform {

/// The contract's calls as gRPC sees them. Each call goes to the backend on a thread of the pool, and its
/// status comes back through to_grpc(). `backend` outlives it.
class Service final : public v1::DeformService::CallbackService {
 public:
  explicit Service(Backend& backend);

  using Context = grpc::CallbackServerContext;
  grpc::ServerUnaryReactor* CreateUpload(Context* context, const v1::CreateUploadRequest* request,
                                         v1::CreateUploadResponse* response) override;
  grpc::ServerUnaryReactor* UploadPart(Context* context, const v1::UploadPartRequest* request,
                                       v1::UploadPartResponse* response) override;
  grpc::ServerUnaryReactor* DeleteUpload(Context* context, const v1::DeleteUploadRequest* request,
                                         v1::DeleteUploadResponse* response) override;
  grpc::ServerUnaryReactor* CreateSession(Context* context, const v1::CreateSessionRequest* request,
                                          v1::CreateSessionResponse* response) override;
  grpc::ServerUnaryReactor* GetSession(Context* context, const v1::GetSessionRequest* request,
                                       v1::GetSessionResponse* response) override;
  grpc::ServerUnaryReactor* ListSessions(Context* context, const v1::ListSessionsRequest* request,
                                         v1::ListSessionsResponse* response) override;
  grpc::ServerUnaryReactor* DeleteSession(Context* context, const v1::DeleteSessionRequest* request,
                                          v1::DeleteSessionResponse* response) override;
  grpc::ServerWriteReactor<v1::SnapshotSessionResponse>* SnapshotSession(
      Context* context, const v1::SnapshotSessionRequest* request) override;
  grpc::ServerUnaryReactor* RestoreSession(Context* context, const v1::RestoreSessionRequest* request,
                                           v1::RestoreSessionResponse* response) override;
  grpc::ServerUnaryReactor* AcquireWriter(Context* context, const v1::AcquireWriterRequest* request,
                                          v1::AcquireWriterResponse* response) override;
  grpc::ServerUnaryReactor* UpdateHandles(Context* context, const v1::UpdateHandlesRequest* request,
                                          v1::UpdateHandlesResponse* response) override;
  grpc::ServerUnaryReactor* UndoUpdate(Context* context, const v1::UndoUpdateRequest* request,
                                       v1::UndoUpdateResponse* response) override;
  grpc::ServerUnaryReactor* TakeBetterShape(Context* context, const v1::TakeBetterShapeRequest* request,
                                            v1::TakeBetterShapeResponse* response) override;
  grpc::ServerUnaryReactor* AckFrames(Context* context, const v1::AckFramesRequest* request,
                                      v1::AckFramesResponse* response) override;

 private:
  template <typename Request, typename Response, typename Begin>
  void stream_with(const char* method, Begin begin);

  Backend& backend_;
};

}  // namespace lpdeform
