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

/// What a session that is restored from a store or a file continues from.
struct SessionPast {
  std::string token;                 // of the session's writer
  std::uint64_t epoch = 1;           // higher than any epoch before
  std::int64_t created_unix_ms = 0;  // 0: now
  InputAges ages = {};
  InputHistory history = {};
};

/// The parts to make a session of.
struct SessionParts {
  std::string name;
  std::string owner = {};  // the subject of the caller that created it
  std::string route = {};  // see Session::route
  std::shared_ptr<const RestShape> shape;
  std::shared_ptr<const ShapeFeatures> features = nullptr;  // of `shape`; computed if null
  std::unique_ptr<Deformer> deformer;
  std::shared_ptr<const DrawMesh> mesh = nullptr;  // null: the shape's own vertices
  FreeComponents free_components = FreeComponents::kError;
  Update beginning;                      // settings and handles to begin with
  std::optional<SessionPast> past = {};  // set for a restored session: then `beginning` is its state
  bool has_surface = false;              // `deformer` begins with the state of another session
  Reservation memory;                    // the estimate that was reserved when the session was admitted
};

/// Limits of one session.
struct SessionLimits {
  std::size_t streams = 256;
  InputLimits inputs = {};
};

/// What all sessions share.
struct SessionServices {
  Scheduler& scheduler;
  std::shared_ptr<Timers> timers;
  Timers::Duration heartbeat;
  std::shared_ptr<Metrics> metrics = std::make_shared<Metrics>();
  SessionLimits limits = {};
};

/// What GetSession returns.
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

/// The writer of a session: its token and its fencing epoch.
struct WriterLease {
  std::string token;
  std::uint64_t epoch = 0;
  std::uint64_t input_seq = 0;
};

/// The changes that a store must save.
struct SessionChanges {
  WriterLease lease;
  InputChanges inputs;
};

/// A mesh that is deformed for one writer and any number of readers. Updates go into a mailbox, a scheduler's
/// threads run a live solver, and a publisher sends frames. Every function but run() may be called from any
/// thread, and takes no longer than it needs to check its arguments.
class Session final : public Runnable, public std::enable_shared_from_this<Session> {
 public:
  /// Errors: those of Mailbox::take for the beginning.
  static absl::StatusOr<std::shared_ptr<Session>> create(SessionParts parts, SessionServices services);

  const std::string& name() const { return name_; }
  const std::string& owner() const { return owner_; }
  /// The header lpdeform-session of the call that created the session; empty if there was none. A proxy that
  /// routes by this header sends all calls with the same value to one server.
  const std::string& route() const { return route_; }
  /// Of the client's mesh.
  std::uint32_t vertex_count() const { return mesh_->vertex_count(); }
  const DrawMesh& mesh() const { return *mesh_; }
  const ShapeFeatures& features() const { return *features_; }
  SessionInfo info() const;
  /// The newest frame, of this epoch or an earlier one. has_surface(): whether its surface comes from a
  /// solve, here or in the session that this one was made from.
  std::shared_ptr<const Frame> newest_frame() const { return publisher_->newest(); }
  /// The reason of the fault that keeps the newest inputs from having frames; empty if there is none.
  std::string standing_fault() const;
  bool has_surface() const { return has_surface_ || newest_frame()->method != Method::kAuto; }
  WriterLease lease() const;
  std::int64_t created_unix_ms() const { return created_unix_ms_; }
  /// Of the inputs: rises with each change that must be stored.
  std::uint64_t revision() const { return mailbox_.revision(); }
  /// The writer, and what has changed since `revision`; everything if that is 0.
  SessionChanges changes_since(std::uint64_t revision) const;

  /// Proof that a caller has shown the writer token, and in which epoch. The token is checked once per call
  /// or stream. After that this object stands for it, until another writer takes over.
  struct Writer {
    std::uint64_t epoch = 0;
  };
  /// UNAUTHENTICATED WRITER_TOKEN_MISSING, PERMISSION_DENIED NOT_THE_WRITER.
  absl::StatusOr<Writer> writer(const std::string& token) const;

