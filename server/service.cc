#include "server/service.h"

#include <functional>
#include <utility>

#include "server/frame_calls.h"
#include "server/grpc_status.h"
#include "server/refusals.h"
#include "server/solve_call.h"

namespace lpdeform {
namespace {

/// Runs `task` on the pool; the call ends when `task` calls what it is given.
grpc::ServerUnaryReactor* in_pool(Backend& backend, grpc::CallbackServerContext& context,
                                  std::function<void(std::function<void(absl::Status)>)> task) {
  grpc::ServerUnaryReactor* const reactor = context.DefaultReactor();
  CallGate::Permit permit = backend.gate.enter();
  if (permit == nullptr) {
    reactor->Finish(to_grpc(server_draining()));
    return reactor;
  }
  const auto finish = [&backend, reactor, permit](const absl::Status& status) {
    if (!status.ok()) {
      backend.log().info("refused",
                         {{"reason", fault_of(status).reason}, {"text", std::string(status.message())}});
    }
    reactor->Finish(to_grpc(status));
  };
  if (!backend.pool.try_post([task = std::move(task), finish] { task(finish); })) finish(server_busy());
  return reactor;
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* in_pool(Backend& backend, grpc::CallbackServerContext& context,
                                  absl::Status (Backend::*handler)(const Request&, Response&),
                                  const Request& request, Response& response) {
  return in_pool(backend, context, [&backend, handler, &request, &response](const auto& finish) {
    finish((backend.*handler)(request, response));
  });
}

}  // namespace

grpc::ServerUnaryReactor* Service::CreateUpload(Context* context, const v1::CreateUploadRequest* request,
                                                v1::CreateUploadResponse* response) {
  return in_pool(backend_, *context, &Backend::create_upload, *request, *response);
}

grpc::ServerUnaryReactor* Service::UploadPart(Context* context, const v1::UploadPartRequest* request,
                                              v1::UploadPartResponse* response) {
  return in_pool(backend_, *context, &Backend::upload_part, *request, *response);
}

grpc::ServerUnaryReactor* Service::DeleteUpload(Context* context, const v1::DeleteUploadRequest* request,
                                                v1::DeleteUploadResponse* response) {
  return in_pool(backend_, *context, &Backend::delete_upload, *request, *response);
}

grpc::ServerUnaryReactor* Service::CreateSession(Context* context, const v1::CreateSessionRequest* request,
                                                 v1::CreateSessionResponse* response) {
  return in_pool(backend_, *context, [this, request, response](auto finish) {
    backend_.create_session(*request, *response, std::move(finish));
  });
}

grpc::ServerUnaryReactor* Service::GetSession(Context* context, const v1::GetSessionRequest* request,
                                              v1::GetSessionResponse* response) {
  return in_pool(backend_, *context, &Backend::get_session, *request, *response);
}

grpc::ServerUnaryReactor* Service::ListSessions(Context* context, const v1::ListSessionsRequest* request,
                                                v1::ListSessionsResponse* response) {
  return in_pool(backend_, *context, &Backend::list_sessions, *request, *response);
}

grpc::ServerUnaryReactor* Service::DeleteSession(Context* context, const v1::DeleteSessionRequest* request,
                                                 v1::DeleteSessionResponse* response) {
  return in_pool(backend_, *context, &Backend::delete_session, *request, *response);
}

grpc::ServerUnaryReactor* Service::AcquireWriter(Context* context, const v1::AcquireWriterRequest* request,
                                                 v1::AcquireWriterResponse* response) {
  return in_pool(backend_, *context, &Backend::acquire_writer, *request, *response);
}

grpc::ServerUnaryReactor* Service::UpdateHandles(Context* context, const v1::UpdateHandlesRequest* request,
                                                 v1::UpdateHandlesResponse* response) {
  return in_pool(backend_, *context, &Backend::update_handles, *request, *response);
}

grpc::ServerUnaryReactor* Service::AckFrames(Context* context, const v1::AckFramesRequest* request,
                                             v1::AckFramesResponse* response) {
  return in_pool(backend_, *context, &Backend::ack_frames, *request, *response);
}

grpc::ServerWriteReactor<v1::StreamFramesResponse>* Service::StreamFrames(
    Context*, const v1::StreamFramesRequest* request) {
  return stream_frames(backend_, *request);
}

grpc::ServerWriteReactor<v1::StreamSessionsResponse>* Service::StreamSessions(
    Context*, const v1::StreamSessionsRequest* request) {
  return stream_sessions(backend_, *request);
}

grpc::ServerBidiReactor<v1::DeformRequest, v1::DeformResponse>* Service::Deform(Context*) {
  return deform(backend_);
}

grpc::ServerWriteReactor<v1::SolveResponse>* Service::Solve(Context*, const v1::SolveRequest* request) {
  return solve(backend_, *request);
}

}  // namespace lpdeform
