// The functions of Link that callers call on their own threads.

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "client/cpp/link.h"
#include "client/cpp/names.h"
#include "client/cpp/refusals.h"
#include "client/cpp/snapshot.h"
#include "client/cpp/solve_call.h"
#include "client/cpp/upload.h"
#include "client/cpp/wire.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
/// Whether the caller may change the session. Called with the lock held.
absl::Status Link::check_writer() const {
  if (is_closing_) return session_closed();
  if (!lease_.writer_token.empty()) return absl::OkStatus();
  return make_fault(absl::StatusCode::kFailedPrecondition, {Reason::kNotTheWriter, "", ""},
                    "A reader cannot change the session: take_over() first.");
}

absl::StatusOr<std::uint64_t> Link::update(Update update) {
  const absl::Status checked = check_names(update);
  if (!checked.ok()) return checked;
  const std::scoped_lock lock(mutex_);
  if (absl::Status may = check_writer(); !may.ok()) return may;
  const std::uint64_t seq = ledger_.add(std::move(update));
  changed_.notify_all();
  return seq;
}

absl::StatusOr<std::optional<Frame>> Link::take_frame(Clock::time_point deadline) {
  start_stream();
  absl::StatusOr<std::optional<FrameBox::Taken>> taken = box_.take(deadline);
  if (!taken.ok()) return taken.status();
  if (!taken->has_value()) return std::nullopt;
  acknowledge((*taken)->frame.frame_seq, (*taken)->stream);
  return std::move((*taken)->frame);
}

void Link::acknowledge(std::uint64_t frame_seq, std::uint64_t stream) {
  const std::scoped_lock lock(mutex_);
  if (stream != stream_) return;
  ack_due_ = std::max(frame_seq, ack_due_.value_or(0));
  changed_.notify_all();
}

absl::StatusOr<std::optional<Frame>> Link::poll() {
  return take_frame(Clock::now());
}

bool Link::wait(Clock::time_point deadline) {
  start_stream();
  return box_.wait(deadline);
}

absl::StatusOr<Frame> Link::next_frame(Clock::time_point deadline) {
  absl::StatusOr<std::optional<Frame>> frame = take_frame(deadline);
  if (!frame.ok()) return frame.status();
  if (!frame->has_value()) return no_frame();
  return *std::move(*frame);
}

/// Another thread may take the result meanwhile; this call returns it as well. If the last frame is the result only because
/// a newer update has been refused meanwhile, the refusal is returned first.
absl::StatusOr<Frame> Link::settle(Clock::time_point deadline) {
  for (;;) {
    const std::uint64_t takes = box_.takes();
    const absl::StatusOr<std::optional<Frame>> taken = take_frame(Clock::now());
    if (!taken.ok()) return taken.status();
    std::optional<Frame> last = box_.last_final();
    const bool is_settled = last && is_result(*last);
    if (is_settled && !box_.has_problem()) return *std::move(last);
    if (!box_.wait(deadline, takes)) return no_frame();
  }
}

bool Link::is_result(const Frame& frame) const {
  const std::scoped_lock lock(mutex_);
  return frame.is_final && frame.input_seq >= std::max(ledger_.newest(), ledger_.newest_dropped());
}

absl::Status Link::no_frame() const {
  const std::scoped_lock lock(mutex_);
  const std::string problem = is_open_ || last_problem_.ok()
                                  ? ""
                                  : absl::StrCat(" The connection is down: ", last_problem_.message());
  return make_fault({Reason::kNoFrame, "", ""}, absl::StrCat("No new frame came in time.", problem));
}

