#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "server/runtime/answer_clock.h"
#include "server/runtime/metrics.h"
#include "server/session/frame_stream.h"

namespace lpdeform {

/// Where a session's frames meet its readers: one slot for the newest frame, and one for the standing fault.
/// Slow readers miss frames. The newest frame, which includes the final frame of the last input, always waits
/// for them. Thread-safe.
class Publisher {
 public:
  explicit Publisher(std::shared_ptr<Metrics> metrics = std::make_shared<Metrics>());

  /// A fault that concerns every reader until its cause is gone. `number` rises with each fault.
  struct Standing {
    std::uint64_t number = 0;
    FaultNote fault;
  };

  /// Numbers the frame within its epoch, puts it into the slot and wakes the readers.
  std::shared_ptr<const Frame> publish(Frame frame);

  /// Publishes the newest frame again, now with its certificate, for readers that asked for certificates and
  /// for readers to which the frame has not been sent. Only after a publish().
  void certify_newest(double optimality_gap);

  /// Frames sent from now on belong to this epoch, including the one in the slot. Call wake_all() afterwards
  /// to tell the readers. The two are separate because the caller usually holds a lock that a reader's waker
  /// may need.
  void begin_epoch(std::uint64_t epoch);

  /// Wakes every reader. Call it under no lock.
  void wake_all() const;

  /// Sets the standing fault, or clears it.
  void set_standing(std::optional<FaultNote> fault);

  /// Announces a better shape to every reader, also to those that come later, until forget_better(). Gives it its number.
  /// False, and does nothing, if a writer has taken the shape announced before, which then has to be shown first.
  bool announce(BetterNote better);
  std::optional<BetterNote> better() const;
  /// Takes what is announced, if it is for this input. The solver must then make it the session's state, whatever comes next.
  /// It learns of it by is_better_taken(), and by forget_better(), after which nothing can be taken.
  std::optional<BetterNote> take_better(std::uint64_t input_seq);
  bool is_better_taken() const;
  /// Returns whether it was taken.
  bool forget_better();

  /// An update was taken. Starts to measure how long readers wait for the first frame that answers it.
  void took(std::uint64_t input_seq, AnswerClock::TimePoint since);

  /// The solver has taken over this update and all before it.
  void begun(std::uint64_t input_seq);

  std::shared_ptr<const Frame> newest() const;
  std::optional<Standing> standing() const;

  /// Adds a stream, which its creator owns. Returns false and does nothing once the publisher is closed.
  bool add(const std::shared_ptr<FrameStream>& stream);
  void remove(const FrameStream& stream);
  /// The stream with this id; null if there is none.
  std::shared_ptr<FrameStream> find(const std::string& id) const;

  std::size_t reader_count() const;
  /// Whether any reader could be sent a frame with this Frame::taken at once.
  bool is_frame_wanted(std::uint64_t taken) const;
  /// Whether any reader asked for certificates.
  bool is_certificate_wanted() const;

  /// Ends every stream and accepts no more.
  void close(EndReason reason, const std::string& text);

  Metrics& metrics() const { return *metrics_; }

 private:
  std::vector<std::shared_ptr<FrameStream>> readers() const;
  void measure_answer();

  const std::shared_ptr<Metrics> metrics_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Frame> newest_;
  std::optional<Standing> standing_;
  std::uint64_t faults_ = 0;
  std::optional<BetterNote> better_;
  bool is_better_taken_ = false;
  std::uint64_t better_shapes_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t epoch_ = 1;
  bool is_closed_ = false;
  AnswerClock waiting_;
  std::vector<std::weak_ptr<FrameStream>> streams_;  // weak, because a stream holds its publisher
};

}  // namespace lpdeform
