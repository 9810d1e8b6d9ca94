#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/analysis/shape_features.h"
#include "core/solve/deformer.h"
#include "server/runtime/budget.h"
#include "server/runtime/metrics.h"
#include "server/runtime/scheduler.h"
#include "server/runtime/timers.h"
#include "server/session/live_solver.h"
#include "server/session/mailbox.h"
#include "server/session/publisher.h"
#include "server/session/solve_job.h"

namespace lpdeform {

/// What a session that is made again, from a store or a file, goes on from.
struct SessionPast {
  std::string token;                 // of its writer
  std::uint64_t epoch = 1;           // above those it had
  std::int64_t created_unix_ms = 0;  // 0: now
  InputAges ages = {};
  InputHistory history = {};
};

/// What a session is made of.
struct SessionParts {
  std::string name;
  std::string owner = {};  // the subject of the caller that made it
  std::string route = {};  // see Session::route
  std::shared_ptr<const RestShape> shape;
  std::shared_ptr<const ShapeFeatures> features = nullptr;  // of `shape`; made where left out
  std::unique_ptr<Deformer> deformer;
  std::shared_ptr<const DrawMesh> mesh = nullptr;  // null: the shape's own vertices
  FreeComponents free_components = FreeComponents::kError;
  Update beginning;                      // settings and handles to begin with
  std::optional<SessionPast> past = {};  // of one that is made again: then `beginning` is its state
  bool has_surface = false;              // `deformer` begins with the state of another session
  Reservation memory;                    // the estimate that it was admitted with
};

/// What one session may have.
struct SessionLimits {
  std::size_t streams = 256;
  InputLimits inputs = {};
};

/// What everybody's sessions share.
struct SessionServices {
  Scheduler& scheduler;
  std::shared_ptr<Timers> timers;
  Timers::Duration heartbeat;
  std::shared_ptr<Metrics> metrics = std::make_shared<Metrics>();
  SessionLimits limits = {};
};

/// What GetSession tells.
struct SessionInfo {
  std::string name, route;
  std::uint64_t epoch = 0;
  std::shared_ptr<const RestShape> shape;
  std::shared_ptr<const DrawMesh> mesh;
  FreeComponents free_components = FreeComponents::kError;
  Inputs inputs;
  std::int64_t created_unix_ms = 0;
  Timers::TimePoint last_used;
  std::size_t memory_bytes = 0;
  std::size_t undo_steps = 0, redo_steps = 0;
};

/// Who may change a session, and since when.
struct WriterLease {
  std::string token;
  std::uint64_t epoch = 0;
  std::uint64_t input_seq = 0;
};

/// What a store is to be told of a session.
struct SessionChanges {
  WriterLease lease;
  InputChanges inputs;
};

/// A mesh being deformed for one writer and any number of readers: a mailbox that updates go into, a live
/// solver that a scheduler's threads run, a publisher that frames come out of. Every function but run() may
/// be called from any thread and takes no longer than looking at its arguments.
class Session final : public Runnable, public std::enable_shared_from_this<Session> {
 public:
  /// Errors: what Mailbox::take has to say about the beginning.
  static absl::StatusOr<std::shared_ptr<Session>> create(SessionParts parts, SessionServices services);

  const std::string& name() const { return name_; }
  const std::string& owner() const { return owner_; }
  /// What the header lpdeform-session of the call that made it said: a proxy that chooses a server by it sends all calls that say
  /// the same to one. Empty where there was none.
  const std::string& route() const { return route_; }
  /// The client's.
  std::uint32_t vertex_count() const { return mesh_->vertex_count(); }
  const DrawMesh& mesh() const { return *mesh_; }
  const ShapeFeatures& features() const { return *features_; }
  SessionInfo info() const;
  /// The newest frame, of this epoch or of one before; and whether its surface comes from a solve, here or in the session that
  /// this one was made from.
  std::shared_ptr<const Frame> newest_frame() const { return publisher_->newest(); }
  /// The reason of the fault for which there are no frames of the newest inputs; empty where there is none.
  std::string standing_fault() const;
  bool has_surface() const { return has_surface_ || newest_frame()->method != Method::kAuto; }
  WriterLease lease() const;
  std::int64_t created_unix_ms() const { return created_unix_ms_; }
  /// Of the inputs: rises with each change that is to be kept.
  std::uint64_t revision() const { return mailbox_.revision(); }
  /// Who writes, and what has changed since `revision`; since 0, all.
  SessionChanges changes_since(std::uint64_t revision) const;

