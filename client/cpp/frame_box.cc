#include "client/cpp/frame_box.h"

#include <utility>

namespace lpdeform::client {

bool FrameBox::put(Frame frame, std::uint64_t stream) {
  const std::scoped_lock lock(mutex_);
  if (frame.epoch < epoch_ || frame.input_seq < input_seq_) return false;
  epoch_ = frame.epoch;
  input_seq_ = frame.input_seq;
  if (newest_) frame.skipped_inputs += newest_->frame.skipped_inputs;
  newest_ = Taken{std::move(frame), stream};
  changed_.notify_all();
  return true;
}

void FrameBox::put_problem(absl::Status problem) {
  const std::scoped_lock lock(mutex_);
  if (problems_.size() == kMostProblems) problems_.pop_front();
  problems_.push_back(std::move(problem));
  changed_.notify_all();
}

void FrameBox::begin_epoch(std::uint64_t epoch) {
  const std::scoped_lock lock(mutex_);
  if (epoch <= epoch_) return;
  epoch_ = epoch;
  newest_.reset();
}

void FrameBox::begin_session() {
  const std::scoped_lock lock(mutex_);
  epoch_ = 0;
  newest_.reset();
}

void FrameBox::finish(absl::Status why) {
  const std::scoped_lock lock(mutex_);
  end_ = std::move(why);
  changed_.notify_all();
}

absl::Status FrameBox::end() const {
  const std::scoped_lock lock(mutex_);
  return end_.value_or(absl::OkStatus());
}

void FrameBox::resume() {
  const std::scoped_lock lock(mutex_);
  end_.reset();
  last_final_.reset();
}

absl::StatusOr<std::optional<FrameBox::Taken>> FrameBox::take(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  // Waiting for a time in the past would still take the system's shortest sleep.
  if (Clock::now() < deadline) changed_.wait_until(lock, deadline, [this] { return has_something(); });
  if (!problems_.empty()) {
    absl::Status problem = std::move(problems_.front());
    problems_.pop_front();
    ++takes_;
    changed_.notify_all();
    return problem;
  }
  if (newest_) {
    last_final_ = newest_->frame.is_final ? std::optional(newest_->frame) : std::nullopt;
    ++takes_;
    changed_.notify_all();
    return std::exchange(newest_, std::nullopt);
  }
  if (end_) return *end_;
  return std::nullopt;
}

bool FrameBox::wait(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return changed_.wait_until(lock, deadline, [this] { return has_something(); });
}

bool FrameBox::wait(Clock::time_point deadline, std::uint64_t takes) {
  std::unique_lock lock(mutex_);
  return changed_.wait_until(lock, deadline, [&] { return has_something() || takes_ != takes; });
}

std::uint64_t FrameBox::takes() const {
  const std::scoped_lock lock(mutex_);
  return takes_;
}

bool FrameBox::has_problem() const {
  const std::scoped_lock lock(mutex_);
  return !problems_.empty();
}

std::optional<Frame> FrameBox::last_final() const {
  const std::scoped_lock lock(mutex_);
  return last_final_;
}

}  // namespace lpdeform::client
