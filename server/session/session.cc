#include "server/session/session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/runtime/random_name.h"
#include "server/runtime/refusals.h"

namespace lpdeform {
namespace {

/// A slice of a larger mesh may take long: see Scheduler.
constexpr std::int32_t kHeavyVertices = 20000;

/// One step of a large mesh costs more than many steps of a small one. With equal shares of the time a large
/// mesh would make next to no progress beside many small ones.
double weight_of(std::int32_t vertices) {
  constexpr double kPlain = 1000;
  return std::sqrt(std::max(1.0, vertices / kPlain));
}

std::int64_t unix_ms_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

/// Takes the same time for a token that is nearly right as for any other.
bool is_same_token(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t k = 0; k < a.size(); ++k) difference |= static_cast<unsigned char>(a[k] ^ b[k]);
  return difference == 0;
}

absl::Status not_the_writer() {
  return make_fault({Reason::kNotTheWriter, "writer_token", ""},
                    "The writer token is not that of the session's present writer.");
}

std::uint64_t input_seq_of(const UpdateResult& result) {
  return result.input_seq;
}

std::uint64_t input_seq_of(const UndoResult& result) {
  return result.update.input_seq;
}

absl::Status too_many_streams(std::size_t most) {
  return make_fault(
      {Reason::kStreamsFull, "streams", absl::StrCat("streams <= ", most)},
      absl::StrCat("The session has all of its ", most, " streams in use; end one, or try again later."));
}

absl::Status ended_by(EndReason reason, const std::string& text) {
  if (goes_on(reason)) return server_draining();
  const Reason why = reason == EndReason::kSessionExpired ? Reason::kSessionExpired : Reason::kSessionDeleted;
  return make_fault({why, "", ""}, text);
}

/// Finds the energies of the surface that a session begins with. If its handles are refused, the energies leave out soft handles.
void measure(Deformer& deformer, const Inputs& inputs) {
  absl::Status status = deformer.set_material(*inputs.material);
  if (status.ok() && !inputs.handles->handles().empty()) status = deformer.set_handles(*inputs.handles);
  deformer.measure();
}

}  // namespace

absl::StatusOr<std::shared_ptr<Session>> Session::create(SessionParts parts, SessionServices services) {
  const Update beginning = std::move(parts.beginning);
  const std::optional<SessionPast> past = parts.past;
  std::unique_ptr<Deformer> deformer = std::move(parts.deformer);
  const std::shared_ptr<Session> session(new Session(std::move(parts), std::move(services)));
  const absl::Status begun = past ? session->mailbox_.begin_again(beginning, past->ages, past->history)
                                  : session->mailbox_.begin_with(beginning);
  if (!begun.ok()) return begun;
  if (session->has_surface_) measure(*deformer, session->mailbox_.newest());
  LiveSolver::Alarm alarm{session->services_.timers, [weak = session->weak_from_this()] {
                            if (const auto self = weak.lock()) self->services_.scheduler.wake(self);
                          }};
  session->solver_ =
      std::make_unique<LiveSolver>(std::move(deformer), session->mailbox_, *session->publisher_,
                                   session->mesh_, std::move(alarm), session->stop_.get_token());
  return session;
}

Session::Session(SessionParts parts, SessionServices services)
    : Runnable(parts.shape->vertex_count() > kHeavyVertices, weight_of(parts.shape->vertex_count())),
      name_(std::move(parts.name)),
      owner_(std::move(parts.owner)),
      route_(std::move(parts.route)),
      shape_(std::move(parts.shape)),
      mesh_(parts.mesh ? std::move(parts.mesh) : std::make_shared<const DrawMesh>(shape_)),
      features_(parts.features ? std::move(parts.features) : std::make_shared<ShapeFeatures>(shape_)),
      free_components_(parts.free_components),
      services_(std::move(services)),
      created_unix_ms_(parts.past && parts.past->created_unix_ms != 0 ? parts.past->created_unix_ms
                                                                      : unix_ms_now()),
      has_surface_(parts.has_surface),
      last_used_(services_.timers->now()),
      mailbox_(shape_, mesh_->weld(), services_.limits.inputs, services_.timers),
      publisher_(std::make_shared<Publisher>(services_.metrics)),
      memory_(std::move(parts.memory)),
      memory_bytes_(memory_.bytes()),
      token_(parts.past ? parts.past->token : random_hex_128()),
      epoch_(parts.past ? parts.past->epoch : 1) {
  publisher_->begin_epoch(epoch_);
}