  /// Who has shown the writer token, in which epoch. It is asked for once a call or stream; until another writer takes over, it
  /// stands for the token.
  struct Writer {
    std::uint64_t epoch = 0;
  };
  /// UNAUTHENTICATED WRITER_TOKEN_MISSING, PERMISSION_DENIED NOT_THE_WRITER.
  absl::StatusOr<Writer> writer(const std::string& token) const;

  /// A new token and a new epoch; the writer before is one no more, and its Solve and Deform calls end.
  WriterLease acquire_writer();

  /// Errors: that of `writer`; NOT_THE_WRITER where another one has taken over since; those of Mailbox::take; once closed NOT_FOUND
  /// SESSION_UNKNOWN, or UNAVAILABLE DRAINING where it goes on elsewhere.
  absl::StatusOr<UpdateResult> update(const absl::StatusOr<Writer>& writer, const Update& update);

  /// Takes the newest step of the handles back, or does again what was taken back last. Errors: as update(), with
  /// those of Mailbox::undo.
  absl::StatusOr<UndoResult> undo(const absl::StatusOr<Writer>& writer, std::uint64_t input_seq, bool redo);

  /// Takes `update` in, if there is one, and runs `job`; an earlier job ends with ABORTED SUPERSEDED. Errors
  /// as update(); then the job does not begin.
  absl::Status solve(const absl::StatusOr<Writer>& writer, const std::optional<Update>& update,
                     const std::shared_ptr<SolveJob>& job);

  /// A new stream. With a writer, it is theirs, and ends when another takes over. Errors: NOT_THE_WRITER where one has taken over
  /// since; once closed as update(); UNAVAILABLE DRAINING; RESOURCE_EXHAUSTED STREAMS_FULL.
  absl::StatusOr<std::shared_ptr<FrameStream>> open_stream(const std::optional<Writer>& writer,
                                                           const StreamOptions& options);
  /// Somebody looks on, or may go on with a drag that rests, even where nobody has called for long.
  bool has_streams() const { return publisher_->reader_count() > 0; }
  /// The stream has ended and is forgotten; with the last one, live solving rests.
  void forget_stream(const FrameStream& stream);

  /// NOT_FOUND STREAM_UNKNOWN, and as FrameStream::acknowledge.
  absl::Status acknowledge(const std::string& stream_id, std::uint64_t frame_seq);

  /// Ends every stream, as the server shuts down, and takes no more. A Solve call goes on.
  void drain(const std::string& text);

  /// Ends every stream and the solver. Again: nothing.
  void close(EndReason reason, const std::string& text);
  bool is_closed() const { return is_closed_; }

  /// Somebody uses the session.
  void touch();
  /// The last time that anybody did; now where a Solve call runs.
  Timers::TimePoint last_used() const;

  bool run() override;

 private:
  Session(SessionParts parts, SessionServices services);
  absl::Status check_still_writes_locked(const absl::StatusOr<Writer>& writer) const;
  template <typename Change>
  auto take_in(const absl::StatusOr<Writer>& writer, const Change& change);
  absl::Status closed() const;
  std::shared_ptr<SolveJob> take_job();
  void end_job(const absl::Status& why);
  std::shared_ptr<SolveJob> job() const;

  const std::string name_;
  const std::string owner_;
  const std::string route_;
  const std::shared_ptr<const RestShape> shape_;
  const std::shared_ptr<const DrawMesh> mesh_;
  const std::shared_ptr<const ShapeFeatures> features_;
  const FreeComponents free_components_;
  const SessionServices services_;
  const std::int64_t created_unix_ms_;
  const bool has_surface_;
  std::atomic<Timers::TimePoint> last_used_;
  std::atomic<bool> is_closed_ = false;
  std::atomic<EndReason> closed_by_ = EndReason::kSessionDeleted;
  std::atomic<bool> is_draining_ = false;
  std::stop_source stop_;
  Mailbox mailbox_;
  const std::shared_ptr<Publisher> publisher_;
  Reservation memory_;  // the scheduler's threads alone
  std::atomic<std::size_t> memory_bytes_;
  std::unique_ptr<LiveSolver> solver_;  // the scheduler's threads alone

  mutable std::mutex writing_;  // an update of an old writer never comes after a new one's first
  std::string token_;
  std::uint64_t epoch_;
  std::vector<std::weak_ptr<FrameStream>> writers_;

  mutable std::mutex mutex_;
  std::shared_ptr<SolveJob> job_;
};

}  // namespace lpdeform
