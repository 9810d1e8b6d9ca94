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

/// Makes a session of the C++ client; waits, until it is asked to stop. Called again, on one thread, where it fails in a way that
/// may pass (client::is_undecided).
using Opening = std::function<absl::StatusOr<client::Session>(const std::stop_token&)>;

/// A session of the C interface: one that may not be there yet. A thread of its own opens it, gives it what was
/// changed meanwhile, and closes it in the end; callers never wait for that thread. Functions may be called
/// from any thread.
class LiveSession {
 public:
  struct Facts {
    Space space;
    FrameContents contents;
    std::uint32_t vertex_count = 0;  // 0: the server knows
    bool is_reader = false;
    double reconnect_seconds = 0;  // 0: for ever
  };

  LiveSession(Opening opening, Facts facts);
  /// Waits as wait_until_closed().
  ~LiveSession();

  const Space& space() const { return facts_.space; }

  absl::StatusOr<std::uint64_t> send(client::Update update);
  /// As lpdeform_undo and lpdeform_redo. Waits.
  absl::StatusOr<std::uint64_t> undo(bool redo);
  /// As lpdeform_take_snapshot. Waits.
  absl::StatusOr<std::string> snapshot();
  lpdeform_state state(absl::Status& why) const;
  /// Empty where there is none.
  std::optional<client::Notice> notice() const;
  /// What the server has to say of the mesh; empty where that is nothing.
  std::string mesh_notice() const;
  absl::StatusOr<std::string> name() const;
  std::uint32_t vertex_count() const;

  // As lpdeform_poll, lpdeform_repeat and lpdeform_settle; empty is LPDEFORM_NO_FRAME.
  absl::StatusOr<std::optional<lpdeform_frame>> poll(const lpdeform_buffers& buffers);
  absl::StatusOr<std::optional<lpdeform_frame>> repeat(const lpdeform_buffers& buffers);
  absl::StatusOr<std::optional<lpdeform_frame>> settle(double timeout_seconds,
                                                       const lpdeform_buffers& buffers);
  /// As lpdeform_solve; `timeout_seconds` 0 is without limit.
  absl::StatusOr<std::optional<lpdeform_frame>> solve(double timeout_seconds, bool certify,
                                                      const lpdeform_buffers& buffers);

  /// The session is over; the thread closes it, once it is open where that was begun.
  void close();
  /// The same, and what is being opened is given up.
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
  /// False where there is none. Under frame_mutex_, so that of several threads none puts an older frame over a newer one.
  absl::StatusOr<bool> take_newest(client::Session& live);
  /// Numbers of changes become the caller's.
  lpdeform_frame write(const client::Frame& frame, const lpdeform_buffers& buffers) const;

  Opening opening_;  // of the thread; empty once it is of no more use
  std::stop_source stop_;
  const Facts facts_;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::shared_ptr<client::Session> session_;  // once there is one, until it is closed
  std::optional<client::Update> pending_;     // what was changed before
  std::uint64_t pending_count_ = 0;           // so many changes
  std::int64_t seq_offset_ = 0;               // of our numbers over the session's
  std::uint64_t first_seq_ =
      0;  // of the session's, that the changes made before it became; earlier ones are not ours
  absl::Status last_problem_;
  absl::Status refused_;
  mutable std::atomic<bool> was_live_ = false;  // seen so, or a frame came
  bool is_closing_ = false;
  bool is_closed_ = false;

  std::mutex frame_mutex_;                   // after mutex_, where both are held
  std::optional<client::Frame> last_frame_;  // as the session gave it

  std::thread thread_;
};

}  // namespace lpdeform::engine