/// Checked in the client, so that an INVALID_ARGUMENT of the server can only be about the update.
absl::Status Link::check_initial_positions(const SolveOptions& options) const {
  if (!options.initial_positions) return absl::OkStatus();
  const std::vector<double>& numbers = *options.initial_positions;
  const std::size_t wanted = 3 * static_cast<std::size_t>(mesh_report().vertices);
  if (numbers.size() != wanted) {
    return make_fault(
        {Reason::kPositionsSize, "", absl::StrCat("numbers = ", wanted)},
        absl::StrCat("The initial positions are ", numbers.size(), " numbers and not ", wanted, "."));
  }
  const auto bad = std::ranges::find_if_not(numbers, [](double number) { return std::isfinite(number); });
  if (bad == numbers.end()) return absl::OkStatus();
  const std::string vertex = absl::StrCat("vertex ", (bad - numbers.begin()) / 3);
  return make_fault({Reason::kPositionsNotFinite, vertex, ""},
                    absl::StrCat("The initial position of ", vertex, " is not finite."));
}

/// Waits until no update is in flight and no solve runs, and sets is_solving_, which keeps others from starting until
/// it is false again.
absl::Status Link::begin_alone(std::unique_lock<std::mutex>& lock, Clock::time_point deadline) {
  const auto is_quiet = [this] { return is_closing_ || (!is_solving_ && !ledger_.has_in_flight()); };
  if (!changed_.wait_until(lock, deadline, is_quiet)) {
    return make_fault({Reason::kSolveUnderWay, "", ""},
                      "Another solve, or an update that the server has not answered, is under way.");
  }
  if (is_closing_) return session_closed();
  is_solving_ = true;
  return absl::OkStatus();
}

void Link::end_alone(std::unique_lock<std::mutex>& lock) {
  if (!lock.owns_lock()) lock.lock();
  is_solving_ = false;
  changed_.notify_all();
}

absl::StatusOr<std::uint64_t> Link::undo(bool redo) {
  const Clock::time_point deadline = Clock::now() + client_options_.call_timeout;
  std::unique_lock lock(mutex_);
  if (absl::Status alone = begin_alone(lock, deadline); !alone.ok()) return alone;
  const auto done = absl::MakeCleanup([this, &lock] { end_alone(lock); });
  if (absl::Status sent = send_waiting(lock); !sent.ok()) return sent;
  const std::uint64_t seq = ledger_.take_number();
  v1::UndoUpdateRequest request;
  request.set_session(lease_.session);
  request.set_writer_token(lease_.writer_token);
  request.set_input_seq(seq);
  request.set_redo(redo);
  const auto undone = undo_patiently(request, lock);
  if (!undone.ok()) return undone.status();
  auto change = from_wire(undone->changes());
  if (!change.ok()) return change.status();
  ledger_.accept_change({seq, *std::move(change)}, undone->result().kept());
  return seq;
}

absl::StatusOr<std::string> Link::snapshot() {
  const Clock::time_point deadline = Clock::now() + client_options_.call_timeout;
  std::unique_lock lock(mutex_);
  if (absl::Status alone = begin_alone(lock, deadline); !alone.ok()) return alone;
  const auto done = absl::MakeCleanup([this, &lock] { end_alone(lock); });
  if (absl::Status sent = send_waiting(lock); !sent.ok()) return sent;
  const std::string session = lease_.session;
  lock.unlock();
  return take_snapshot(*rpc_, session, stop_.get_token());
}

/// Sends again what the server has lost, and nothing else, because the server would count an update as an undo step.
absl::Status Link::catch_up(std::unique_lock<std::mutex>& lock) {
  v1::GetSessionRequest request;
  request.set_session(lease_.session);
  lock.unlock();
  const auto found = rpc_->call(request, stop_.get_token());
  lock.lock();
  if (!found.ok()) return found.status();
  ledger_.reopened(found->session().epoch(), found->session().input_seq());
  return send_restore(lock);
}

/// When a session is created again, the server counts the update with all its handles as an undo step; users do not.
/// FAILED_PRECONDITION NOTHING_TO_UNDO if that step is the newest.
absl::Status Link::check_steps(const v1::UndoUpdateRequest& undo, std::unique_lock<std::mutex>& lock) {
  if (undo.redo() || !is_recreated_) return absl::OkStatus();
  v1::GetSessionRequest request;
  request.set_session(undo.session());
  lock.unlock();
  const auto found = rpc_->call(request, stop_.get_token());
  lock.lock();
  if (!found.ok()) return found.status();
  if (found->session().undo_steps() > 1) return absl::OkStatus();
  return make_fault({Reason::kNothingToUndo, "", ""},
                    "The session was recreated, and has no steps from before.");
}