SessionInfo Session::info() const {
  const Mailbox::HistorySize history = mailbox_.history_size();
  return {name_,
          route_,
          lease().epoch,
          shape_,
          mesh_,
          free_components_,
          mailbox_.newest(),
          created_unix_ms_,
          last_used_.load(),
          memory_bytes_.load(),
          history.undo_steps,
          history.redo_steps};
}

std::string Session::standing_fault() const {
  const auto standing = publisher_->standing();
  return standing ? fault_of(standing->fault.status).reason : "";
}

WriterLease Session::lease() const {
  const std::scoped_lock lock(writing_);
  return {token_, epoch_, mailbox_.newest().input_seq};
}

SessionChanges Session::changes_since(std::uint64_t revision) const {
  const std::scoped_lock lock(writing_);
  InputChanges inputs = mailbox_.changes_since(revision);
  return {{token_, epoch_, inputs.inputs.input_seq}, std::move(inputs)};
}

absl::StatusOr<Session::Writer> Session::writer(const std::string& token) const {
  if (token.empty()) {
    return make_fault({Reason::kWriterTokenMissing, "writer_token", ""},
                      "Changing a session needs its writer token.");
  }
  const std::scoped_lock lock(writing_);
  if (is_same_token(token, token_)) return Writer{epoch_};
  return not_the_writer();
}

absl::Status Session::check_still_writes_locked(const absl::StatusOr<Writer>& writer) const {
  if (!writer.ok()) return writer.status();
  return writer->epoch == epoch_ ? absl::OkStatus() : not_the_writer();
}

WriterLease Session::acquire_writer() {
  touch();
  WriterLease lease;
  std::vector<std::weak_ptr<FrameStream>> before;
  std::shared_ptr<SolveJob> job_before;
  {
    const std::scoped_lock lock(writing_);
    token_ = random_hex_128();
    ++epoch_;
    before.swap(writers_);
    publisher_->begin_epoch(epoch_);
    lease = {token_, epoch_, mailbox_.newest().input_seq};
    job_before = take_job();
  }
  const std::string text = "Another writer took the session over.";
  for (const auto& weak : before) {
    if (const auto stream = weak.lock()) stream->end(EndReason::kWriterReplaced, text);
  }
  publisher_->wake_all();  // readers learn of the new epoch
  if (job_before) job_before->finish(make_fault({Reason::kWriterReplaced, "", ""}, text));
  return lease;
}

/// The common part of all changes by a writer: applies `change` to the mailbox. Called with writing_ held.
template <typename Change>
auto Session::take_in_locked(const absl::StatusOr<Writer>& writer, const Change& change) {
  using Result = decltype(change(mailbox_));
  absl::Status status = check_still_writes_locked(writer);
  if (status.ok() && is_closed_) status = closed();
  return status.ok() ? change(mailbox_) : Result(std::move(status));
}

/// A change, and the promise that a frame will answer its input_seq.
template <typename Change>
auto Session::take_in(const absl::StatusOr<Writer>& writer, const Change& change) {
  touch();
  const auto since = std::chrono::steady_clock::now();
  decltype(change(mailbox_)) result;
  {
    const std::scoped_lock lock(writing_);
    result = take_in_locked(writer, change);
    if (result.ok()) publisher_->took(input_seq_of(*result), since);
  }
  if (result.ok()) services_.scheduler.wake(shared_from_this(), Urgency::kAnswer);
  return result;
}

absl::StatusOr<UpdateResult> Session::update(const absl::StatusOr<Writer>& writer, const Update& update) {
  return take_in(writer, [&](Mailbox& mailbox) { return mailbox.take(update); });
}

absl::StatusOr<UndoResult> Session::undo(const absl::StatusOr<Writer>& writer, std::uint64_t input_seq,
                                         bool redo) {
  return take_in(writer, [&](Mailbox& mailbox) { return mailbox.undo(input_seq, redo); });
}

absl::StatusOr<BetterNote> Session::take_better(const absl::StatusOr<Writer>& writer) {
  touch();
  std::optional<BetterNote> better;
  {
    const std::scoped_lock lock(writing_);
    if (absl::Status status = check_still_writes_locked(writer); !status.ok()) return status;
    if (is_closed_) return closed();
    better = publisher_->take_better(mailbox_.newest().input_seq);
    if (!better) {
      return make_fault({Reason::kNoBetterShape, "", ""},
                        "No shape of lower energy is known for the session's present inputs.");
    }
  }
  services_.scheduler.wake(shared_from_this(), Urgency::kAnswer);
  return *better;
}

