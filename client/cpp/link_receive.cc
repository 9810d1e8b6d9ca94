// Receives the messages of a Deform stream: the reading thread of a Link.

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cpp/guarded.h"
#include "client/cpp/link.h"
#include "client/cpp/wire.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {

void Link::listen(DeformCall& call) {
  absl::Status broken;
  const absl::Status read = guarded([&] {
    v1::DeformResponse response;
    while (call.read(response)) {
      if (broken.ok()) broken = guarded([&] { return take(response); });
      if (!broken.ok()) call.cancel();  // the remaining messages are read and dropped
    }
    return absl::OkStatus();
  });
  broken.Update(read);
  if (!broken.ok()) call.cancel();
  const std::scoped_lock lock(mutex_);
  broken_ = std::move(broken);
  is_over_ = true;
  trying_.request_stop();  // the next stream uploads its bytes again
  changed_.notify_all();
}

absl::Status Link::take(const v1::DeformResponse& response) {
  {
    const std::scoped_lock lock(mutex_);
    last_heard_ = Clock::now();
    if (response.has_result()) {
      ledger_.accept(response.result().input_seq(), response.result().kept());
      note_answered(response.result().input_seq());
      changed_.notify_all();
    }
  }
  return response.has_event() ? take(response.event()) : absl::OkStatus();
}

/// The uploads of this update are no longer needed. Called with the lock held.
void Link::note_answered(std::uint64_t input_seq) {
  const auto used = uploads_in_use_.find(input_seq);
  if (used == uploads_in_use_.end()) return;
  uploads_done_.push_back(std::move(used->second));
  uploads_in_use_.erase(used);
}

absl::Status Link::take(const v1::StreamEvent& event) {
  switch (event.event_case()) {
    case v1::StreamEvent::kOpened:
      return take(event.opened());
    case v1::StreamEvent::kFrame:
      return take(event.frame());
    case v1::StreamEvent::kFault:
      return take(event.fault());
    case v1::StreamEvent::kGoAway: {
      const std::scoped_lock lock(mutex_);
      go_away_ = event.go_away();
      break;
    }
    case v1::StreamEvent::kNotice: {
      const std::scoped_lock lock(mutex_);
      Notice notice = from_wire(event.notice());
      (notice.reason == Notice::Reason::kBetterShape ? better_ : notice_) = std::move(notice);
      break;
    }
    default:
      break;  // a heartbeat, or an event that only newer servers send
  }
  return absl::OkStatus();
}

absl::Status Link::take(const v1::StreamOpened& opened) {
  {
    const std::scoped_lock lock(mutex_);
    absl::Status checked = check_vertex_count(opened.vertex_count(), lease_.mesh.vertices);
    if (!checked.ok()) return checked;
  }
  assembly_.emplace(opened.vertex_count());
  box_.begin_epoch(opened.epoch());
  const std::scoped_lock lock(mutex_);
  lease_.epoch = opened.epoch();
  if (opened.heartbeat_interval_ms() > 0) {
    longest_silence_ = 3 * std::chrono::milliseconds(opened.heartbeat_interval_ms());
  }
  ledger_.count_from(opened.input_seq());
  ledger_.reopened(opened.epoch(), opened.input_seq());
  is_open_ = true;
  opened_ = Clock::now();
  changed_.notify_all();
  return absl::OkStatus();
}

absl::Status Link::take(const v1::FramePart& part) {
  if (!assembly_) {
    return make_fault({Reason::kFrameParts, "", ""}, "A frame came before the stream was open.");
  }
  absl::StatusOr<std::optional<Frame>> frame = assembly_->add(part);
  if (!frame.ok()) return frame.status();
  if (!frame->has_value()) return absl::OkStatus();

  std::uint64_t stream = 0;
  {
    const std::scoped_lock lock(mutex_);
    stream = stream_;
    rules_.frame_fitted();
    ledger_.show((*frame)->epoch, (*frame)->input_seq);
    const bool is_void =
        better_ && ((*frame)->input_seq > better_->input_seq || (*frame)->energy <= better_->energy);
    if (is_void) better_.reset();
  }
  const std::uint64_t frame_seq = (*frame)->frame_seq;
  if (box_.put(*std::move(*frame), stream)) return absl::OkStatus();
  acknowledge(frame_seq, stream);  // dropped, but its credit must be given back
  return absl::OkStatus();
}

/// What an error means for our update. If its uploads are lost, because a server ended or the session moved to another
/// one, the update is sent again once. A server that loses the new uploads as well would not do better the next time.
/// Called with the lock held.
Answer Link::judge(std::uint64_t seq, const absl::Status& status) {
  const Answer answer = answer_of(status, seq == sent_again_);
  if (fault_of(status).reason == Reason::kUploadUnknown) sent_again_ = seq;
  return answer;
}

/// If the update must be sent again, the fault ends the stream; the next stream sends it after the pause that the fault
/// asks for. A fault that only says why a solve for the update failed is not reported once there is a newer update. The
/// ledger and the box change under one lock, so that settle() finds the error of every refusal that the ledger shows.
absl::Status Link::take(const v1::Fault& fault) {
  const absl::Status status = from_wire(fault);
  const std::uint64_t seq = fault.input_seq();
  const std::scoped_lock lock(mutex_);
  const Answer answer = judge(seq, status);
  if (seq != 0 && answer == Answer::kAgain) return status;
  const bool is_void = answer == Answer::kTaken && seq != 0 && seq < ledger_.newest();
  if (answer == Answer::kTaken) ledger_.accept(seq);
  if (answer == Answer::kRefused) ledger_.refuse(seq);
  note_answered(seq);
  if (!is_void) box_.put_problem(status);
  changed_.notify_all();
  return absl::OkStatus();
}

}  // namespace lpdeform::client
