#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "client/cli/load/histogram.h"
#include "client/cpp/client.h"

namespace lpdeform::cli {

/// The results of a lane, or of several lanes together.
struct LoadTally {
  Histogram latency;             // from when an update was due to the first frame that answers it
  Histogram setup;               // from asking for a session to its first finished result
  std::uint64_t due = 0;         // updates that were due
  std::uint64_t unanswered = 0;  // of these, updates without a frame at the end
  std::uint64_t frames = 0;
  std::uint64_t skipped = 0;  // updates that no frame answers, because a newer one came first
  std::uint64_t stale = 0;    // frames for an older update than the newest one sent
  std::uint64_t payload_bytes = 0;
  std::uint64_t reconnects = 0;
  std::map<std::string, std::uint64_t> errors;  // by reason

  void add(const LoadTally& other);
};

/// One session under load: a mesh of about this many vertices, with one end held and the other moved by every
/// update. Updates are due at fixed times, and each is measured from when it was due. So a server or a lane
/// that falls behind shows as latency, not as fewer updates.
class Lane {
 public:
  using Clock = std::chrono::steady_clock;
  using Connect = std::function<absl::StatusOr<client::Client>()>;

  /// Opens the session and waits for its first result. Errors: those of the server.
  static absl::StatusOr<std::unique_ptr<Lane>> open(const Connect& connect, int vertices, double p);
  /// Deletes the session.
  ~Lane();

  int vertices() const { return vertices_; }

  /// Sends the update that was due at `due`; does not wait.
  void move(Clock::time_point due);

  /// Adds a second reader, which takes a frame every `pause`.
  void add_slow_reader(std::chrono::milliseconds pause);

  /// Drops the connection and takes the session over on a new one.
  void reconnect();

  /// Whether every update is answered.
  bool is_answered() const;

  /// Ends the lane's threads. Updates that are unanswered now stay so.
  LoadTally finish();

 private:
  Lane(Connect connect, int vertices) : connect_(std::move(connect)), vertices_(vertices) {}
  absl::StatusOr<std::shared_ptr<client::Session>> join();
  void read();
  void read_slowly(client::Session session, std::chrono::milliseconds pause);
  void take(const client::Frame& frame);
  void note(const absl::Status& error);
  std::shared_ptr<client::Session> driver() const;

  const Connect connect_;
  const int vertices_;
  /// Makes the session and does nothing more, so that the session outlives reconnects.
  std::optional<client::Session> owner_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool is_over_ = false;
  bool is_reconnecting_ = false;
  std::shared_ptr<client::Session> driver_;
  std::uint64_t moves_ = 0;
  std::uint64_t newest_seq_ = 0;
  struct Pending {
    std::uint64_t input_seq;
    Clock::time_point due;
  };
  std::deque<Pending> pending_;
  LoadTally tally_;

  std::thread reader_, slow_reader_;
};

}  // namespace lpdeform::cli