absl::Status Session::solve(const absl::StatusOr<Writer>& writer, const std::optional<Update>& update,
                            const std::shared_ptr<SolveJob>& job) {
  touch();
  std::shared_ptr<SolveJob> before;
  {
    const std::scoped_lock lock(writing_);
    const absl::Status taken = take_in_locked(
        writer, [&](Mailbox& mailbox) { return update ? mailbox.take(*update).status() : absl::OkStatus(); });
    if (!taken.ok()) return taken;
    const std::scoped_lock job_lock(mutex_);
    if (is_closed_) return closed();  // meanwhile
    job->version = mailbox_.newest().version;
    before = std::exchange(job_, job);
  }
  if (before) {
    before->finish(make_fault({Reason::kSuperseded, "", ""},
                              "Another solve of the session began before this one was finished."));
  }
  services_.scheduler.wake(shared_from_this());
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<FrameStream>> Session::open_stream(const std::optional<Writer>& writer,
                                                                  const StreamOptions& options) {
  touch();
  std::shared_ptr<FrameStream> stream;
  {
    const std::scoped_lock lock(writing_);
    if (writer) {
      if (absl::Status status = check_still_writes_locked(*writer); !status.ok()) return status;
    }
    stream = std::make_shared<FrameStream>(
        options, publisher_, services_.timers, services_.heartbeat,
        OpenedNote{epoch_, mailbox_.newest().input_seq},
        [&scheduler = services_.scheduler] { return scheduler.is_overloaded(); });
    if (publisher_->reader_count() >= services_.limits.streams)
      return too_many_streams(services_.limits.streams);
    if (!publisher_->add(stream)) return is_draining_ && !is_closed_ ? server_draining() : closed();
    std::erase_if(writers_, [](const auto& weak) { return weak.expired(); });
    if (writer) writers_.push_back(stream);
  }
  const std::shared_ptr<const Surface> newest = publisher_->newest()->surface;
  newest->prepare(options.format_for(*newest), options.with_normals);
  services_.scheduler.wake(shared_from_this());
  return stream;
}

void Session::forget_stream(const FrameStream& stream) {
  publisher_->remove(stream);
}

absl::Status Session::acknowledge(const std::string& stream_id, std::uint64_t frame_seq) {
  touch();
  const auto stream = publisher_->find(stream_id);
  if (stream) return stream->acknowledge(frame_seq);
  return make_fault({Reason::kStreamUnknown, "stream_id", ""},
                    "The session has no stream of this id; it may have ended.");
}

/// The error for callers that still hold the closed session. If the session goes on elsewhere, the error must
/// not say that it is gone, or its client would create a new one.
absl::Status Session::closed() const {
  return goes_on(closed_by_) ? server_draining() : session_unknown();
}

void Session::drain(const std::string& text) {
  is_draining_ = true;
  publisher_->close(EndReason::kDraining, text);
}

void Session::close(EndReason reason, const std::string& text) {
  {
    const std::scoped_lock lock(mutex_);
    if (is_closed_) return;
    closed_by_ = reason;
    is_closed_ = true;
  }
  stop_.request_stop();
  end_job(ended_by(reason, text));
  publisher_->close(reason, text);
}

void Session::touch() {
  last_used_ = services_.timers->now();
}

Timers::TimePoint Session::last_used() const {
  return job() ? services_.timers->now() : last_used_.load();
}

std::shared_ptr<SolveJob> Session::job() const {
  const std::scoped_lock lock(mutex_);
  return job_;
}

std::shared_ptr<SolveJob> Session::take_job() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(job_, nullptr);
}

void Session::end_job(const absl::Status& why) {
  if (const auto job = take_job()) job->finish(why);
}

bool Session::run() {
  const std::shared_ptr<SolveJob> job = this->job();
  if (is_closed_) return false;
  LiveSolver::Pace pace;
  pace.is_sparing = services_.scheduler.is_overloaded();
  if (services_.scheduler.is_answer_waiting()) {
    pace.slice = pace.is_sparing ? LiveSolver::kOneStep : LiveSolver::kShortSlice;
  }
  bool has_more = solver_->run_slice(job.get(), pace);
  if (job && job->is_done()) {
    touch();
    const std::scoped_lock lock(mutex_);
    if (job_ == job) job_.reset();
    has_more = true;  // the readers' solve may have to go on
  }
  if (solver_->is_searching()) make_next_idle();
  if (solver_->has_solved()) {  // until then the estimate stands
    memory_bytes_ = shape_->memory_bytes() + mesh_->memory_bytes() + solver_->memory_bytes() +
                    mailbox_.history_size().bytes;
    memory_.resize(memory_bytes_);
  }
  return has_more;
}

}  // namespace lpdeform