/// An undo is idempotent, so it is retried if the server becomes unreachable, after the updates that the server has
/// lost. `lock` is held before and after.
absl::StatusOr<v1::UndoUpdateResponse> Link::undo_patiently(const v1::UndoUpdateRequest& request,
                                                            std::unique_lock<std::mutex>& lock) {
  const Clock::time_point end = Clock::now() + client_options_.call_timeout;
  Backoff backoff;
  bool is_checked = false;  // once only: a call that took effect unanswered has already reduced the steps
  absl::StatusOr<v1::UndoUpdateResponse> undone;
  for (absl::Status ready;; ready = catch_up(lock)) {
    if (ready.ok() && !is_checked) {
      ready = check_steps(request, lock);
      is_checked = ready.ok();
    }
    if (ready.ok()) {
      lock.unlock();
      undone = rpc_->call(request, stop_.get_token());
      lock.lock();
    } else {
      undone = ready;
    }
    const auto pause = backoff.next(retry_after(undone.status()));
    if (!absl::IsUnavailable(undone.status()) || Clock::now() + pause > end) return undone;
    if (changed_.wait_for(lock, pause, [this] { return is_closing_; })) return session_closed();
  }
}

/// Called once only: if the answer is lost, the shape may have been taken, and then there is no other.
absl::StatusOr<BetterShape> Link::take_better_shape() {
  std::unique_lock lock(mutex_);
  if (absl::Status may = check_writer(); !may.ok()) return may;
  v1::TakeBetterShapeRequest request;
  request.set_session(lease_.session);
  request.set_writer_token(lease_.writer_token);
  lock.unlock();
  const auto taken = rpc_->call(request, stop_.get_token());
  lock.lock();
  if (taken.ok() || fault_of(taken.status()).reason == Reason::kNoBetterShape) better_.reset();
  if (!taken.ok()) return is_closing_ ? session_closed() : taken.status();
  return BetterShape{.input_seq = taken->input_seq(), .energy = taken->energy()};
}

absl::StatusOr<SolveResult> Link::solve(const SolveOptions& options) {
  const absl::Status checked = check_initial_positions(options);
  if (!checked.ok()) return checked;
  const Clock::time_point start = Clock::now();
  std::chrono::duration<double> longest = client_options_.call_timeout;
  if (options.deadline_seconds > 0)
    longest = std::min(longest, std::chrono::duration<double>(options.deadline_seconds));
  const Clock::time_point deadline = start + std::chrono::duration_cast<Clock::duration>(longest);
  std::unique_lock lock(mutex_);
  if (absl::Status alone = begin_alone(lock, deadline); !alone.ok()) return alone;
  const auto solved = absl::MakeCleanup([this, &lock] { end_alone(lock); });
  lock.unlock();
  return solve_patiently(options, start);
}

/// Retries while the server is unreachable, for as long as the stream would. The deadline of `options` counts from
/// `start`.
absl::StatusOr<SolveResult> Link::solve_patiently(const SolveOptions& options, Clock::time_point start) {
  std::optional<Clock::time_point> latest;
  SolveOptions left = options;
  if (options.deadline_seconds > 0) {
    left.deadline_seconds -= std::chrono::duration<double>(Clock::now() - start).count();
    if (left.deadline_seconds <= 0)
      return make_fault({Reason::kSolveTimePassed, "", ""}, "The time for the solve has passed.");
  }
  Backoff backoff;
  for (;;) {
    absl::StatusOr<SolveResult> result = solve_or_recreate(left);
    if (!absl::IsUnavailable(result.status())) return result;
    const Clock::time_point now = Clock::now();
    const auto pause = backoff.next(retry_after(result.status()));
    if (!latest) latest = now + client_options_.reconnect_for;
    if (now + pause > *latest) return result;
    if (options.deadline_seconds > 0) {
      left.deadline_seconds =
          options.deadline_seconds - std::chrono::duration<double>(now + pause - start).count();
      if (left.deadline_seconds <= 0) return result;
    }
    const bool was_there = rpc_->wait_for_connection(pause, stop_.get_token()) == Rpc::Connected::kWas;
    std::unique_lock lock(mutex_);
    const auto is_closing = [this] { return is_closing_; };
    if (was_there ? changed_.wait_for(lock, pause, is_closing) : is_closing_) {
      return absl::CancelledError("The session was closed.");
    }
  }
}

