#include "client/c/live_session.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cpp/ledger.h"
#include "client/cpp/recovery.h"
#include "core/base/fault.h"

namespace lpdeform::engine {
namespace {

absl::Status session_closed() {
  return make_fault(absl::StatusCode::kFailedPrecondition, {"SESSION_CLOSED", "", ""},
                    "The session is closed.");
}

absl::Status not_there_yet() {
  return make_fault(absl::StatusCode::kFailedPrecondition, {"NOT_CONNECTED", "", ""},
                    "There is no session on the server yet.");
}

}  // namespace

LiveSession::LiveSession(Opening opening, Facts facts)
    : opening_(std::move(opening)), facts_(facts), thread_([this] { run(); }) {}

LiveSession::~LiveSession() {
  close();
  wait_until_closed();
}

void LiveSession::run() {
  open_patiently();
  std::shared_ptr<client::Session> session;
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_closing_; });
    session = session_;
  }
  if (session) session->close().IgnoreError();  // what could not be deleted expires
  session.reset();
  const std::scoped_lock lock(mutex_);
  opening_ = nullptr;
  session_
      .reset();  // with its threads and its copy of the mesh: this may be kept until the client is disconnected
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
    absl::StatusOr<client::Session> opened = opening_();
    if (opened.ok()) {
      opening_ = nullptr;  // and with it its copy of the mesh
      return hand_over(*std::move(opened));
    }
    std::unique_lock lock(mutex_);
    last_problem_ = opened.status();
    if (is_final(opened.status(), start)) {
      refused_ = opened.status();
      changed_.notify_all();
      return;
    }
    if (changed_.wait_for(lock, backoff.next(), [this] { return is_closing_; })) return;
  }
}

bool LiveSession::is_final(const absl::Status& failed, Clock::time_point since) const {
  const bool may_pass =
      absl::IsUnavailable(failed) || absl::IsDeadlineExceeded(failed) || absl::IsResourceExhausted(failed);
  const std::chrono::duration<double> tried = Clock::now() - since;
  return !may_pass || (facts_.reconnect_seconds > 0 && tried.count() > facts_.reconnect_seconds);
}

/// The changes made so far become one of the session's; the frames begin.
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
  const std::scoped_lock lock(mutex_);
  if (is_closing_) return session_closed();
  if (!refused_.ok()) return refused_;
  if (facts_.is_reader) {
    return make_fault(absl::StatusCode::kFailedPrecondition, {"NOT_THE_WRITER", "", ""},
                      "A reader cannot change the session.");
  }
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

/// Our number of the session's change `seq`. Callers have seen session_, and seq_offset_ does not change after.
std::uint64_t LiveSession::ours(std::uint64_t seq) const {
  if (seq < first_seq_) return 0;
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, static_cast<std::int64_t>(seq) + seq_offset_));
}

lpdeform_state LiveSession::state(absl::Status& why) const {
  const std::scoped_lock lock(mutex_);
  why = absl::OkStatus();
  if (is_closing_) {
    why = session_closed();
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

absl::StatusOr<std::shared_ptr<client::Session>> LiveSession::session() const {
  const std::scoped_lock lock(mutex_);
  if (is_closing_) return session_closed();
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

absl::StatusOr<std::optional<lpdeform_frame>> LiveSession::take(client::Frame frame,
                                                                const lpdeform_buffers& buffers) {
  // The buffers were measured for the mesh; what a server sends is not taken on trust.
  if (frame.positions.size() != std::size_t{3} * vertex_count()) {
    return make_fault(absl::StatusCode::kDataLoss, {"FRAME_VERTICES", "", absl::StrCat(vertex_count())},
                      absl::StrCat("The server sent a frame of ", frame.positions.size() / 3,
                                   " vertices for a mesh of ", vertex_count(), "."));
  }
  was_live_ = true;
  frame.input_seq = ours(frame.input_seq);
  const std::scoped_lock lock(frame_mutex_);
  last_frame_ = std::move(frame);
  return write_frame(*last_frame_, facts_.space, buffers);
}

absl::StatusOr<std::optional<lpdeform_frame>> LiveSession::poll(const lpdeform_buffers& buffers) {
  const auto live = session();
  if (!live.ok()) return live.status();
  if (*live == nullptr) return std::nullopt;
  const absl::Status checked = check(buffers);
  if (!checked.ok()) return checked;
  absl::StatusOr<std::optional<client::Frame>> frame = (*live)->poll();
  if (!frame.ok()) return frame.status();
  if (!frame->has_value()) return std::nullopt;
  return take(**std::move(frame), buffers);
}

absl::StatusOr<std::optional<lpdeform_frame>> LiveSession::repeat(const lpdeform_buffers& buffers) {
  const absl::Status checked = check(buffers);
  if (!checked.ok()) return checked;
  const std::scoped_lock lock(frame_mutex_);
  if (!last_frame_) return std::nullopt;
  return write_frame(*last_frame_, facts_.space, buffers);
}

absl::StatusOr<std::shared_ptr<client::Session>> LiveSession::wait_for_session(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  const auto is_decided = [this] { return session_ || !refused_.ok() || is_closing_; };
  if (changed_.wait_until(lock, deadline, is_decided)) {
    lock.unlock();
    return session();
  }
  return make_fault(absl::StatusCode::kDeadlineExceeded, {"NO_FRAME", "", ""},
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
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
  absl::StatusOr<client::Frame> frame = (*live)->settle(left);
  if (!frame.ok()) return frame.status();
  return take(*std::move(frame), buffers);
}

void LiveSession::close() {
  const std::scoped_lock lock(mutex_);
  is_closing_ = true;
  changed_.notify_all();
}

bool LiveSession::is_closed() const {
  const std::scoped_lock lock(mutex_);
  return is_closed_;
}

void LiveSession::wait_until_closed() {
  if (thread_.joinable()) thread_.join();
}

}  // namespace lpdeform::engine
