#include "client/c/live_session.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cpp/guarded.h"
#include "client/cpp/lease.h"
#include "client/cpp/ledger.h"
#include "client/cpp/names.h"
#include "client/cpp/recovery.h"
#include "client/cpp/refusals.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::engine {
namespace {

/// How often a wait for a result checks whether another thread has taken it.
constexpr std::chrono::milliseconds kGlance{20};

absl::Status not_there_yet() {
  return make_fault({Reason::kNotConnected, "", ""}, "There is no session on the server yet.");
}

absl::Status no_result(const absl::Status& problem) {
  const std::string why = problem.ok() ? "" : absl::StrCat(" The connection is down: ", problem.message());
  return make_fault({Reason::kNoFrame, "", ""},
                    absl::StrCat("The finished result did not come in time.", why));
}

absl::Status not_the_writer() {
  return make_fault(absl::StatusCode::kFailedPrecondition, {Reason::kNotTheWriter, "", ""},
                    "A reader cannot change the session.");
}

client::Frame frame_of(client::SolveResult result) {
  client::Frame out;
  out.positions = std::move(result.positions);
  out.distortion = std::move(result.distortion);
  out.normals = std::move(result.normals);
  out.input_seq = result.input_seq;
  out.iteration = result.iterations;
  out.energy = result.energy;
  out.soft_energy = result.soft_energy;
  out.is_final = true;  // however it ended; stop_reason says how
  out.stop_reason = result.stop_reason;
  out.solve_seconds = result.solve_seconds;
  out.optimality_gap = result.optimality_gap;
  return out;
}

void tell_search(const client::SolveResult& result, lpdeform_search& out) {
  out.minima_count = static_cast<std::uint32_t>(result.minima.size());
  std::copy_n(result.minima.begin(), std::min(out.minima_count, out.minima_capacity), out.minima);
  out.further_starts = result.further_starts;
  out.search_iterations = result.search_iterations;
  out.effort = result.effort;
}

}  // namespace

LiveSession::LiveSession(Opening opening, Facts facts)
    : opening_(std::move(opening)), facts_(facts), thread_([this] { run(); }) {}

LiveSession::~LiveSession() {
  stop();
  wait_until_closed();
}

void LiveSession::run() {
  const absl::Status opened = client::guarded([this] {
    open_patiently();
    return absl::OkStatus();
  });
  if (!opened.ok()) refuse(opened);
  std::shared_ptr<client::Session> session;
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_closing_; });
    session = session_;
  }
  // A session that cannot be deleted expires.
  if (session) client::guarded([&] { return session->close(); }).IgnoreError();
  session.reset();
  const std::scoped_lock lock(mutex_);
  opening_ = nullptr;
  // Frees its threads and its copy of the mesh: this object may live until the client is disconnected.
  session_.reset();
  is_closed_ = true;
  changed_.notify_all();
}

void LiveSession::open_patiently() {
  const Clock::time_point start = Clock::now();
  client::Backoff backoff;
  for (;;) {
    {
      const std::scoped_lock lock(mutex_);
      if (is_closing_) return;
    }
    absl::StatusOr<client::Session> opened = opening_(stop_.get_token());
    if (opened.ok()) {
      opening_ = nullptr;  // frees its copy of the mesh
      return hand_over(*std::move(opened));
    }
    if (is_past_help(opened.status(), start)) return refuse(opened.status());
    std::unique_lock lock(mutex_);
    last_problem_ = opened.status();
    const auto pause = backoff.next(client::retry_after(opened.status()));
    if (changed_.wait_for(lock, pause, [this] { return is_closing_; })) return;
  }
}

bool LiveSession::is_past_help(const absl::Status& failed, Clock::time_point since) const {
  const bool may_pass = client::is_undecided(failed) && !client::is_session_lost(failed);
  const std::chrono::duration<double> tried = Clock::now() - since;
  return !may_pass || (facts_.reconnect_seconds > 0 && tried.count() > facts_.reconnect_seconds);
}

void LiveSession::refuse(absl::Status why) {
  const std::scoped_lock lock(mutex_);
  last_problem_ = why;
  refused_ = std::move(why);
  changed_.notify_all();
}

/// Sends the changes made so far as one change of the session, and starts the frames.
void LiveSession::hand_over(client::Session opened) {
  const auto session = std::make_shared<client::Session>(std::move(opened));
  const std::scoped_lock lock(mutex_);
  if (pending_ && !facts_.is_reader) {
    const absl::StatusOr<std::uint64_t> seq = session->update(*std::move(pending_));
    if (seq.ok()) {
      seq_offset_ = static_cast<std::int64_t>(pending_count_ - *seq);
      first_seq_ = *seq;
    }
  }
  pending_.reset();
  session->start();
  session_ = session;
  changed_.notify_all();
}

