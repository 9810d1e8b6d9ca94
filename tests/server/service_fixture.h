#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bar.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "lpdeform/v1/service.grpc.pb.h"
#include "manual_timers.h"
#include "server/server.h"

namespace lpdeform {

// What tests of the running service share: an in-process server, a client of plain stubs, and messages made
// short.

/// Calls of tests that hang end after this.
inline constexpr std::chrono::seconds kTestDeadline{120};

std::string packed(const Points& points);
std::string packed(const Faces& faces);
std::string packed(const std::vector<std::int32_t>& indices);

v1::Mesh mesh_message(const TriangleMesh& mesh);
void set_handle(v1::Update& update, const std::string& name, const std::vector<std::int32_t>& vertices,
                double x);
void move_handle(v1::Update& update, const std::string& name, double x);
/// Holds the bottom where it is and shifts the top by x.
v1::Update ends_message(const Points& points, std::uint64_t input_seq, double x);
v1::Update tip_message(std::uint64_t input_seq, double x);
/// A solver that takes long: descent by gradients to a tolerance out of reach.
void solve_slowly(v1::Update& update);

/// The details that an error carries.
struct ErrorDetails {
  google::rpc::ErrorInfo info;
  std::optional<google::rpc::BadRequest> bad_request;
  std::optional<google::rpc::RetryInfo> retry;
  std::optional<google::rpc::QuotaFailure> quota;
  std::optional<google::rpc::ResourceInfo> resource;
};
ErrorDetails details_of(const grpc::Status& status);

/// A frame put together from its parts, each of which has to follow the one before.
struct ReceivedFrame {
  v1::FrameHeader header;
  std::string positions;
  std::string distortion;
  std::string normals;
  int parts = 0;

  template <typename Number>
  Number position(std::size_t vertex, std::size_t axis) const {
    Number number;
    std::memcpy(&number, positions.data() + (3 * vertex + axis) * sizeof(Number), sizeof(Number));
    return number;
  }
};

class FrameAssembler {
 public:
  /// The frame, once it is whole.
  std::optional<ReceivedFrame> add(const v1::FramePart& part);

 private:
  ReceivedFrame frame_;
  std::uint32_t vertices_ = 0;
};

/// Everything that came on a stream, in order.
struct History {
  std::vector<v1::FrameHeader> frames;
  std::vector<v1::Fault> faults;
  std::vector<v1::UpdateResult> results;
  std::vector<v1::GoAway> ends;
  int opened = 0, heartbeats = 0;
  int after_end = 0;          // messages after the go-away
  std::size_t in_flight = 0;  // frames begun and not acknowledged
  std::size_t most_in_flight = 0;
  std::optional<grpc::Status> status;  // once it was read to its end
};

/// Invariants 1, 2, 4, 6 and 8 of the service, for the history of one stream with this credit.
void expect_invariants(const History& history, std::size_t credit);

/// A Deform stream as a client has it.
class DeformClient {
 public:
  DeformClient(v1::DeformService::Stub& stub, const v1::CreateSessionResponse& session,
               v1::FrameOptions options = {}, bool is_writer = true);
  /// Cancels.
  ~DeformClient();

  bool send(const v1::Update& update);
  bool acknowledge(std::uint64_t frame_seq);
  bool write(const v1::DeformRequest& request) { return stream_->Write(request); }
  void close_input() { stream_->WritesDone(); }

  /// The next message; empty when the stream is over.
  std::optional<v1::DeformResponse> read();
  /// The next whole frame, acknowledged where asked for; other messages go into the history.
  std::optional<ReceivedFrame> next_frame(bool acknowledges = true);
  /// Frames until a final one for this input or a later one.
  std::optional<ReceivedFrame> settle(std::uint64_t input_seq);
  /// All that comes until the end, then the status. Again: the status.
  grpc::Status read_to_end();

  grpc::ClientContext& context() { return context_; }
  History history;

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::DeformRequest, v1::DeformResponse>> stream_;
  FrameAssembler assembler_;
};

/// What a Solve call brought.
struct SolveOutcome {
  grpc::Status status;
  std::vector<v1::SolveProgress> progress;
  v1::SolveSummary summary;
  std::vector<v1::IterationRecord> trace;
  std::optional<ReceivedFrame> frame;
  std::vector<char> order;  // p, s, t, f as they came
};

class ServiceTest : public testing::Test {
 protected:
  /// Starts the server; before it, options_ may be changed.
  void start();
  void SetUp() override { start(); }

  v1::CreateSessionResponse create(const TriangleMesh& mesh);
  grpc::Status try_create(const v1::CreateSessionRequest& request, v1::CreateSessionResponse& response);
  std::string upload(std::string_view bytes);
  grpc::Status update(const v1::CreateSessionResponse& session, const v1::Update& update);
  SolveOutcome solve(const v1::SolveRequest& request, grpc::ClientContext* context = nullptr);
  v1::SolveRequest solve_request(const v1::CreateSessionResponse& session) const;

  /// A channel of its own.
  std::unique_ptr<v1::DeformService::Stub> connect() const;

  ServerOptions options_;
  std::shared_ptr<ManualTimers> timers_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<v1::DeformService::Stub> stub_;
};

}  // namespace lpdeform