  /// Makes a new token and a new epoch. The previous writer loses its rights, and its Solve and Deform calls
  /// end.
  WriterLease acquire_writer();

  /// Errors: that of `writer`; NOT_THE_WRITER if another writer has taken over since; those of Mailbox::take.
  /// Once closed: NOT_FOUND SESSION_UNKNOWN, or UNAVAILABLE DRAINING if the session goes on elsewhere.
  absl::StatusOr<UpdateResult> update(const absl::StatusOr<Writer>& writer, const Update& update);

  /// Undoes the newest step of the handles, or redoes the step that was undone last. Errors: as update(), and
  /// those of Mailbox::undo.
  absl::StatusOr<UndoResult> undo(const absl::StatusOr<Writer>& writer, std::uint64_t input_seq, bool redo);

  /// Shows the better shape that was announced for the newest inputs. What comes after it, an update or a
  /// solve, goes on from that shape. Errors: as update(); FAILED_PRECONDITION NO_BETTER_SHAPE.
  absl::StatusOr<BetterNote> take_better(const absl::StatusOr<Writer>& writer);

  /// Takes `update`, if there is one, and runs `job`. An earlier job ends with ABORTED SUPERSEDED. Errors: as
  /// update(); then the job does not begin.
  absl::Status solve(const absl::StatusOr<Writer>& writer, const std::optional<Update>& update,
                     const std::shared_ptr<SolveJob>& job);

  /// Opens a stream. A stream with a writer belongs to that writer and ends when another takes over. Errors:
  /// NOT_THE_WRITER if another writer has taken over since; once closed as update(); UNAVAILABLE DRAINING;
  /// RESOURCE_EXHAUSTED STREAMS_FULL.
  absl::StatusOr<std::shared_ptr<FrameStream>> open_stream(const std::optional<Writer>& writer,
                                                           const StreamOptions& options);
  /// Whether a stream is open. Then the session is in use, even if no call has come for long: a reader
  /// watches, or a drag rests.
  bool has_streams() const { return publisher_->reader_count() > 0; }
  /// Forgets a stream that has ended. When no stream is left, live solving pauses.
  void forget_stream(const FrameStream& stream);

  /// Errors: NOT_FOUND STREAM_UNKNOWN, and those of FrameStream::acknowledge.
  absl::Status acknowledge(const std::string& stream_id, std::uint64_t frame_seq);

  /// Ends every stream because the server shuts down, and accepts no more. A Solve call goes on.
  void drain(const std::string& text);

  /// Ends every stream and the solver. A second call does nothing.
  void close(EndReason reason, const std::string& text);
  bool is_closed() const { return is_closed_; }

  /// Notes that the session is in use.
  void touch();
  /// When the session was last used; now if a Solve call runs.
  Timers::TimePoint last_used() const;

  bool run() override;

 private:
  Session(SessionParts parts, SessionServices services);
  absl::Status check_still_writes_locked(const absl::StatusOr<Writer>& writer) const;
  template <typename Change>
  auto take_in(const absl::StatusOr<Writer>& writer, const Change& change);
  template <typename Change>
  auto take_in_locked(const absl::StatusOr<Writer>& writer, const Change& change);
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
  Reservation memory_;  // used by the scheduler's threads only
  std::atomic<std::size_t> memory_bytes_;
  std::unique_ptr<LiveSolver> solver_;  // used by the scheduler's threads only

  mutable std::mutex writing_;  // no update of the old writer comes after the first of a new one
  std::string token_;
  std::uint64_t epoch_;
  std::vector<std::weak_ptr<FrameStream>> writers_;

  mutable std::mutex mutex_;
  std::shared_ptr<SolveJob> job_;
};

}  // namespace lpdeform
