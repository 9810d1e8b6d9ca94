#include "server/session/frame_stream.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/runtime/metrics.h"
#include "server/runtime/random_name.h"
#include "server/session/publisher.h"

namespace lpdeform {

Format StreamOptions::format_for(const Surface& surface) const {
  const auto is_too_fast = [&](Format chosen) {
    const auto bytes = static_cast<double>(surface.size(chosen, with_distortion, with_normals));
    return max_bytes_per_second > 0 && kLowestRate * bytes > max_bytes_per_second;
  };
  Format chosen = format;
  while ((chosen < lowest_format) && is_too_fast(chosen)) {
    chosen = static_cast<Format>(static_cast<int>(chosen) + 1);
  }
  return chosen;
}

FrameStream::FrameStream(StreamOptions options, std::shared_ptr<Publisher> publisher,
                         std::shared_ptr<Timers> timers, Timers::Duration heartbeat, OpenedNote opened,
                         IsOverloaded is_overloaded)
    : id_(random_hex_128()),
      options_(options),
      publisher_(std::move(publisher)),
      timers_(std::move(timers)),
      heartbeat_(heartbeat),
      opened_(opened),
      is_overloaded_(std::move(is_overloaded)),
      last_frame_at_(timers_->now()),
      pace_(options.max_frames_per_second),
      last_sent_at_(last_frame_at_) {}

void FrameStream::start(std::function<void()> waker) {
  const std::scoped_lock lock(mutex_);
  waker_ = std::move(waker);
}

void FrameStream::wake() {
  std::function<void()> waker;
  {
    const std::scoped_lock lock(mutex_);
    if (!is_ended_) waker = waker_;
  }
  if (waker) waker();
}

std::optional<Note> FrameStream::next() {
  const std::scoped_lock lock(mutex_);
  if (is_ended_) return std::nullopt;
  const Timers::TimePoint now = timers_->now();
  std::optional<Note> note = next_locked(now);
  if (note) last_sent_at_ = now;
  if (!note) arm(is_heartbeat_armed_, last_sent_at_ + heartbeat_);
  return note;
}

std::optional<Note> FrameStream::next_locked(Timers::TimePoint now) {
  if (!is_opened_) {
    is_opened_ = true;
    return opened_;
  }
  if (end_) {
    is_ended_ = true;
    cutter_ = {};
    return *std::move(end_);
  }
  if (is_overloaded_ && !cutter_.has_more() && is_overloaded_() != has_said_overloaded_) {
    has_said_overloaded_ = !has_said_overloaded_;
    return LoadNote{has_said_overloaded_};
  }
  if (!cutter_.has_more()) begin_frame(now);
  const bool is_answers_turn = !cutter_.has_more() || !std::exchange(was_answer_, false);
  if (!answers_.empty() && is_answers_turn) {
    was_answer_ = cutter_.has_more();
    Note answer = std::move(answers_.front());
    answers_.pop_front();
    return answer;
  }
  if (cutter_.has_more()) return next_piece();
  if (const auto standing = publisher_->standing(); standing && standing->number > last_fault_) {
    last_fault_ = standing->number;
    return standing->fault;
  }
  if (const auto better = publisher_->better(); better && better->number > last_better_) {
    last_better_ = better->number;
    return *better;
  }
  if (now - last_sent_at_ >= heartbeat_) return HeartbeatNote{};
  return std::nullopt;
}

/// Begins to send the publisher's newest frame, if it is new and may be sent now.
void FrameStream::begin_frame(Timers::TimePoint now) {
  std::shared_ptr<const Frame> newest = publisher_->newest();
  if (!newest || newest->frame_seq <= last_seq_) return;
  const bool was_sent = newest->repeats != 0 && newest->repeats == last_seq_;
  if (was_sent && !options_.with_certificate) return;
  if (in_flight_.size() >= options_.credit) {
    if (is_stalled_) return;
    is_stalled_ = true;
    stalled_since_ = now;
    return publisher_->metrics().add(Count::kCreditStalls);
  }
  if (const Timers::TimePoint when = next_frame_at(kind_of(newest->taken)); now < when) {
    const Timers::TimePoint of_answer = next_frame_at(FramePace::Kind::kAnswer);
    return arm(is_pace_armed_, now < of_answer ? of_answer : when);  // an answer may come meanwhile
  }
  is_stalled_ = false;
  publisher_->metrics().add(Count::kFramesSent);
  const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - newest->published_at;
  publisher_->metrics().observe(Span::kFrameToStream, waited.count());
  if (has_sent_frame_) {
    publisher_->metrics().add(Count::kFramesSuperseded,
                              static_cast<double>(newest->frame_seq - last_seq_ - 1));
  }
  const std::uint64_t answered = has_sent_frame_ ? newest->taken - last_taken_ : 0;
  last_seq_ = newest->frame_seq;
  last_taken_ = newest->taken;
  has_sent_frame_ = true;
  last_frame_at_ = now;
  pace_.begin(now);
  in_flight_.push_back(last_seq_);
  last_bytes_ = 0;
  cutter_ = FrameCutter(newest, options_.format_for(*newest->surface), options_.with_distortion,
                        options_.with_normals, answered > 1 ? answered - 1 : 0, options_.with_certificate);
}

FramePiece FrameStream::next_piece() {
  FramePiece piece = cutter_.next();
  last_bytes_ += piece.bytes().size();
  publisher_->metrics().add(Count::kFrameBytes, static_cast<double>(piece.bytes().size()));
  return piece;
}

FramePace::Kind FrameStream::kind_of(std::uint64_t taken) const {
  return taken > last_taken_ ? FramePace::Kind::kAnswer : FramePace::Kind::kRefinement;
}

Timers::TimePoint FrameStream::next_frame_at(FramePace::Kind kind) const {
  const Timers::TimePoint by_rate = pace_.next_at(kind);
  if (!has_sent_frame_ || options_.max_bytes_per_second <= 0) return by_rate;
  const double seconds = static_cast<double>(last_bytes_) / options_.max_bytes_per_second;
  const std::chrono::duration<double> pause(std::min(seconds, 3600.0));
  return std::max(by_rate, last_frame_at_ + std::chrono::duration_cast<Timers::Duration>(pause));
}

/// Sets a timer that makes the sender call next() at `when`.
void FrameStream::arm(bool& is_armed, Timers::TimePoint when) {
  if (std::exchange(is_armed, true)) return;
  timers_->at(when, [weak = weak_from_this(), &is_armed] {
    const auto stream = weak.lock();
    if (!stream) return;
    {
      const std::scoped_lock lock(stream->mutex_);
      is_armed = false;
    }
    stream->wake();
  });
}

absl::Status FrameStream::acknowledge(std::uint64_t frame_seq) {
  {
    const std::scoped_lock lock(mutex_);
    const bool is_being_sent = cutter_.has_more() && frame_seq == last_seq_;
    if (frame_seq > last_seq_ || is_being_sent) {
      return make_fault(
          {Reason::kAckNotSent, absl::StrCat("frame ", frame_seq), absl::StrCat("frame_seq <= ", last_seq_)},
          absl::StrCat("Frame ", frame_seq, " was acknowledged before it was sent; the last one sent is ",
                       last_seq_, "."));
    }
    while (!in_flight_.empty() && in_flight_.front() <= frame_seq) in_flight_.pop_front();
  }
  wake();
  return absl::OkStatus();
}

void FrameStream::answer(UpdateResult result) {
  {
    const std::scoped_lock lock(mutex_);
    answers_.emplace_back(result);
  }
  wake();
}

void FrameStream::answer(FaultNote fault) {
  {
    const std::scoped_lock lock(mutex_);
    answers_.emplace_back(std::move(fault));
  }
  wake();
}

std::size_t FrameStream::answers_waiting() const {
  const std::scoped_lock lock(mutex_);
  return answers_.size();
}

std::uint64_t FrameStream::last_frame_seq() const {
  const std::scoped_lock lock(mutex_);
  return last_seq_;
}

void FrameStream::end(EndReason reason, std::string text) {
  {
    const std::scoped_lock lock(mutex_);
    if (end_ || is_ended_) return;
    end_ = EndNote{reason, std::move(text)};
    ended_by_ = reason;
  }
  wake();
}

std::optional<EndReason> FrameStream::ended_by() const {
  const std::scoped_lock lock(mutex_);
  return ended_by_;
}

Timers::Duration FrameStream::waited_for_credit() const {
  const std::scoped_lock lock(mutex_);
  return is_stalled_ ? timers_->now() - stalled_since_ : Timers::Duration(0);
}

bool FrameStream::wants_frame(std::uint64_t taken) const {
  const std::scoped_lock lock(mutex_);
  return !is_ended_ && !end_ && !cutter_.has_more() && in_flight_.size() < options_.credit &&
         timers_->now() >= next_frame_at(kind_of(taken));
}

}  // namespace lpdeform
