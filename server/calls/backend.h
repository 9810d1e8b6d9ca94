#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "lpdeform/v1/service.pb.h"
#include "server/access/tokens.h"
#include "server/calls/call_context.h"
#include "server/calls/call_gate.h"
#include "server/calls/call_record.h"
#include "server/calls/geometry_queue.h"
#include "server/calls/options.h"
#include "server/calls/session_factory.h"
#include "server/keeping/keeper.h"
#include "server/runtime/budget.h"
#include "server/runtime/caller_limits.h"
#include "server/runtime/log.h"
#include "server/runtime/metrics.h"
#include "server/runtime/scheduler.h"
#include "server/runtime/task_pool.h"
#include "server/runtime/upload.h"
#include "server/session/registry.h"
#include "server/session/stream_end.h"
#include "server/wire/decode.h"

namespace lpdeform {

/// A session that was just made, and the part of it that a store keeps from the beginning.
struct NewSession {
  std::shared_ptr<Session> session;
  StoredHead head;  // empty without a store
};

/// What the log says of a refused update.
RefusedInput refused_input(const v1::Update& update);

/// Everything that the calls of a server share, and what they do, without gRPC: each function turns a request
/// into its response. Called from the task pool and the scheduler, never from gRPC's threads. Thread-safe.
class Backend {
 public:
  /// `tokens`: null if callers need none.
  explicit Backend(const ServerOptions& options, std::unique_ptr<Tokens> tokens = nullptr);

  absl::Status create_upload(const CallContext& call, const v1::CreateUploadRequest& request,
                             v1::CreateUploadResponse& response);
  absl::Status upload_part(const CallContext& call, const v1::UploadPartRequest& request,
                           v1::UploadPartResponse& response);
  absl::Status delete_upload(const CallContext& call, const v1::DeleteUploadRequest& request,
                             v1::DeleteUploadResponse& response);
  // These calls do not wait for a session to be made, or for the store. `done` is called when everything is
  // done: at once, or on another thread. `request` and `response` must live until then.
  using Done = std::function<void(absl::Status)>;
  void create_session(const CallContext& call, const v1::CreateSessionRequest& request,
                      v1::CreateSessionResponse& response, Done done);
  void restore_session(const CallContext& call, const v1::RestoreSessionRequest& request,
                       v1::RestoreSessionResponse& response, Done done);
  void list_sessions(const CallContext& call, const v1::ListSessionsRequest& request,
                     v1::ListSessionsResponse& response, Done done);
  void get_session(const CallContext& call, const v1::GetSessionRequest& request,
                   v1::GetSessionResponse& response, Done done);
  void ack_frames(const CallContext& call, const v1::AckFramesRequest& request,
                  v1::AckFramesResponse& response, Done done);
  void delete_session(const CallContext& call, const v1::DeleteSessionRequest& request,
                      v1::DeleteSessionResponse& response, Done done);
  void acquire_writer(const CallContext& call, const v1::AcquireWriterRequest& request,
                      v1::AcquireWriterResponse& response, Done done);
  void update_handles(const CallContext& call, const v1::UpdateHandlesRequest& request,
                      v1::UpdateHandlesResponse& response, Done done);
  void take_better_shape(const CallContext& call, const v1::TakeBetterShapeRequest& request,
                         v1::TakeBetterShapeResponse& response, Done done);
  void undo_update(const CallContext& call, const v1::UndoUpdateRequest& request,
                   v1::UndoUpdateResponse& response, Done done);

  /// What a call intends to do.
  enum class Access { kRead, kChange };
  /// Identifies the caller. Errors: UNAUTHENTICATED as Tokens::check, AUTHORIZATION_TWICE; PERMISSION_DENIED
  /// READ_ONLY, HOST_FOREIGN; INVALID_ARGUMENT ROUTE_TWICE.
  absl::StatusOr<Caller> identify(const CallContext& call, Access access) const;
  /// One of the caller's sessions. Errors: as identify(); NOT_FOUND SESSION_UNKNOWN.
  absl::StatusOr<std::shared_ptr<Session>> find(const CallContext& call, Access access,
                                                const std::string& name) const;

  /// Calls `then` with the session of this name. If the session is here, that is at once; if only the store
  /// has it, later on a thread of the pool, when it has been restored. Errors: as find(); UNAVAILABLE
  /// STORE_FAILING; NOT_FOUND SESSION_DAMAGED; RESOURCE_EXHAUSTED as CreateSession.
  using OnSession = std::function<void(absl::StatusOr<std::shared_ptr<Session>>)>;
  void with_session(const CallContext& call, Access access, const std::string& name, OnSession then);

  /// Which session a writer wants to change, and the writer.
  struct Change {
    std::shared_ptr<Session> session;
    absl::StatusOr<Session::Writer> writer{};
  };
  /// Calls `then` with OK once an update of this session can be decoded without waiting for its geometry.
  /// Errors: that of `writer`; as GeometryQueue::when_found.
  void when_decodable(const Change& change, const v1::Update& update, Done then);

  /// Releases all sessions as the process shuts down, and waits until the store has their changes, up to
  /// kFlushPatience. Returns whether it has.
  bool release_sessions(const std::string& text);
  static constexpr std::chrono::seconds kFlushPatience{5};