absl::StatusOr<SolveResult> Link::solve_or_recreate(const SolveOptions& options) {
  const std::string session = name();
  absl::StatusOr<SolveResult> result = solve_once(options);
  if (!is_session_lost(result.status()) || !copy_) return result;
  const absl::Status made = recreate(session);
  return made.ok() ? solve_once(options) : made;
}

absl::StatusOr<SolveResult> Link::solve_once(const SolveOptions& options) {
  std::unique_lock lock(mutex_);
  const absl::Status restored = send_restore(lock);
  if (!restored.ok()) return restored;
  std::optional<NumberedUpdate> update;
  if (ledger_.has_waiting()) update = ledger_.send_next();
  const Lease lease = lease_;
  lock.unlock();

  const auto forget_better = [this] {  // as the server has; it searches again
    const std::scoped_lock held(mutex_);
    better_.reset();
  };
  absl::StatusOr<SolveResult> result =
      run_solve(*rpc_, lease, update, options, stop_.get_token(), forget_better);
  lock.lock();
  if (update) note_answer(update->seq, result.status());
  if (absl::IsUnavailable(result.status()))
    ledger_.resumed_at(0);  // the server may have lost updates; sending them again does no harm
  if (!result.ok() || result->input_seq >= ledger_.newest_accepted()) return result;
  ledger_.resumed_at(result->input_seq);
  if (!ledger_.has_restore()) return result;
  return absl::UnavailableError("The server went back to an earlier state.");
}

/// Records the outcome of the update in a call. Called with the lock held.
void Link::note_answer(std::uint64_t seq, const absl::Status& status) {
  const Answer answer = status.ok() ? Answer::kTaken : answer_of(status);
  if (answer == Answer::kTaken) ledger_.accept(seq);
  if (answer == Answer::kRefused) ledger_.refuse(seq);
  if (answer == Answer::kAgain || answer == Answer::kRecreate) ledger_.connection_lost();
}

/// Sends the state of the lost session to the new session, as an update of its own: it was accepted before, and must
/// not be refused together with an update that was not.
absl::Status Link::send_restore(std::unique_lock<std::mutex>& lock) {
  while (ledger_.has_restore()) {
    if (absl::Status sent = send_by_call(lock); !sent.ok()) return sent;
  }
  return absl::OkStatus();
}

/// Sends all waiting updates, each by a unary call.
absl::Status Link::send_waiting(std::unique_lock<std::mutex>& lock) {
  while (ledger_.has_waiting()) {
    if (absl::Status sent = send_by_call(lock); !sent.ok()) return sent;
  }
  return absl::OkStatus();
}

/// Sends the next update by a unary call, not on the stream.
absl::Status Link::send_by_call(std::unique_lock<std::mutex>& lock) {
  const NumberedUpdate next = ledger_.send_next();
  v1::UpdateHandlesRequest request;
  request.set_session(lease_.session);
  request.set_writer_token(lease_.writer_token);
  lock.unlock();
  Uploads uploads(*rpc_, stop_.get_token());
  Packer packer([&](std::string_view bytes) { return uploads.add(bytes); });
  absl::Status sent = to_wire(next.update, next.seq, packer, *request.mutable_update());
  bool is_kept = false;
  if (sent.ok()) {
    const auto taken = rpc_->call(request, stop_.get_token());
    sent = taken.status();
    is_kept = taken.ok() && taken->result().kept();
  }
  uploads.discard();
  lock.lock();
  if (sent.ok()) {
    ledger_.accept(next.seq, is_kept);
  } else if (is_undecided(sent) || next.seq == ledger_.newest_accepted()) {
    ledger_.connection_lost();
  } else {
    ledger_.refuse(next.seq);
  }
  return sent;
}

