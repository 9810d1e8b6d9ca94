#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// How long a test waits for an event that must come. Never reached if all is well.
constexpr std::chrono::seconds kPatience{20};

/// Both ends of a Deform call: the client's behind FakeCall, the server's controlled by the test.
class Stream {
 public:
  // The server's end.

  void say(v1::DeformResponse response) {
    const std::scoped_lock lock(mutex_);
    to_client_.push_back(std::move(response));
    changed_.notify_all();
  }

  /// Ends the call once the client has read all.
  void end(absl::Status status) {
    const std::scoped_lock lock(mutex_);
    if (!end_) end_ = std::move(status);
    changed_.notify_all();
  }

  /// The client's read throws, once.
  void throw_once() {
    const std::scoped_lock lock(mutex_);
    is_to_throw_ = true;
    changed_.notify_all();
  }

  /// The client's next message; empty if none comes.
  std::optional<v1::DeformRequest> hear() {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [this] { return !to_server_.empty(); })) return std::nullopt;
    v1::DeformRequest request = std::move(to_server_.front());
    to_server_.pop_front();
    return request;
  }

  /// How many messages of the client were not heard yet.
  std::size_t unheard() {
    const std::scoped_lock lock(mutex_);
    return to_server_.size();
  }

  // The client's end.

  bool write(const v1::DeformRequest& request) {
    const std::scoped_lock lock(mutex_);
    if (end_) return false;
    to_server_.push_back(request);
    changed_.notify_all();
    return true;
  }

  bool read(v1::DeformResponse& response) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !to_client_.empty() || end_ || is_to_throw_; });
    if (std::exchange(is_to_throw_, false)) throw std::runtime_error("no message");
    if (to_client_.empty()) return false;
    response = std::move(to_client_.front());
    to_client_.pop_front();
    return true;
  }

  absl::Status status() {
    const std::scoped_lock lock(mutex_);
    return end_.value_or(absl::OkStatus());
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<v1::DeformResponse> to_client_;
  std::deque<v1::DeformRequest> to_server_;
  std::optional<absl::Status> end_;
  bool is_to_throw_ = false;
};

class FakeCall final : public DeformCall {
 public:
  explicit FakeCall(std::shared_ptr<Stream> stream) : stream_(std::move(stream)) {}
  bool write(const v1::DeformRequest& request) override { return stream_->write(request); }
  bool read(v1::DeformResponse& response) override { return stream_->read(response); }
  void cancel() override { stream_->end(absl::CancelledError("cancelled")); }
  absl::Status finish() override { return stream_->status(); }

 private:
  std::shared_ptr<Stream> stream_;
};

/// A server without a network: sessions are only names, every unary call succeeds, and the test controls the streams.
class FakeRpc final : public Rpc {
 public:
  explicit FakeRpc(std::uint32_t vertex_count) : vertex_count_(vertex_count) {}

  std::string route() const override { return "a way of its own"; }
  std::shared_ptr<Rpc> going_by(const std::string&) const override { return nullptr; }  // there is one server

  std::chrono::milliseconds call_timeout() const override { return longest_call; }

