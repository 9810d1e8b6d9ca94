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

/// Where a session's frames meet its readers: one slot with the newest frame, one with the fault that stands.
/// Readers that are slow miss frames; the newest, and so the final one of the last input, always waits for
/// them. Thread-safe.
class Publisher {
 public:
  explicit Publisher(std::shared_ptr<Metrics> metrics = std::make_shared<Metrics>());

  /// A fault that concerns every reader until the cause is gone. `number` rises with each.
  struct Standing {
    std::uint64_t number = 0;
    FaultNote fault;
  };

  /// Numbers the frame within its epoch, puts it into the slot and wakes the readers.
  std::shared_ptr<const Frame> publish(Frame frame);

  /// Publishes the newest frame again, now with its certificate: for the readers that asked for it, and for those
  /// that it has not been sent to. After a publish().
  void certify_newest(double optimality_gap);

  /// Frames sent from now on are of this epoch, the one in the slot too. The readers hear of it with wake_all(), because
  /// whoever begins an epoch holds a lock as a rule, and a reader's waker may want it.
  void begin_epoch(std::uint64_t epoch);

  /// Wakes every reader. To be called under no lock.
  void wake_all() const;

  /// Puts up a fault, or takes it down.
  void set_standing(std::optional<FaultNote> fault);

  /// An update was taken: measures how long readers wait for the first frame that answers it.
  void took(std::uint64_t input_seq, AnswerClock::TimePoint since);

  std::shared_ptr<const Frame> newest() const;
  std::optional<Standing> standing() const;

  /// False, and nothing happens, once closed. Whoever made the stream owns it.
  bool add(const std::shared_ptr<FrameStream>& stream);
  void remove(const FrameStream& stream);
  /// The stream of this id; null where there is none.
  std::shared_ptr<FrameStream> find(const std::string& id) const;

  std::size_t reader_count() const;
  /// Whether any reader could be sent a frame at once.
  bool is_frame_wanted() const;
  /// Whether any reader asked for certificates.
  bool is_certificate_wanted() const;

  /// Ends every stream and takes no more.
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
  std::uint64_t frames_ = 0;
  std::uint64_t epoch_ = 1;
  bool is_closed_ = false;
  AnswerClock waiting_;
  std::vector<std::weak_ptr<FrameStream>> streams_;  // weak, because a stream holds its publisher
};

}  // namespace lpdeform