absl::Status Link::recreate(const std::string& lost) {
  const std::scoped_lock renewing(renewing_);
  std::string request_id;
  {
    const std::scoped_lock lock(mutex_);
    if (lease_.session != lost) return absl::OkStatus();  // another thread has created it already
    request_id = request_id_;
  }
  absl::StatusOr<Lease> made = copy_.make(*rpc_, request_id, stop_.get_token());
  if (!made.ok()) return made.status();
  const std::scoped_lock lock(mutex_);
  lease_ = *std::move(made);
  request_id_ = new_request_id();
  ledger_.session_lost();
  ledger_.count_from(lease_.input_seq);
  ledger_.begin_epoch(lease_.epoch);
  is_recreated_ = copy_.is_bare && ledger_.has_restore();
  box_.begin_session();
  return absl::OkStatus();
}

absl::Status Link::take_over() {
  std::string session;
  {
    const std::scoped_lock lock(mutex_);
    if (is_closing_) return session_closed();
    is_taking_over_ = true;
    session = lease_.session;
  }
  absl::StatusOr<Lease> lease = join_session(*rpc_, session, Role::kWriter, stop_.get_token());
  std::thread finished;
  {
    const std::scoped_lock lock(mutex_);
    is_taking_over_ = false;
    changed_.notify_all();
    if (!lease.ok()) return lease.status();
    if (is_closing_) return session_closed();
    lease_ = *std::move(lease);
    ledger_.count_from(lease_.input_seq);
    ledger_.begin_epoch(lease_.epoch);
    box_.begin_epoch(lease_.epoch);
    rules_.begin();
    last_open_ = Clock::now();
    is_to_reopen_ = is_running_;
    trying_.request_stop();
    if (call_ != nullptr) call_->cancel();
    if (!is_running_) finished = std::move(thread_);
  }
  if (finished.joinable()) finished.join();
  box_.resume();
  return absl::OkStatus();
}

absl::Status Link::close() {
  bool is_ours_to_delete = false;
  {
    const std::scoped_lock lock(mutex_);
    if (is_closing_) return absl::OkStatus();
    is_closing_ = true;
    is_ours_to_delete = bool{copy_};
    if (call_ != nullptr) call_->cancel();
    trying_.request_stop();
    changed_.notify_all();
  }
  stop_.request_stop();
  box_.finish(session_closed());
  if (thread_.joinable()) thread_.join();
  if (!is_ours_to_delete) return absl::OkStatus();
  v1::DeleteSessionRequest request;
  request.set_session(name());
  return rpc_->call(request, std::stop_token()).status();
}

std::string Link::name() const {
  const std::scoped_lock lock(mutex_);
  return lease_.session;
}

void Link::start() {
  start_stream();
}

absl::Status Link::ended() const {
  return box_.end();
}

absl::Status Link::last_problem() const {
  const std::scoped_lock lock(mutex_);
  return is_open_ ? absl::OkStatus() : last_problem_;
}

std::optional<Notice> Link::notice() const {
  const std::scoped_lock lock(mutex_);
  if (!is_open_) return std::nullopt;
  return better_ ? better_ : notice_;  // better_ concerns the newest result, load the next updates
}

MeshReport Link::mesh_report() const {
  const std::scoped_lock lock(mutex_);
  return lease_.mesh;
}

Connection Link::connection() const {
  const std::scoped_lock lock(mutex_);
  if (is_closing_) return Connection::kClosed;
  if (is_open_) return Connection::kConnected;
  if (is_running_) return Connection::kReconnecting;
  return thread_.joinable() ? Connection::kClosed : Connection::kIdle;
}

}  // namespace lpdeform::client