  /// A session's file, and the memory reserved for it. Only for callers who may change the session, because
  /// the file reveals its mesh.
  struct SnapshotFile {
    std::string bytes;
    Reservation memory;
  };
  /// Errors: as encode_snapshot; RESOURCE_EXHAUSTED MEMORY_FULL, CALLER_MEMORY_FULL.
  absl::StatusOr<SnapshotFile> snapshot(const CallContext& call, const Session& session) const;

  /// A stream of a session; with a token it belongs to the writer. `wake`: see FrameStream::start.
  struct OpenStream {
    Change change;  // what its updates change; for a reader the writer is an error
    std::shared_ptr<FrameStream> stream;
    CallerLimits::Place place = nullptr;
    const std::shared_ptr<Session>& session() const { return change.session; }
  };
  absl::StatusOr<OpenStream> open_stream(const CallContext& call, std::shared_ptr<Session> session,
                                         const std::string& token, const v1::FrameOptions& options,
                                         std::function<void()> wake);

  /// Forgets a stream that has ended, and logs why.
  void forget(const CallContext& call, const OpenStream& open, CallEnd how);

  /// Decodes an update and applies it to its session. `answered` is called with an error at once, otherwise
  /// when the update is stored or when that takes too long.
  using OnUpdated = std::function<void(absl::StatusOr<UpdateResult>)>;
  void update(const CallContext& call, const Change& change, const v1::Update& update,
              const OnUpdated& answered);

  /// Decodes a Solve call and begins it.
  absl::Status solve(const CallContext& call, const Change& change, const v1::SolveRequest& request,
                     SolveJob::OnProgress on_progress, SolveJob::OnDone on_done,
                     std::shared_ptr<SolveJob>& job);

  const Log& log() const { return *log_; }

  /// All metrics in Prometheus's text format.
  std::string metrics_text();

  /// A new record of a call, for the code that receives it.
  std::shared_ptr<CallRecord> begin_record(std::string method, CallContext context);

  /// The longest time without a message on a stream.
  Timers::Duration heartbeat() const { return options_.heartbeat; }

  const std::shared_ptr<Timers> timers;
  const std::shared_ptr<Metrics> metrics = std::make_shared<Metrics>();
  const std::shared_ptr<Registry> registry;
  CallGate gate;
  Scheduler& scheduler() { return scheduler_; }
  TaskPool& pool() { return pool_; }

 private:
  std::function<void(double)> observer(Span span) const;
  void log_solved(const Session& session, const SolveResult& result, const std::string& trace_id) const;
  absl::StatusOr<UpdateResult> take_update(const CallContext& call, const Change& change,
                                           const v1::Update& update);
  /// A call that creates a session. The same request_id and fingerprint give the same session.
  struct Creation {
    CallContext call;
    std::string request_id, owner;
    std::uint64_t fingerprint = 0;
    std::string_view event;                            // in the log
    std::function<absl::StatusOr<NewSession>()> make;  // on a thread of the scheduler
    Registry::OnCreated on_created;
  };
  template <typename Response>
  Registry::OnCreated answering(Response& response, Done done) const;
  void create_once(const Creation& creation);
  void make_session(const Creation& creation);
  absl::StatusOr<NewSession> make_new(const SessionMaker& maker, const v1::CreateSessionRequest& request,
                                      std::uint64_t fingerprint) const;
  absl::StatusOr<NewSession> make_restored(const SessionMaker& maker,
                                           const v1::RestoreSessionRequest& request,
                                           std::uint64_t fingerprint) const;
  void when_kept(const Session& session, std::uint64_t revision, Keeper::OnKept on_kept);
  void fetch(const CallContext& call, const std::string& name, const std::string& owner, OnSession then);
  void replace_writer(const CallContext& call, const std::shared_ptr<Session>& session,
                      v1::AcquireWriterResponse& response, const Done& done);
  void undo(Session& session, const v1::UndoUpdateRequest& request, v1::UndoUpdateResponse& response,
            const Done& done);
  void list_kept(const std::string& owner, const std::string& after, std::size_t most,
                 v1::ListSessionsResponse& response, Done done);
  void make_again(const std::string& name, absl::StatusOr<Keeper::Found> found);
  void end_restoring(const std::string& name, const absl::Status& status);
  void log_session(std::string_view event, const Session& session, const std::string& trace_id) const;

  const ServerOptions options_;
  const std::shared_ptr<Tokens> tokens_;
  const bool is_for_this_machine_;  // see names_this_machine()
  const std::shared_ptr<const Log> log_;
  const std::shared_ptr<Budget> budget_;
  const std::shared_ptr<Uploads> uploads_;
  const std::shared_ptr<CallerLimits> caller_limits_;
  const SessionFactory factory_;
  std::shared_ptr<Keeper> keeper_;  // null without a store

  struct Restoring {
    std::string owner;
    std::vector<Done> waiting;
  };
  std::mutex restoring_mutex_;
  std::map<std::string, Restoring> restoring_;  // by session name
  GeometryQueue geometry_{scheduler_, pool_, budget_};

  // Last, so that their threads end first.
  Scheduler scheduler_;
  TaskPool pool_;
};

}  // namespace lpdeform