absl::StatusOr<std::uint64_t> LiveSession::send(client::Update update) {
  const absl::Status checked = client::check_names(update);
  if (!checked.ok()) return checked;
  const std::scoped_lock lock(mutex_);
  if (is_closing_) return client::session_closed();
  if (!refused_.ok()) return refused_;
  if (facts_.is_reader) return not_the_writer();
  if (!session_) {
    if (!pending_) pending_.emplace();
    client::merge(*pending_, std::move(update));
    return ++pending_count_;
  }
  const absl::Status over = session_->ended();
  if (!over.ok()) return over;
  const absl::StatusOr<std::uint64_t> seq = session_->update(std::move(update));
  if (!seq.ok()) return seq;
  return ours(*seq);
}

absl::StatusOr<std::uint64_t> LiveSession::undo(bool redo) {
  const auto live = session();
  if (!live.ok()) return live.status();
  if (facts_.is_reader) return not_the_writer();
  if (*live == nullptr) return not_there_yet();
  const absl::StatusOr<std::uint64_t> seq = redo ? (*live)->redo() : (*live)->undo();
  if (!seq.ok()) return seq;
  return ours(*seq);
}

absl::Status LiveSession::take_better_shape() {
  const auto live = session();
  if (!live.ok()) return live.status();
  if (facts_.is_reader) return not_the_writer();
  if (*live == nullptr) return not_there_yet();
  return (*live)->take_better_shape().status();
}

std::optional<lpdeform_better_shape> LiveSession::better_shape() const {
  const std::optional<client::Notice> said = notice();
  if (!said || said->reason != client::Notice::Reason::kBetterShape) return std::nullopt;
  lpdeform_better_shape out{};
  out.input_seq = ours(said->input_seq);
  out.energy = said->energy;
  out.saved_share = said->saved_share;
  return out;
}

absl::StatusOr<std::string> LiveSession::snapshot() {
  const auto live = session();
  if (!live.ok()) return live.status();
  if (*live == nullptr) return not_there_yet();
  return (*live)->snapshot();
}

/// Our number for the session's change `seq`. Callers have seen session_; seq_offset_ does not change after it is set.
std::uint64_t LiveSession::ours(std::uint64_t seq) const {
  if (seq < first_seq_) return 0;
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, static_cast<std::int64_t>(seq) + seq_offset_));
}

lpdeform_state LiveSession::state(absl::Status& why) const {
  const std::scoped_lock lock(mutex_);
  why = absl::OkStatus();
  if (is_closing_) {
    why = client::session_closed();
    return LPDEFORM_STATE_REFUSED;
  }
  if (!refused_.ok()) {
    why = refused_;
    return LPDEFORM_STATE_REFUSED;
  }
  if (!session_) {
    why = last_problem_;
    return LPDEFORM_STATE_CONNECTING;
  }
  switch (session_->connection()) {
    case client::Connection::kConnected:
      was_live_ = true;
      return LPDEFORM_STATE_LIVE;
    case client::Connection::kClosed:
      why = session_->ended();
      return LPDEFORM_STATE_REFUSED;
    default:
      why = session_->last_problem();
      return was_live_ ? LPDEFORM_STATE_RECONNECTING : LPDEFORM_STATE_CONNECTING;
  }
}

std::optional<client::Notice> LiveSession::notice() const {
  const auto live = session();
  return live.ok() && *live != nullptr ? (*live)->notice() : std::nullopt;
}

std::string LiveSession::mesh_notice() const {
  const auto live = session();
  if (!live.ok() || *live == nullptr) return "";
  return absl::StrJoin((*live)->mesh_report().notices, " ");
}

absl::StatusOr<std::shared_ptr<client::Session>> LiveSession::session() const {
  const std::scoped_lock lock(mutex_);
  if (is_closing_) return client::session_closed();
  if (!refused_.ok()) return refused_;
  return session_;
}

absl::StatusOr<std::string> LiveSession::name() const {
  const auto live = session();
  if (!live.ok()) return live.status();
  if (*live == nullptr) return not_there_yet();
  return (*live)->name();
}

std::uint32_t LiveSession::vertex_count() const {
  if (facts_.vertex_count > 0) return facts_.vertex_count;
  const std::scoped_lock lock(mutex_);
  return session_ ? static_cast<std::uint32_t>(session_->mesh_report().vertices) : 0;
}

absl::Status LiveSession::check(const lpdeform_buffers& buffers) const {
  return check_buffers(buffers, vertex_count(), facts_.contents);
}

lpdeform_frame LiveSession::write(const client::Frame& frame, const lpdeform_buffers& buffers) const {
  lpdeform_frame out = write_frame(frame, facts_.space, buffers);
  out.input_seq = ours(out.input_seq);
  return out;
}

