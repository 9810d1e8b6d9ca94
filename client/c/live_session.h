#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/c/frame_writer.h"
#include "client/c/lpdeform.h"
#include "client/c/space.h"
#include "client/cpp/client.h"

namespace lpdeform::engine {

/// Creates a session of the C++ client. Waits; ends early if asked to stop. Called again, on the same thread, after an
/// error that may be temporary (client::is_undecided).
using Opening = std::function<absl::StatusOr<client::Session>(const std::stop_token&)>;

/// A session of the C interface, which may not exist on the server yet. A thread of its own opens it, sends the changes
/// that were made meanwhile, and closes it in the end. Callers never wait for that thread, except in functions that say
/// so. Thread-safe.
class LiveSession {
 public:
  struct Facts {
    Space space;
    FrameContents contents;
    std::uint32_t vertex_count = 0;  // 0: only the server knows it
    bool is_reader = false;
    double reconnect_seconds = 0;  // 0: without limit
  };

  LiveSession(Opening opening, Facts facts);
  /// Waits like wait_until_closed().
  ~LiveSession();

  const Space& space() const { return facts_.space; }

  absl::StatusOr<std::uint64_t> send(client::Update update);
  /// As lpdeform_undo and lpdeform_redo. Waits.
  absl::StatusOr<std::uint64_t> undo(bool redo);
  /// As lpdeform_take_better_shape. Waits.
  absl::Status take_better_shape();
  /// Of the notice, while it applies.
  std::optional<lpdeform_better_shape> better_shape() const;
  /// As lpdeform_take_snapshot. Waits.
  absl::StatusOr<std::string> snapshot();
  lpdeform_state state(absl::Status& why) const;
  /// Empty if there is none.
  std::optional<client::Notice> notice() const;
  /// The server's warning about the mesh; empty if there is none.
  std::string mesh_notice() const;
  absl::StatusOr<std::string> name() const;
  std::uint32_t vertex_count() const;

  // As lpdeform_poll, lpdeform_repeat and lpdeform_settle; empty means LPDEFORM_NO_FRAME.
  absl::StatusOr<std::optional<lpdeform_frame>> poll(const lpdeform_buffers& buffers);
  absl::StatusOr<std::optional<lpdeform_frame>> repeat(const lpdeform_buffers& buffers);
  absl::StatusOr<std::optional<lpdeform_frame>> settle(double timeout_seconds,
                                                       const lpdeform_buffers& buffers);
  /// As lpdeform_solve; `timeout_seconds` 0 means no limit.
  absl::StatusOr<std::optional<lpdeform_frame>> solve(double timeout_seconds, bool certify,
                                                      const lpdeform_buffers& buffers,
                                                      lpdeform_search& search);

  /// Ends the session for the caller. The thread closes it; if it is still being opened, after that.
  void close();
  /// The same, but aborts an opening that is under way.
  void stop();
  bool is_closed() const;
  void wait_until_closed();

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  void refuse(absl::Status why);
  void open_patiently();
  bool is_past_help(const absl::Status& failed, Clock::time_point since) const;
  void hand_over(client::Session session);
  std::uint64_t ours(std::uint64_t seq) const;
  absl::Status check(const lpdeform_buffers& buffers) const;
  absl::StatusOr<std::shared_ptr<client::Session>> session() const;
  absl::StatusOr<std::shared_ptr<client::Session>> wait_for_session(Clock::time_point deadline);
  /// False if there is no new frame. Called under frame_mutex_, so that no thread replaces a newer frame by an older
  /// one.
  absl::StatusOr<bool> take_newest(client::Session& live);
  /// Writes the frame; converts numbers of changes to the caller's.
  lpdeform_frame write(const client::Frame& frame, const lpdeform_buffers& buffers) const;

  Opening opening_;  // used by the thread; empty when no longer needed
  std::stop_source stop_;
  const Facts facts_;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::shared_ptr<client::Session> session_;  // null before it is open and after it is closed
  std::optional<client::Update> pending_;     // changes made before there was a session, merged
  std::uint64_t pending_count_ = 0;           // the number of these changes
  std::int64_t seq_offset_ = 0;               // our numbers minus the session's
  std::uint64_t first_seq_ =
      0;  // the session's number for the changes made before it was open; lower numbers are not ours
  absl::Status last_problem_;
  absl::Status refused_;
  mutable std::atomic<bool> was_live_ = false;  // was seen live, or a frame arrived
  bool is_closing_ = false;
  bool is_closed_ = false;

  std::mutex frame_mutex_;                   // locked after mutex_ if both are held
  std::optional<client::Frame> last_frame_;  // as the session gave it

  std::thread thread_;
};

}  // namespace lpdeform::engine