  /// The next stream that the client opens; null if it opens none.
  std::shared_ptr<Stream> next_stream() {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [this] { return !streams_.empty(); })) return nullptr;
    auto stream = std::move(streams_.front());
    streams_.pop_front();
    return stream;
  }

  std::vector<v1::CreateSessionRequest> created() {
    const std::scoped_lock lock(mutex_);
    return created_;
  }
  std::vector<std::string> deleted() {
    const std::scoped_lock lock(mutex_);
    return deleted_;
  }
  std::vector<v1::SolveRequest> solved() {
    const std::scoped_lock lock(mutex_);
    return solved_;
  }
  /// In seconds, of each Solve call.
  std::vector<double> solve_deadlines() {
    const std::scoped_lock lock(mutex_);
    return solve_deadlines_;
  }
  std::vector<v1::UpdateHandlesRequest> restored() {
    const std::scoped_lock lock(mutex_);
    return restored_;
  }

  /// The uploads deleted, once there are `count` of them.
  std::vector<std::string> uploads_deleted(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kPatience, [&] { return uploads_deleted_.size() >= count; });
    return uploads_deleted_;
  }

  /// The offset of each part that came, including refused ones.
  std::vector<std::uint64_t> parts() {
    const std::scoped_lock lock(mutex_);
    return parts_;
  }

  std::chrono::milliseconds longest_call = std::chrono::seconds(30);
  /// There is no connection while anyone waits for one.
  bool is_unreachable = false;
  /// The results of CreateUpload and UploadPart calls, in turn; OK once they are used up.
  std::deque<absl::Status> upload_ends;
  std::deque<absl::Status> part_ends;
  /// The errors of CreateSession calls, in turn; the calls succeed once they are used up.
  std::deque<absl::Status> create_ends;
  /// The results of Solve calls, in turn; OK once they are used up.
  std::deque<absl::Status> solve_ends;
  /// The newest input_seq in the results of Solve calls, in turn; the true one once they are used up.
  std::deque<std::uint64_t> solve_inputs;
  /// Whether opening a stream throws.
  bool deform_throws = false;

  absl::StatusOr<v1::CreateUploadResponse> call(const v1::CreateUploadRequest& request,
                                                const std::stop_token&) override {
    const std::scoped_lock lock(mutex_);
    if (const absl::Status end = next_of(upload_ends); !end.ok()) return end;
    upload_bytes_left_ = request.size_bytes();
    v1::CreateUploadResponse response;
    response.set_upload("uploads/" + request.request_id());
    response.set_max_part_bytes(1 << 20);
    return response;
  }

  absl::StatusOr<v1::UploadPartResponse> call(const v1::UploadPartRequest& request,
                                              const std::stop_token&) override {
    const std::scoped_lock lock(mutex_);
    parts_.push_back(request.offset());
    if (const absl::Status end = next_of(part_ends); !end.ok()) return end;
    upload_bytes_left_ -= request.data().size();
    v1::UploadPartResponse response;
    response.set_finished(upload_bytes_left_ == 0);
    return response;
  }

  absl::StatusOr<v1::DeleteUploadResponse> call(const v1::DeleteUploadRequest& request,
                                                const std::stop_token&) override {
    const std::scoped_lock lock(mutex_);
    uploads_deleted_.push_back(request.upload());
    changed_.notify_all();
    return v1::DeleteUploadResponse();
  }

  absl::StatusOr<v1::CreateSessionResponse> call(const v1::CreateSessionRequest& request,
                                                 const std::stop_token&) override {
    const std::scoped_lock lock(mutex_);
    created_.push_back(request);
    if (!create_ends.empty()) {
      absl::Status end = std::move(create_ends.front());
      create_ends.pop_front();
      return end;
    }
    v1::CreateSessionResponse response;
    response.mutable_session()->set_name("sessions/" + std::to_string(created_.size()));
    response.mutable_session()->set_epoch(1);
    response.mutable_session()->mutable_mesh()->set_vertices(vertex_count_);
    response.set_writer_token("token");
    return response;
  }

  absl::StatusOr<v1::GetSessionResponse> call(const v1::GetSessionRequest& request,
                                              const std::stop_token&) override {
    v1::GetSessionResponse response;
    response.mutable_session()->set_name(request.session());
    response.mutable_session()->mutable_mesh()->set_vertices(vertex_count_);
    const std::scoped_lock lock(mutex_);
    response.mutable_session()->set_undo_steps(undo_steps);
    return response;
  }

  absl::StatusOr<v1::DeleteSessionResponse> call(const v1::DeleteSessionRequest& request,
                                                 const std::stop_token&) override {
    const std::scoped_lock lock(mutex_);
    deleted_.push_back(request.session());
    return v1::DeleteSessionResponse();
  }

  absl::StatusOr<v1::AcquireWriterResponse> call(const v1::AcquireWriterRequest&,
                                                 const std::stop_token&) override {
    v1::AcquireWriterResponse response;
    response.set_writer_token("another token");
    response.set_epoch(2);
    response.set_input_seq(100);
    return response;
  }

  absl::StatusOr<v1::UpdateHandlesResponse> call(const v1::UpdateHandlesRequest& request,
                                                 const std::stop_token&) override {
    const std::scoped_lock lock(mutex_);
    restored_.push_back(request);
    return v1::UpdateHandlesResponse();
  }

  absl::StatusOr<v1::RestoreSessionResponse> call(const v1::RestoreSessionRequest&,
                                                  const std::stop_token&) override {
    return absl::UnimplementedError("restore");
  }

  /// Answers with what the test put into undo_changes.
  absl::StatusOr<v1::UndoUpdateResponse> call(const v1::UndoUpdateRequest& request,
                                              const std::stop_token&) override {
    const std::scoped_lock lock(mutex_);
    const bool is_again = !undone_.empty() && undone_.back().input_seq() == request.input_seq();
    if (!is_again && !request.redo() && undo_steps > 0) --undo_steps;
    undone_.push_back(request);
    if (undone_.size() <= undos_away) return absl::UnavailableError("away");
    v1::UndoUpdateResponse response;
    response.mutable_result()->set_input_seq(request.input_seq());
    for (const v1::HandleUpdate& change : undo_changes) *response.add_changes() = change;
    return response;
  }

  /// Answers with what the test put into better_shape.
  absl::StatusOr<v1::TakeBetterShapeResponse> call(const v1::TakeBetterShapeRequest& request,
                                                   const std::stop_token&) override {
    const std::scoped_lock lock(mutex_);
    taken_better_.push_back(request);
    return better_shape;
  }
  absl::StatusOr<v1::TakeBetterShapeResponse> better_shape = v1::TakeBetterShapeResponse();
  std::vector<v1::TakeBetterShapeRequest> taken_better() {
    const std::scoped_lock lock(mutex_);
    return taken_better_;
  }

  std::vector<v1::HandleUpdate> undo_changes;
  std::size_t undos_away = 0;    // how many undos are carried out without an answer first
  std::uint32_t undo_steps = 0;  // as GetSession reports; an undo reduces it
  std::vector<v1::UndoUpdateRequest> undone() {
    const std::scoped_lock lock(mutex_);
    return undone_;
  }

  absl::Status snapshot(const v1::SnapshotSessionRequest&, const std::stop_token&,
                        const std::function<absl::Status(const v1::SnapshotSessionResponse&)>&) override {
    return absl::UnimplementedError("snapshot");
  }

  absl::Status solve(const v1::SolveRequest& request, double deadline_seconds, const std::stop_token&,
                     const std::function<absl::Status(const v1::SolveResponse&)>& on_response) override {
    {
      const std::scoped_lock lock(mutex_);
      solved_.push_back(request);
      solve_deadlines_.push_back(deadline_seconds);
      if (!solve_ends.empty()) {
        absl::Status end = std::move(solve_ends.front());
        solve_ends.pop_front();
        if (!end.ok()) return end;
      }
    }
    v1::SolveResponse summary;
    {
      const std::scoped_lock lock(mutex_);
      summary.mutable_summary()->set_input_seq(solve_inputs.empty() ? kNewest : solve_inputs.front());
      if (!solve_inputs.empty()) solve_inputs.pop_front();
    }
    summary.mutable_summary()->set_stop_reason(v1::STOP_REASON_CONVERGED);
    absl::Status taken = on_response(summary);
    v1::SolveResponse frame;
    frame.mutable_frame()->mutable_header()->set_vertex_count(vertex_count_);
    frame.mutable_frame()->set_vertex_count(vertex_count_);
    frame.mutable_frame()->set_positions(std::string(vertex_count_ * 12, '\0'));
    frame.mutable_frame()->set_last(true);
    taken.Update(on_response(frame));
    return taken;
  }

  Connected wait_for_connection(std::chrono::milliseconds longest, const std::stop_token& stop) override {
    if (!is_unreachable) return Connected::kWas;
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait_for(lock, stop, longest, [] { return false; });
    return Connected::kIsNot;
  }

  std::unique_ptr<DeformCall> deform() override {
    if (deform_throws) throw std::runtime_error("no stream");
    const std::scoped_lock lock(mutex_);
    streams_.push_back(std::make_shared<Stream>());
    changed_.notify_all();
    return std::make_unique<FakeCall>(streams_.back());
  }

 private:
  static constexpr std::uint64_t kNewest = 1'000'000;
  static absl::Status next_of(std::deque<absl::Status>& ends) {
    if (ends.empty()) return absl::OkStatus();
    absl::Status end = std::move(ends.front());
    ends.pop_front();
    return end;
  }

  const std::uint32_t vertex_count_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Stream>> streams_;
  std::vector<v1::CreateSessionRequest> created_;
  std::vector<std::string> deleted_;
  std::vector<std::string> uploads_deleted_;
  std::vector<v1::SolveRequest> solved_;
  std::vector<double> solve_deadlines_;
  std::vector<v1::UpdateHandlesRequest> restored_;
  std::vector<v1::UndoUpdateRequest> undone_;
  std::vector<v1::TakeBetterShapeRequest> taken_better_;
  std::size_t upload_bytes_left_ = 0;
  std::vector<std::uint64_t> parts_;
};

}  // namespace lpdeform::client
