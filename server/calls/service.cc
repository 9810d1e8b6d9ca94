#include "server/calls/service.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/calls/frame_calls.h"
#include "server/calls/snapshot_call.h"
#include "server/calls/solve_call.h"
#include "server/runtime/refusals.h"
#include "server/wire/grpc_status.h"
#include "server/wire/trace_context.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLongestTraceParent = 256;
constexpr std::size_t kLongestRoute = 128;
/// What is cut off of a longer name cannot make it a name of this machine.
constexpr std::size_t kLongestAuthority = 512;

/// A header's value; empty if the header is absent or comes more than once (then `is_doubled` is set).
std::string text_of(const grpc::CallbackServerContext& context, const char* header, bool& is_doubled) {
  const auto [first, last] = context.client_metadata().equal_range(header);
  is_doubled = first != last && std::next(first) != last;
  if (first == last || is_doubled) return "";
  return {first->second.data(), first->second.size()};
}

std::shared_ptr<CallRecord> begin_record(Backend& backend, const grpc::CallbackServerContext& context,
                                         std::string_view method) {
  CallContext call;
  bool is_parent_doubled = false;  // then there is no trace id: W3C Trace Context, 3.2
  const std::string trace_parent = text_of(context, "traceparent", is_parent_doubled);
  if (trace_parent.size() <= kLongestTraceParent) call.trace_id = trace_id_of(trace_parent);
  call.authorization = text_of(context, "authorization", call.is_authorization_doubled);
  const grpc::string_ref authority = context.ExperimentalGetAuthority();
  call.authority.assign(authority.data(), std::min(authority.size(), kLongestAuthority));
  const std::string route = text_of(context, "lpdeform-session", call.is_route_doubled);
  if (route.size() <= kLongestRoute) call.route = route;
  if (const auto when = context.deadline(); when != std::chrono::system_clock::time_point::max())
    call.deadline = {when, when - std::chrono::system_clock::now()};
  if (const auto auth = context.auth_context(); auth && auth->IsPeerAuthenticated()) {
    for (const grpc::string_ref& name : auth->GetPeerIdentity()) {
      call.peer_identity.assign(name.data(), name.size());
      break;
    }
  }
  return backend.begin_record(absl::StrCat(v1::DeformService::service_full_name(), "/",
                                           absl::string_view(method.data(), method.size())),
                              std::move(call));
}

/// Runs `task` on the pool. The call ends when `task` calls the function that it is given.
using Finish = std::function<void(const absl::Status&)>;
grpc::ServerUnaryReactor* in_pool(Backend& backend, grpc::CallbackServerContext& context,
                                  const std::shared_ptr<CallRecord>& record,
                                  const google::protobuf::Message& response,
                                  std::function<void(const Finish&)> task) {
  grpc::ServerUnaryReactor* const reactor = context.DefaultReactor();
  const auto finish = [record, reactor, &response](const absl::Status& status) {
    if (status.ok()) record->sent(response.ByteSizeLong());
    record->ended(status);
    reactor->Finish(to_grpc(status));
  };
  if (!record->is_let_in()) {
    finish(server_draining());
  } else if (!backend.pool().try_post([task = std::move(task), finish] { task(finish); })) {
    finish(server_busy(backend.pool().expected_wait()));
  }
  return reactor;
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* in_pool(Backend& backend, grpc::CallbackServerContext& context,
                                  std::string_view method,
                                  absl::Status (Backend::*handler)(const CallContext&, const Request&,
                                                                   Response&),
                                  const Request& request, Response& response) {
  const auto record = begin_record(backend, context, method);
  record->received(request.ByteSizeLong());
  return in_pool(backend, context, record, response,
                 [&backend, record, handler, &request, &response](const Finish& finish) {
                   finish((backend.*handler)(record->context(), request, response));
                 });
}

void note_session(const Backend& backend, CallRecord& record, const std::string& name) {
  const auto session = backend.find(record.context(), Backend::Access::kRead, name);
  if (session.ok()) record.about(*session);
}

/// The input_seq and handle of a call that carries an update or an undo.
template <typename Request>
void note_input(CallRecord& record, const Request& request) {
  if constexpr (std::is_same_v<Request, v1::UpdateHandlesRequest>)
    record.about(refused_input(request.update()));
  if constexpr (std::is_same_v<Request, v1::UndoUpdateRequest>)
    record.about(RefusedInput{request.input_seq()});
}

/// A call about a session, which may first have to be restored from the store.
template <typename Request, typename Response>
grpc::ServerUnaryReactor* about_session(Backend& backend, grpc::CallbackServerContext& context,
                                        std::string_view method,
                                        void (Backend::*handler)(const CallContext&, const Request&,
                                                                 Response&, Backend::Done),
                                        const Request& request, Response& response) {
  const auto record = begin_record(backend, context, method);
  record->received(request.ByteSizeLong());
  return in_pool(backend, context, record, response,
                 [&backend, record, handler, &request, &response](const Finish& finish) {
                   // Only a refusal is logged, so the session is looked up only then.
                   const auto tell = [&backend, record, &request, finish](const absl::Status& status) {
                     if (!status.ok()) {
                       note_session(backend, *record, request.session());
                       note_input(*record, request);
                     }
                     finish(status);
                   };
                   (backend.*handler)(record->context(), request, response, tell);
                 });
}

int index_of(const char* method) {
  const auto* const calls = v1::DeformRequest::descriptor()->file()->FindServiceByName("DeformService");
  return calls->FindMethodByName(method)->index();
}

/// A call that is answered when the store has answered.
template <typename Request, typename Response>
grpc::ServerUnaryReactor* answered_later(Backend& backend, grpc::CallbackServerContext& context,
                                         std::string_view method,
                                         void (Backend::*handler)(const CallContext&, const Request&,
                                                                  Response&, Backend::Done),
                                         const Request& request, Response& response) {
  const auto record = begin_record(backend, context, method);
  record->received(request.ByteSizeLong());
  return in_pool(backend, context, record, response,
                 [&backend, record, handler, &request, &response](const Finish& finish) {
                   (backend.*handler)(record->context(), request, response, finish);
                 });
}

}  // namespace

