#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>

#include "absl/status/status.h"
#include "server/runtime/timers.h"
#include "server/session/frame.h"
#include "server/session/update.h"

namespace lpdeform {

class Publisher;

/// What a reader asked for; meanings as in frame.proto.
struct StreamOptions {
  std::uint32_t credit = 2;
  Format format = Format::kFloat32;
  /// What the server may go down to where max_bytes_per_second asks for it.
  Format lowest_format = Format::kFloat32;
  bool with_distortion = true;
  bool with_normals = false;
  bool with_certificate = false;
  double max_frames_per_second = 0;
  /// The server's; 0 is without limit. Lowers the frame rate first, to kLowestRate, then the precision, then the rate
  /// again.
  double max_bytes_per_second = 0;

  static constexpr std::uint32_t kMostCredit = 8;
  static constexpr double kLowestRate = 10;

  /// How a frame of this surface is to travel.
  Format format_for(const Surface& surface) const;
};

enum class EndReason {
  kSessionDeleted,
  kSessionExpired,
  kDraining,   // the server shuts down
  kElsewhere,  // another server has the session; clients are told the same
  kWriterReplaced,
  kProtocolError,
  kTokenExpired
};

/// The session is not gone: its clients find it at another server, or at this one once it runs again.
inline bool goes_on(EndReason reason) {
  return reason == EndReason::kDraining || reason == EndReason::kElsewhere;
}

// What a stream may have to send.
struct OpenedNote {
  std::uint64_t epoch = 0;
  std::uint64_t input_seq = 0;
};
struct HeartbeatNote {};
/// The server has more to do than it can, or has no more.
struct LoadNote {
  bool is_overloaded = false;
};
struct FaultNote {
  absl::Status status;
  std::uint64_t input_seq = 0;
};
struct EndNote {
  EndReason reason = EndReason::kDraining;
  std::string text;
};
using Note = std::variant<OpenedNote, FramePiece, UpdateResult, FaultNote, LoadNote, HeartbeatNote, EndNote>;

/// One reader of a session: decides what to send to it, and when. It holds at most one frame, the one that is
/// being cut into pieces; what waits is the publisher's newest. A frame is begun only when fewer than
/// `credit` frames are sent and not acknowledged. Thread-safe; calls no one under its lock but the publisher.
class FrameStream : public std::enable_shared_from_this<FrameStream> {
 public:
  /// Whether the server is overloaded now; must not wait. Empty where nobody knows.
  using IsOverloaded = std::function<bool()>;

  FrameStream(StreamOptions options, std::shared_ptr<Publisher> publisher, std::shared_ptr<Timers> timers,
              Timers::Duration heartbeat, OpenedNote opened, IsOverloaded is_overloaded = {});

  const std::string& id() const { return id_; }
  const StreamOptions& options() const { return options_; }
  Timers::Duration heartbeat() const { return heartbeat_; }

  /// `waker` is called, on any thread and under no lock, when next() may have something new. Once, before the
  /// first next().
  void start(std::function<void()> waker);

  /// What to send now; empty where there is nothing. The caller sends it. An EndNote is the last.
  std::optional<Note> next();

  /// This frame and all before it have been received. INVALID_ARGUMENT ACK_NOT_SENT where it was not sent
  /// yet.
  absl::Status acknowledge(std::uint64_t frame_seq);

  /// The answer to an update that came on this stream. The caller bounds how many wait.
  void answer(UpdateResult result);
  void answer(FaultNote fault);

  std::size_t answers_waiting() const;

  /// Why the server ended it; empty where it did not.
  std::optional<EndReason> ended_by() const;

  /// How long a frame has waited for its reader to acknowledge those before it; 0 where none does.
  Timers::Duration waited_for_credit() const;

  /// Of the last frame that was begun; 0 where there was none.
  std::uint64_t last_frame_seq() const;

  /// The stream is to end; the first reason counts.
  void end(EndReason reason, std::string text);

  /// Says that next() may have something new.
  void wake();

  /// Whether a frame published now could be sent at once.
  bool wants_frame() const;

 private:
  std::optional<Note> next_locked(Timers::TimePoint now);
  void begin_frame(Timers::TimePoint now);
  FramePiece next_piece();
  Timers::TimePoint next_frame_at() const;
  void arm(bool& is_armed, Timers::TimePoint when);

  const std::string id_;
  const StreamOptions options_;
  const std::shared_ptr<Publisher> publisher_;
  const std::shared_ptr<Timers> timers_;
  const Timers::Duration heartbeat_;
  const OpenedNote opened_;
  const IsOverloaded is_overloaded_;

  mutable std::mutex mutex_;
  std::function<void()> waker_;
  bool is_opened_ = false;
  bool is_ended_ = false;
  std::deque<Note> answers_;
  bool was_answer_ = false;  // answers go first, but take turns with the pieces of a frame
  std::optional<EndNote> end_;
  std::optional<EndReason> ended_by_;
  FrameCutter cutter_;
  std::deque<std::uint64_t> in_flight_;  // frame_seqs begun and not acknowledged, ascending
  std::uint64_t last_seq_ = 0;           // of the last frame begun
  std::uint64_t last_taken_ = 0;
  bool has_sent_frame_ = false;
  bool is_stalled_ = false;  // a frame waits for credit
  Timers::TimePoint stalled_since_;
  bool has_said_overloaded_ = false;
  std::uint64_t last_fault_ = 0;
  std::size_t last_bytes_ = 0;  // of the last frame's numbers
  Timers::TimePoint last_frame_at_;
  Timers::TimePoint last_sent_at_;
  bool is_heartbeat_armed_ = false;  // a timer is set; one of each kind at a time
  bool is_pace_armed_ = false;
};

}  // namespace lpdeform
