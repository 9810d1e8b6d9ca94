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
#include "server/session/frame_pace.h"
#include "server/session/update.h"

namespace lpdeform {

class Publisher;

/// What a reader asked for. The fields mean the same as in frame.proto.
struct StreamOptions {
  std::uint32_t credit = 2;
  Format format = Format::kFloat32;
  /// The least precise format that the server may use to keep within max_bytes_per_second.
  Format lowest_format = Format::kFloat32;
  bool with_distortion = true;
  bool with_normals = false;
  bool with_certificate = false;
  double max_frames_per_second = 0;  // see FramePace
  /// The server's limit; 0: without limit. To keep it, the stream first lowers the frame rate down to
  /// kLowestRate, then the precision, then the frame rate again.
  double max_bytes_per_second = 0;

  static constexpr std::uint32_t kMostCredit = 8;
  static constexpr double kLowestRate = 10;

  /// The format in which a frame of this surface is sent.
  Format format_for(const Surface& surface) const;
};

enum class EndReason {
  kSessionDeleted,
  kSessionExpired,
  kDraining,   // the server shuts down
  kElsewhere,  // another server has the session; clients are told that this one drains
  kWriterReplaced,
  kProtocolError,
  kTokenExpired
};

/// Whether the session still exists: clients find it at another server, or at this one after a restart.
inline bool goes_on(EndReason reason) {
  return reason == EndReason::kDraining || reason == EndReason::kElsewhere;
}

// The messages that a stream may have to send.
struct OpenedNote {
  std::uint64_t epoch = 0;
  std::uint64_t input_seq = 0;
};
struct HeartbeatNote {};
/// The server became overloaded, or is no longer.
struct LoadNote {
  bool is_overloaded = false;
};
/// A shape of lower energy is known for the session's newest inputs. `number` rises with each one.
struct BetterNote {
  std::uint64_t number = 0;
  std::uint64_t input_seq = 0;
  double energy = 0;
  double saved_share = 0;  // of the present energy
};
struct FaultNote {
  absl::Status status;
  std::uint64_t input_seq = 0;
};
struct EndNote {
  EndReason reason = EndReason::kDraining;
  std::string text;
};
using Note = std::variant<OpenedNote, FramePiece, UpdateResult, FaultNote, LoadNote, BetterNote,
                          HeartbeatNote, EndNote>;

/// One reader of a session: decides what to send to it and when. It holds at most one frame, the one that is
/// being cut into pieces. The next frame is the publisher's newest at that time. Backpressure: a frame is
/// begun only while fewer than `credit` frames are sent and not acknowledged. Thread-safe. Under its lock it
/// calls only the publisher.
class FrameStream : public std::enable_shared_from_this<FrameStream> {
 public:
  /// Whether the server is overloaded now; must not wait. Empty if that is unknown.
  using IsOverloaded = std::function<bool()>;

  FrameStream(StreamOptions options, std::shared_ptr<Publisher> publisher, std::shared_ptr<Timers> timers,
              Timers::Duration heartbeat, OpenedNote opened, IsOverloaded is_overloaded = {});

  const std::string& id() const { return id_; }
  const StreamOptions& options() const { return options_; }
  Timers::Duration heartbeat() const { return heartbeat_; }

  /// `waker` is called, on any thread and under no lock, when next() may have something new. Call start()
  /// once, before the first next().
  void start(std::function<void()> waker);

  /// What the caller should send now; empty if there is nothing. An EndNote is the last message.
  std::optional<Note> next();

  /// The reader has received this frame and all before it. INVALID_ARGUMENT ACK_NOT_SENT if the frame was not
  /// sent yet.
  absl::Status acknowledge(std::uint64_t frame_seq);

  /// Queues the answer to an update that came on this stream. The caller limits how many answers wait.
  void answer(UpdateResult result);
  void answer(FaultNote fault);

  std::size_t answers_waiting() const;

  /// Why the server ended the stream; empty if it did not.
  std::optional<EndReason> ended_by() const;

  /// How long a frame has waited for its reader to acknowledge earlier frames; 0 if none waits.
  Timers::Duration waited_for_credit() const;

  /// frame_seq of the last frame that was begun; 0 if there was none.
  std::uint64_t last_frame_seq() const;

  /// Ends the stream. If it is called again, the first reason counts.
  void end(EndReason reason, std::string text);

  /// Tells the sender that next() may have something new.
  void wake();

  /// Whether a frame with this Frame::taken, if published now, could be sent at once.
  bool wants_frame(std::uint64_t taken) const;

 private:
  std::optional<Note> next_locked(Timers::TimePoint now);
  void begin_frame(Timers::TimePoint now);
  FramePiece next_piece();
  FramePace::Kind kind_of(std::uint64_t taken) const;
  Timers::TimePoint next_frame_at(FramePace::Kind kind) const;
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
  bool was_answer_ = false;  // answers go first, but alternate with the pieces of a frame
  std::optional<EndNote> end_;
  std::optional<EndReason> ended_by_;
  FrameCutter cutter_;
  std::deque<std::uint64_t> in_flight_;  // frame_seqs of frames begun and not acknowledged, ascending
  std::uint64_t last_seq_ = 0;           // of the last frame begun
  std::uint64_t last_taken_ = 0;
  bool has_sent_frame_ = false;
  bool is_stalled_ = false;  // a frame waits for credit
  Timers::TimePoint stalled_since_;
  bool has_said_overloaded_ = false;
  std::uint64_t last_fault_ = 0;
  std::uint64_t last_better_ = 0;  // number of the last better shape announced
  std::size_t last_bytes_ = 0;     // the numbers of the last frame
  Timers::TimePoint last_frame_at_;
  FramePace pace_;
  Timers::TimePoint last_sent_at_;
  bool is_heartbeat_armed_ = false;  // a timer is set; at most one of each kind
  bool is_pace_armed_ = false;
};

}  // namespace lpdeform