/// Replaces the handlers of the generated code: Deform takes messages as they come (received.h), and the
/// numbers of frames are sent without a copy (outgoing.h).
Service::Service(Backend& backend) : backend_(backend) {
  MarkMethodCallback(
      index_of("Deform"),
      new grpc::internal::CallbackBidiHandler<Received<v1::DeformRequest>, Outgoing<v1::DeformResponse>>(
          [this](grpc::CallbackServerContext* context) {
            return deform(backend_, begin_record(backend_, *context, "Deform"));
          }));
  stream_with<v1::StreamFramesRequest, v1::StreamFramesResponse>("StreamFrames", stream_frames);
  stream_with<v1::StreamSessionsRequest, v1::StreamSessionsResponse>("StreamSessions", stream_sessions);
  stream_with<v1::SolveRequest, v1::SolveResponse>("Solve", solve);
}

template <typename Request, typename Response, typename Begin>
void Service::stream_with(const char* method, Begin begin) {
  MarkMethodCallback(index_of(method),
                     new grpc::internal::CallbackServerStreamingHandler<Request, Outgoing<Response>>(
                         [this, method, begin](grpc::CallbackServerContext* context, const Request* request) {
                           return begin(backend_, begin_record(backend_, *context, method), *request);
                         }));
}

grpc::ServerUnaryReactor* Service::CreateUpload(Context* context, const v1::CreateUploadRequest* request,
                                                v1::CreateUploadResponse* response) {
  return in_pool(backend_, *context, "CreateUpload", &Backend::create_upload, *request, *response);
}

grpc::ServerUnaryReactor* Service::UploadPart(Context* context, const v1::UploadPartRequest* request,
                                              v1::UploadPartResponse* response) {
  return in_pool(backend_, *context, "UploadPart", &Backend::upload_part, *request, *response);
}

grpc::ServerUnaryReactor* Service::DeleteUpload(Context* context, const v1::DeleteUploadRequest* request,
                                                v1::DeleteUploadResponse* response) {
  return in_pool(backend_, *context, "DeleteUpload", &Backend::delete_upload, *request, *response);
}

grpc::ServerUnaryReactor* Service::CreateSession(Context* context, const v1::CreateSessionRequest* request,
                                                 v1::CreateSessionResponse* response) {
  return answered_later(backend_, *context, "CreateSession", &Backend::create_session, *request, *response);
}

grpc::ServerUnaryReactor* Service::RestoreSession(Context* context, const v1::RestoreSessionRequest* request,
                                                  v1::RestoreSessionResponse* response) {
  return answered_later(backend_, *context, "RestoreSession", &Backend::restore_session, *request, *response);
}

grpc::ServerWriteReactor<v1::SnapshotSessionResponse>* Service::SnapshotSession(
    Context* context, const v1::SnapshotSessionRequest* request) {
  return snapshot_session(backend_, begin_record(backend_, *context, "SnapshotSession"), *request);
}

grpc::ServerUnaryReactor* Service::GetSession(Context* context, const v1::GetSessionRequest* request,
                                              v1::GetSessionResponse* response) {
  return about_session(backend_, *context, "GetSession", &Backend::get_session, *request, *response);
}

grpc::ServerUnaryReactor* Service::ListSessions(Context* context, const v1::ListSessionsRequest* request,
                                                v1::ListSessionsResponse* response) {
  return answered_later(backend_, *context, "ListSessions", &Backend::list_sessions, *request, *response);
}

grpc::ServerUnaryReactor* Service::DeleteSession(Context* context, const v1::DeleteSessionRequest* request,
                                                 v1::DeleteSessionResponse* response) {
  return about_session(backend_, *context, "DeleteSession", &Backend::delete_session, *request, *response);
}

grpc::ServerUnaryReactor* Service::AcquireWriter(Context* context, const v1::AcquireWriterRequest* request,
                                                 v1::AcquireWriterResponse* response) {
  return about_session(backend_, *context, "AcquireWriter", &Backend::acquire_writer, *request, *response);
}

grpc::ServerUnaryReactor* Service::UpdateHandles(Context* context, const v1::UpdateHandlesRequest* request,
                                                 v1::UpdateHandlesResponse* response) {
  return about_session(backend_, *context, "UpdateHandles", &Backend::update_handles, *request, *response);
}

grpc::ServerUnaryReactor* Service::UndoUpdate(Context* context, const v1::UndoUpdateRequest* request,
                                              v1::UndoUpdateResponse* response) {
  return about_session(backend_, *context, "UndoUpdate", &Backend::undo_update, *request, *response);
}

grpc::ServerUnaryReactor* Service::TakeBetterShape(Context* context,
                                                   const v1::TakeBetterShapeRequest* request,
                                                   v1::TakeBetterShapeResponse* response) {
  return about_session(backend_, *context, "TakeBetterShape", &Backend::take_better_shape, *request,
                       *response);
}

grpc::ServerUnaryReactor* Service::AckFrames(Context* context, const v1::AckFramesRequest* request,
                                             v1::AckFramesResponse* response) {
  return about_session(backend_, *context, "AckFrames", &Backend::ack_frames, *request, *response);
}

}  // namespace lpdeform