/// client::Session ensures that the frame has as many vertices as the mesh for which the buffers were checked.
absl::StatusOr<bool> LiveSession::take_newest(client::Session& live) {
  absl::StatusOr<std::optional<client::Frame>> frame = live.poll();
  if (!frame.ok()) return frame.status();
  if (!frame->has_value()) return false;
  was_live_ = true;
  last_frame_ = **std::move(frame);
  return true;
}

absl::StatusOr<std::optional<lpdeform_frame>> LiveSession::poll(const lpdeform_buffers& buffers) {
  const auto live = session();
  if (!live.ok()) return live.status();
  if (*live == nullptr) return std::nullopt;
  const absl::Status checked = check(buffers);
  if (!checked.ok()) return checked;
  const std::scoped_lock lock(frame_mutex_);
  const absl::StatusOr<bool> taken = take_newest(**live);
  if (!taken.ok()) return taken.status();
  if (!*taken) return std::nullopt;
  return write(*last_frame_, buffers);
}

absl::StatusOr<std::optional<lpdeform_frame>> LiveSession::repeat(const lpdeform_buffers& buffers) {
  const absl::Status checked = check(buffers);
  if (!checked.ok()) return checked;
  const std::scoped_lock lock(frame_mutex_);
  if (!last_frame_) return std::nullopt;
  return write(*last_frame_, buffers);
}

absl::StatusOr<std::shared_ptr<client::Session>> LiveSession::wait_for_session(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  const auto is_decided = [this] { return session_ || !refused_.ok() || is_closing_; };
  if (changed_.wait_until(lock, deadline, is_decided)) {
    lock.unlock();
    return session();
  }
  return make_fault({Reason::kNoFrame, "", ""},
                    absl::StrCat("There was no session in time. ", last_problem_.message()));
}

absl::StatusOr<std::optional<lpdeform_frame>> LiveSession::settle(double timeout_seconds,
                                                                  const lpdeform_buffers& buffers) {
  const auto timeout =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_seconds));
  const Clock::time_point deadline = Clock::now() + timeout;
  const auto live = wait_for_session(deadline);
  if (!live.ok()) return live.status();
  const absl::Status checked = check(buffers);
  if (!checked.ok()) return checked;
  for (bool is_new = false;;) {
    {
      const std::scoped_lock lock(frame_mutex_);
      // is_result() is asked before the box is read: if the last frame is the result only because a newer update was
      // refused, the box has the refusal by now, and take_newest() returns it.
      const bool is_settled = last_frame_ && (*live)->is_result(*last_frame_);
      const absl::StatusOr<bool> taken = take_newest(**live);
      const bool has_ended = !taken.ok() && taken.status() == (*live)->ended();
      if (has_ended && is_new && is_settled)
        return write(*last_frame_, buffers);  // the end came right after it
      if (!taken.ok()) return taken.status();
      if (*taken) {
        is_new = true;
        continue;
      }
      if (is_settled) return write(*last_frame_, buffers);
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) return no_result((*live)->last_problem());
    (*live)->wait(std::min(kGlance, left));
  }
}

absl::StatusOr<std::optional<lpdeform_frame>> LiveSession::solve(double timeout_seconds, bool certify,
                                                                 const lpdeform_buffers& buffers,
                                                                 lpdeform_search& search) {
  const double longest = timeout_seconds > 0 ? timeout_seconds : 1e9;
  const Clock::time_point start = Clock::now();
  const auto live = wait_for_session(
      start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(longest)));
  if (!live.ok()) return live.status();
  const absl::Status checked = check_buffers(buffers, vertex_count(), {.normals = true, .distortion = true});
  if (!checked.ok()) return checked;
  client::SolveOptions options;
  options.certify = certify;
  options.with_normals = buffers.normals.data != nullptr;
  const double waited = std::chrono::duration<double>(Clock::now() - start).count();
  if (timeout_seconds > 0) options.deadline_seconds = std::max(timeout_seconds - waited, 1e-3);
  absl::StatusOr<client::SolveResult> result = (*live)->solve(options);
  if (!result.ok()) return result.status();
  tell_search(*result, search);
  return write(frame_of(*std::move(result)), buffers);
}

void LiveSession::close() {
  const std::scoped_lock lock(mutex_);
  is_closing_ = true;
  changed_.notify_all();
}

void LiveSession::stop() {
  close();
  stop_.request_stop();
}

bool LiveSession::is_closed() const {
  const std::scoped_lock lock(mutex_);
  return is_closed_;
}

void LiveSession::wait_until_closed() {
  if (thread_.joinable()) thread_.join();
}

}  // namespace lpdeform::engine
