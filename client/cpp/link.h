#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cpp/client.h"
#include "client/cpp/frame_assembly.h"
#include "client/cpp/frame_box.h"
#include "client/cpp/lease.h"
#include "client/cpp/ledger.h"
#include "client/cpp/recovery.h"
#include "client/cpp/rpc.h"
#include "client/cpp/upload.h"

namespace lpdeform::client {

/// The implementation of a Session: the lease on the server's session, the ledger of updates, the box of frames, and
/// the thread that keeps a Deform stream open between them. That thread sends. A second thread, which lives as long as
/// a stream, receives. Calls of the Session arrive on any thread. One mutex guards all state; no call to the server and
/// no callback is made under it.
class Link {
 public:
  Link(std::shared_ptr<Rpc> rpc, ClientOptions client_options, OpenOptions options, Copy copy, Lease lease);
  ~Link();

  // As in Session.
  absl::StatusOr<std::uint64_t> update(Update update);
  absl::StatusOr<Frame> next_frame(FrameBox::Clock::time_point deadline);
  absl::StatusOr<std::optional<Frame>> poll();
  bool wait(FrameBox::Clock::time_point deadline);
  absl::StatusOr<Frame> settle(FrameBox::Clock::time_point deadline);
  bool is_result(const Frame& frame) const;
  absl::StatusOr<std::uint64_t> undo(bool redo);
  absl::StatusOr<BetterShape> take_better_shape();
  absl::StatusOr<std::string> snapshot();
  absl::StatusOr<SolveResult> solve(const SolveOptions& options);
  absl::Status take_over();
  absl::Status close();
  std::string name() const;
  void start();
  absl::Status ended() const;
  absl::Status last_problem() const;
  std::optional<Notice> notice() const;
  MeshReport mesh_report() const;
  Connection connection() const;

 private:
  using Clock = FrameBox::Clock;

  // The stream, on its thread.
  void start_stream();
  void run();
  absl::Status one_stream();
  void pump(DeformCall& call);
  bool send_one(DeformCall& call, std::unique_lock<std::mutex>& lock);
  void send_update(DeformCall& call, const NumberedUpdate& update, std::unique_lock<std::mutex>& lock);
  bool recover(const absl::Status& ended);
  bool wait_to_try_again(const Recovery& recovery, std::unique_lock<std::mutex>& lock);
  void give_up(absl::Status why);

  // On the reading thread.
  void listen(DeformCall& call);
  absl::Status take(const v1::DeformResponse& response);
  absl::Status take(const v1::StreamEvent& event);
  absl::Status take(const v1::FramePart& part);
  /// DATA_LOSS FRAME_VERTICES.
  absl::Status take(const v1::StreamOpened& opened);
  void note_answered(std::uint64_t input_seq);
  Answer judge(std::uint64_t seq, const absl::Status& status);
  absl::Status take(const v1::Fault& fault);

  // On any thread.
  absl::Status check_writer() const;
  void acknowledge(std::uint64_t frame_seq, std::uint64_t stream);
  absl::Status check_initial_positions(const SolveOptions& options) const;
  absl::StatusOr<std::optional<Frame>> take_frame(Clock::time_point deadline);
  absl::StatusOr<SolveResult> solve_patiently(const SolveOptions& options, Clock::time_point start);
  absl::StatusOr<SolveResult> solve_or_recreate(const SolveOptions& options);
  absl::StatusOr<SolveResult> solve_once(const SolveOptions& options);
  void note_answer(std::uint64_t seq, const absl::Status& status);
  absl::Status send_restore(std::unique_lock<std::mutex>& lock);
  absl::Status send_by_call(std::unique_lock<std::mutex>& lock);
  absl::Status catch_up(std::unique_lock<std::mutex>& lock);
  absl::Status send_waiting(std::unique_lock<std::mutex>& lock);
  absl::Status begin_alone(std::unique_lock<std::mutex>& lock, Clock::time_point deadline);
  void end_alone(std::unique_lock<std::mutex>& lock);
  absl::StatusOr<v1::UndoUpdateResponse> undo_patiently(const v1::UndoUpdateRequest& request,
                                                        std::unique_lock<std::mutex>& lock);
  absl::Status check_steps(const v1::UndoUpdateRequest& request, std::unique_lock<std::mutex>& lock);
  absl::Status recreate(const std::string& lost);
  absl::Status no_frame() const;

  const std::shared_ptr<Rpc> rpc_;
  const ClientOptions client_options_;
  const OpenOptions options_;
  const Copy copy_;
  std::stop_source stop_;  // ends every call that is not a stream
  FrameBox box_;

  std::mutex renewing_;  // one thread at a time creates the session again

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Lease lease_;
  Ledger ledger_;
  RecoveryRules rules_;
  std::string request_id_;     // of the next session to be created
  bool is_recreated_ = false;  // the session was created again, and all its handles were sent in one update
  bool is_closing_ = false;
  bool is_solving_ = false;
  bool is_taking_over_ = false;

  std::thread thread_;
  bool is_running_ = false;     // thread_ has work to do
  DeformCall* call_ = nullptr;  // the present stream, for cancel()
  std::uint64_t stream_ = 0;    // counts streams
  bool is_open_ = false;        // StreamOpened came
  bool is_over_ = false;        // nothing more arrives on the stream
  bool is_to_reopen_ = false;   // ended by us, to reopen with another token
  std::stop_source trying_;     // ends the uploads of the present stream, or the wait for the next stream
  std::optional<std::uint64_t> ack_due_;
  std::map<std::uint64_t, Uploads> uploads_in_use_;  // by the updates that name them
  std::vector<Uploads> uploads_done_;                // to be deleted
  std::optional<v1::GoAway> go_away_;
  std::optional<Notice> notice_;  // of the server about itself
  std::optional<Notice> better_;  // of a better shape, while it applies
  absl::Status broken_;           // why we ended the stream
  absl::Status unsent_;           // why an update could not be sent on the stream
  std::optional<FrameAssembly> assembly_;
  Clock::time_point last_heard_;
  /// After this much silence the connection counts as dead: three of the server's heartbeat intervals.
  std::chrono::milliseconds longest_silence_ = std::chrono::seconds(45);
  Clock::time_point opened_;
  std::uint64_t sent_again_ = 0;  // the last update whose uploads the server no longer had
  Clock::time_point last_open_;
  absl::Status last_problem_;
};

}  // namespace lpdeform::client
