#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "lpdeform/v1/service.pb.h"
#include "server/budget.h"
#include "server/call_context.h"
#include "server/call_gate.h"
#include "server/call_record.h"
#include "server/decode.h"
#include "server/log.h"
#include "server/metrics.h"
#include "server/registry.h"
#include "server/scheduler.h"
#include "server/server.h"
#include "server/task_pool.h"
#include "server/tokens.h"
#include "server/upload.h"

namespace lpdeform {

/// All that the calls of a server share, and what they do, without gRPC: each function takes a request to its
/// response. Called from the task pool and the scheduler, never from gRPC's threads. Thread-safe.
class Backend {
 public:
  /// `tokens`: null where callers need none.
  explicit Backend(const ServerOptions& options, std::unique_ptr<Tokens> tokens = nullptr);

  absl::Status create_upload(const CallContext& call, const v1::CreateUploadRequest& request,
                             v1::CreateUploadResponse& response);
  absl::Status upload_part(const CallContext& call, const v1::UploadPartRequest& request,
                           v1::UploadPartResponse& response);
  absl::Status delete_upload(const CallContext& call, const v1::DeleteUploadRequest& request,
                             v1::DeleteUploadResponse& response);
  absl::Status get_session(const CallContext& call, const v1::GetSessionRequest& request,
                           v1::GetSessionResponse& response);
  absl::Status list_sessions(const CallContext& call, const v1::ListSessionsRequest& request,
                             v1::ListSessionsResponse& response);
  absl::Status delete_session(const CallContext& call, const v1::DeleteSessionRequest& request,
                              v1::DeleteSessionResponse& response);
  absl::Status acquire_writer(const CallContext& call, const v1::AcquireWriterRequest& request,
                              v1::AcquireWriterResponse& response);
  absl::Status update_handles(const CallContext& call, const v1::UpdateHandlesRequest& request,
                              v1::UpdateHandlesResponse& response);
  absl::Status ack_frames(const CallContext& call, const v1::AckFramesRequest& request,
                          v1::AckFramesResponse& response);

  /// Does not wait for the session to be made: `done` is called when it is, on a thread of the scheduler, or
  /// at once. `request` and `response` must live until then.
  void create_session(const CallContext& call, const v1::CreateSessionRequest& request,
                      v1::CreateSessionResponse& response, std::function<void(absl::Status)> done);

  /// What a call is going to do.
  enum class Access { kRead, kChange };
  /// Who calls. UNAUTHENTICATED as Tokens::check; PERMISSION_DENIED READ_ONLY.
  absl::StatusOr<Caller> identify(const CallContext& call, Access access) const;
  /// A session of the caller's. Errors: as identify; NOT_FOUND SESSION_UNKNOWN.
  absl::StatusOr<std::shared_ptr<Session>> find(const CallContext& call, Access access,
                                                const std::string& name) const;

  /// A stream of a session, which is found by its name; with a token, the writer's. `wake` as FrameStream::start has it.
  struct OpenStream {
    std::shared_ptr<Session> session;
    std::shared_ptr<FrameStream> stream;
  };
  absl::StatusOr<OpenStream> open_stream(const CallContext& call, const std::string& session_name,
                                         const std::string& token, const v1::FrameOptions& options,
                                         std::function<void()> wake);

  /// Lets go of a stream that is over.
  void forget(const CallContext& call, const OpenStream& open);

  /// Decodes an update for a session and gives it to it.
  absl::StatusOr<UpdateResult> update(const CallContext& call, Session& session, const std::string& token,
                                      const v1::Update& update);

  /// Decodes what a Solve call asks for and begins it.
  absl::Status solve(const CallContext& call, const v1::SolveRequest& request,
                     SolveJob::OnProgress on_progress, SolveJob::OnDone on_done,
                     std::shared_ptr<SolveJob>& job);

  const Log& log() const { return *log_; }

  /// All metrics in Prometheus's text format.
  std::string metrics_text() const;

  /// A new record of a call, for its edge.
  std::shared_ptr<CallRecord> begin_record(std::string method, CallContext context);

  const std::shared_ptr<Timers> timers;
  const std::shared_ptr<Metrics> metrics = std::make_shared<Metrics>();
  const std::shared_ptr<Registry> registry;
  CallGate gate;

 private:
  std::function<void(double)> observer(Span span) const;
  void log_solved(const Session& session, const SolveResult& result, const std::string& trace_id) const;
  absl::StatusOr<std::shared_ptr<Session>> make_session(const CallContext& call, const std::string& owner,
                                                        const v1::CreateSessionRequest& request);
  /// Fills in the shape and the mesh that it is drawn as.
  static absl::Status make_mesh(const v1::CreateSessionRequest& request, Decoder& decoder,
                                SessionParts& parts);

  const ServerOptions options_;
  const std::shared_ptr<Tokens> tokens_;
  const std::shared_ptr<const Log> log_;
  const std::shared_ptr<Budget> budget_;
  const std::shared_ptr<Uploads> uploads_;

 public:
  // Last, so that their threads end first.
  Scheduler scheduler;
  TaskPool pool;
};

}  // namespace lpdeform
