#include "server/session/publisher.h"

#include <algorithm>
#include <utility>

namespace lpdeform {

Publisher::Publisher(std::shared_ptr<Metrics> metrics) : metrics_(std::move(metrics)) {}

std::shared_ptr<const Frame> Publisher::publish(Frame frame) {
  // Frames are encoded here, on the solver's thread, in every format that readers use, so that no reader's
  // thread has to encode.
  for (const auto& stream : readers()) {
    const StreamOptions& options = stream->options();
    frame.surface->prepare(options.format_for(*frame.surface), options.with_normals);
  }

  std::shared_ptr<const Frame> published;
  {
    const std::scoped_lock lock(mutex_);
    frame.frame_seq = ++frames_;
    frame.epoch = epoch_;
    frame.published_at = std::chrono::steady_clock::now();
    published = newest_ = std::make_shared<const Frame>(std::move(frame));
    measure_answer();
  }
  metrics_->add(Count::kFramesPublished);
  wake_all();
  return published;
}

void Publisher::measure_answer() {
  waiting_.answered(newest_->input_seq, std::chrono::steady_clock::now(),
                    [this](double seconds) { metrics_->observe(Span::kInputToFrame, seconds); });
}

void Publisher::begin_epoch(std::uint64_t epoch) {
  const std::scoped_lock lock(mutex_);
  epoch_ = epoch;
  if (!newest_) return;
  Frame again = *newest_;
  again.frame_seq = ++frames_;
  again.epoch = epoch;
  again.repeats = 0;
  newest_ = std::make_shared<const Frame>(std::move(again));
}

void Publisher::certify_newest(double optimality_gap) {
  {
    const std::scoped_lock lock(mutex_);
    Frame again = *newest_;
    again.repeats = newest_->frame_seq;
    again.frame_seq = ++frames_;
    again.optimality_gap = optimality_gap;
    newest_ = std::make_shared<const Frame>(std::move(again));
  }
  wake_all();
}

void Publisher::set_standing(std::optional<FaultNote> fault) {
  {
    const std::scoped_lock lock(mutex_);
    if (!fault && !standing_) return;
    standing_.reset();
    if (fault) waiting_.forget();  // no frame will answer them
    if (fault) standing_ = Standing{++faults_, *std::move(fault)};
  }
  wake_all();
}

bool Publisher::announce(BetterNote better) {
  {
    const std::scoped_lock lock(mutex_);
    if (is_better_taken_) return false;
    better.number = ++better_shapes_;
    better_ = better;
  }
  wake_all();
  return true;
}

bool Publisher::forget_better() {
  const std::scoped_lock lock(mutex_);
  better_.reset();
  return std::exchange(is_better_taken_, false);
}

std::optional<BetterNote> Publisher::take_better(std::uint64_t input_seq) {
  const std::scoped_lock lock(mutex_);
  if (!better_ || better_->input_seq != input_seq) return std::nullopt;
  is_better_taken_ = true;
  return better_;
}

bool Publisher::is_better_taken() const {
  const std::scoped_lock lock(mutex_);
  return is_better_taken_;
}

std::optional<BetterNote> Publisher::better() const {
  const std::scoped_lock lock(mutex_);
  return better_;
}

void Publisher::took(std::uint64_t input_seq, AnswerClock::TimePoint since) {
  metrics_->add(Count::kUpdates);
  const std::scoped_lock lock(mutex_);
  if (streams_.empty()) return;
  waiting_.took(input_seq, since);
  if (newest_ && newest_->input_seq >= input_seq)
    measure_answer();  // the frame was published before this call
}

void Publisher::begun(std::uint64_t input_seq) {
  const std::scoped_lock lock(mutex_);
  waiting_.begun(input_seq, std::chrono::steady_clock::now(),
                 [this](double seconds) { metrics_->observe(Span::kInputToSolve, seconds); });
}

std::shared_ptr<const Frame> Publisher::newest() const {
  const std::scoped_lock lock(mutex_);
  return newest_;
}

std::optional<Publisher::Standing> Publisher::standing() const {
  const std::scoped_lock lock(mutex_);
  return standing_;
}

bool Publisher::add(const std::shared_ptr<FrameStream>& stream) {
  const std::scoped_lock lock(mutex_);
  if (is_closed_) return false;
  streams_.push_back(stream);
  return true;
}

void Publisher::remove(const FrameStream& stream) {
  const std::scoped_lock lock(mutex_);
  std::erase_if(streams_, [&](const auto& one) { return one.expired() || one.lock().get() == &stream; });
  if (streams_.empty()) waiting_.forget();
}

std::shared_ptr<FrameStream> Publisher::find(const std::string& id) const {
  const auto all = readers();
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one->id() == id; });
  return found == all.end() ? nullptr : *found;
}

std::size_t Publisher::reader_count() const {
  const std::scoped_lock lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(streams_.begin(), streams_.end(), [](const auto& one) { return !one.expired(); }));
}

bool Publisher::is_frame_wanted(std::uint64_t taken) const {
  const auto all = readers();
  return std::any_of(all.begin(), all.end(), [&](const auto& stream) { return stream->wants_frame(taken); });
}

bool Publisher::is_certificate_wanted() const {
  const auto all = readers();
  return std::any_of(all.begin(), all.end(),
                     [](const auto& stream) { return stream->options().with_certificate; });
}

void Publisher::close(EndReason reason, const std::string& text) {
  {
    const std::scoped_lock lock(mutex_);
    is_closed_ = true;
  }
  for (const auto& stream : readers()) stream->end(reason, text);
}

std::vector<std::shared_ptr<FrameStream>> Publisher::readers() const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::shared_ptr<FrameStream>> all;
  for (const auto& one : streams_) {
    if (auto stream = one.lock()) all.push_back(std::move(stream));
  }
  return all;
}

void Publisher::wake_all() const {
  for (const auto& stream : readers()) stream->wake();
}

}  // namespace lpdeform
