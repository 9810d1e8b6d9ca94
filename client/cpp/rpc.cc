#include "client/cpp/rpc.h"

#include <grpc/grpc.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cpp/address.h"
#include "client/cpp/caller.h"
#include "client/cpp/status_details.h"
#include "client/cpp/tls_texts.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "lpdeform/v1/service.grpc.pb.h"

namespace lpdeform::client {

namespace {

using Stub = v1::DeformService::Stub;

constexpr int kFirstReconnectMs = 50;
constexpr int kLongestReconnectMs = 2000;
/// Time limit of one connection attempt, including the first exchange of messages. It is long enough for a busy server.
constexpr int kAttemptMs = 5000;
/// Flow-control window of a stream: one part of a frame. A larger one would only buffer frames that the server's credit
/// does not count.
constexpr int kStreamWindowBytes = 1 << 20;
/// Keepalive also enables TCP's time limit for unacknowledged bytes, so that a write never waits on a dead connection.
/// Pings are rare enough for every server.
constexpr int kKeepaliveMs = 6 * 60 * 1000;
constexpr int kUnacknowledgedMs = 20 * 1000;
/// How often a wait for a connection checks for a request to stop.
constexpr std::chrono::milliseconds kGlance{50};
/// Deadline of DeleteSession. It is short, because a user may be waiting for a window to close; a session that is not
/// deleted expires.
constexpr std::chrono::milliseconds kLongestClosing{2000};

grpc::ChannelArguments channel_arguments() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // clients do not share one connection
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, kStreamWindowBytes);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstReconnectMs);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS,
                   kAttemptMs);  // despite its name, an attempt's time limit
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLongestReconnectMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kUnacknowledgedMs);
  return arguments;
}

/// Keeps gRPC initialised until the process ends. Otherwise gRPC shuts down with its last channel, which can take 10 s:
/// it waits for its own poller, which nothing wakes.
void keep_grpc() {
  static std::once_flag once;
  std::call_once(once, grpc_init);
}

absl::Status status_of(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return with_details(static_cast<absl::StatusCode>(status.error_code()), status.error_message(),
                      status.error_details());
}

/// False as soon as every address has refused: waiting longer would only delay the error.
bool answers(grpc::Channel& channel, std::chrono::system_clock::time_point deadline,
             const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const grpc_connectivity_state state = channel.GetState(true);
    if (state == GRPC_CHANNEL_READY) return true;
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE || state == GRPC_CHANNEL_SHUTDOWN) return false;
    const auto now = std::chrono::system_clock::now();
    if (now >= deadline) return false;
    channel.WaitForStateChange(state, std::min(deadline, now + kGlance));
  }
  return false;
}

/// Why there is no connection; empty if gRPC does not know yet. gRPC reports this only through a call.
std::string problem_of(const std::shared_ptr<grpc::Channel>& channel) {
  if (channel->GetState(false) != GRPC_CHANNEL_TRANSIENT_FAILURE) return "";
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kGlance);
  v1::GetSessionResponse none;
  const grpc::Status status =
      v1::DeformService::NewStub(channel)->GetSession(&context, v1::GetSessionRequest(), &none);
  return status.error_code() == grpc::StatusCode::UNAVAILABLE ? status.error_message() : "";
}

absl::Status no_server(const std::string& address, const std::string& problem) {
  return make_fault({Reason::kNoServer, address, ""}, absl::StrCat("No server answers at \"", address, "\"",
                                                                   problem.empty() ? "." : ": ", problem));
}

void introduce(const Caller& caller, grpc::ClientContext& context) {
  for (const auto& [name, value] : headers_of(caller)) context.AddMetadata(name, value);
}

std::shared_ptr<grpc::ChannelCredentials> credentials_of(const std::optional<Tls>& tls) {
  if (!tls) return grpc::InsecureChannelCredentials();
  return grpc::SslCredentials({tls->root_certificates, tls->private_key, tls->certificate_chain});
}

class GrpcDeformCall final : public DeformCall {
 public:
  GrpcDeformCall(Stub& stub, const Caller& caller) {
    introduce(caller, context_);
    stream_ = stub.Deform(&context_);
  }

  bool write(const v1::DeformRequest& request) override { return stream_->Write(request); }
  bool read(v1::DeformResponse& response) override { return stream_->Read(&response); }
  void cancel() override { context_.TryCancel(); }
  absl::Status finish() override { return status_of(stream_->Finish()); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::DeformRequest, v1::DeformResponse>> stream_;
};

class GrpcRpc final : public Rpc {
 public:
  GrpcRpc(const std::shared_ptr<grpc::Channel>& channel, const ClientOptions& options)
      : channel_(channel),
        stub_(v1::DeformService::NewStub(channel)),
        call_timeout_(options.call_timeout),
        caller_{options.token} {}
  GrpcRpc(const GrpcRpc& other, const std::string& route)
      : channel_(other.channel_),
        stub_(v1::DeformService::NewStub(other.channel_)),
        call_timeout_(other.call_timeout_),
        caller_{other.caller_.token, route} {}

  std::string route() const override { return caller_.route; }
  std::chrono::milliseconds call_timeout() const override { return call_timeout_; }
  std::shared_ptr<Rpc> going_by(const std::string& route) const override {
    return std::make_shared<GrpcRpc>(*this, is_header_text(route) ? route : caller_.route);
  }

  absl::StatusOr<v1::CreateUploadResponse> call(const v1::CreateUploadRequest& request,
                                                const std::stop_token& stop) override {
    return unary(&Stub::CreateUpload, request, stop);
  }
  absl::StatusOr<v1::UploadPartResponse> call(const v1::UploadPartRequest& request,
                                              const std::stop_token& stop) override {
    return unary(&Stub::UploadPart, request, stop);
  }
  absl::StatusOr<v1::DeleteUploadResponse> call(const v1::DeleteUploadRequest& request,
                                                const std::stop_token& stop) override {
    return unary(&Stub::DeleteUpload, request, stop);
  }
  absl::StatusOr<v1::CreateSessionResponse> call(const v1::CreateSessionRequest& request,
                                                 const std::stop_token& stop) override {
    return unary(&Stub::CreateSession, request, stop);
  }
  absl::StatusOr<v1::GetSessionResponse> call(const v1::GetSessionRequest& request,
                                              const std::stop_token& stop) override {
    return unary(&Stub::GetSession, request, stop);
  }
  absl::StatusOr<v1::DeleteSessionResponse> call(const v1::DeleteSessionRequest& request,
                                                 const std::stop_token& stop) override {
    return unary(&Stub::DeleteSession, request, stop, std::min(call_timeout_, kLongestClosing));
  }
  absl::StatusOr<v1::AcquireWriterResponse> call(const v1::AcquireWriterRequest& request,
                                                 const std::stop_token& stop) override {
    return unary(&Stub::AcquireWriter, request, stop);
  }
  absl::StatusOr<v1::UpdateHandlesResponse> call(const v1::UpdateHandlesRequest& request,
                                                 const std::stop_token& stop) override {
    return unary(&Stub::UpdateHandles, request, stop);
  }

  absl::StatusOr<v1::RestoreSessionResponse> call(const v1::RestoreSessionRequest& request,
                                                  const std::stop_token& stop) override {
    return unary(&Stub::RestoreSession, request, stop);
  }
  absl::StatusOr<v1::UndoUpdateResponse> call(const v1::UndoUpdateRequest& request,
                                              const std::stop_token& stop) override {
    return unary(&Stub::UndoUpdate, request, stop);
  }
  absl::StatusOr<v1::TakeBetterShapeResponse> call(const v1::TakeBetterShapeRequest& request,
                                                   const std::stop_token& stop) override {
    return unary(&Stub::TakeBetterShape, request, stop);
  }

  absl::Status snapshot(
      const v1::SnapshotSessionRequest& request, const std::stop_token& stop,
      const std::function<absl::Status(const v1::SnapshotSessionResponse&)>& on_response) override {
    return streaming<v1::SnapshotSessionResponse>(&Stub::SnapshotSession, request,
                                                  std::chrono::duration<double>(call_timeout_).count(), stop,
                                                  on_response);
  }

  absl::Status solve(const v1::SolveRequest& request, double deadline_seconds, const std::stop_token& stop,
                     const std::function<absl::Status(const v1::SolveResponse&)>& on_response) override {
    return streaming<v1::SolveResponse>(&Stub::Solve, request, deadline_seconds, stop, on_response);
  }

  std::unique_ptr<DeformCall> deform() override { return std::make_unique<GrpcDeformCall>(*stub_, caller_); }

  Connected wait_for_connection(std::chrono::milliseconds longest, const std::stop_token& stop) override {
    const auto end = std::chrono::system_clock::now() + longest;
    for (bool has_waited = false;; has_waited = true) {
      const grpc_connectivity_state state = channel_->GetState(true);
      if (state == GRPC_CHANNEL_READY) return has_waited ? Connected::kCame : Connected::kWas;
      const auto now = std::chrono::system_clock::now();
      if (now >= end || stop.stop_requested()) return Connected::kIsNot;
      channel_->WaitForStateChange(state, std::min(end, now + kGlance));
    }
  }

 private:
  template <typename Request, typename Response>
  absl::StatusOr<Response> unary(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                              Response*),
                                 const Request& request, const std::stop_token& stop,
                                 std::optional<std::chrono::milliseconds> longest = {}) {
    grpc::ClientContext context;
    introduce(caller_, context);
    context.set_deadline(std::chrono::system_clock::now() + longest.value_or(call_timeout_));
    const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
    Response response;
    const grpc::Status status = ((*stub_).*method)(&context, request, &response);
    if (!status.ok()) return status_of(status);
    return response;
  }

  /// `deadline_seconds` 0 is without limit.
  template <typename Response, typename Request>
  absl::Status streaming(std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(grpc::ClientContext*,
                                                                                       const Request&),
                         const Request& request, double deadline_seconds, const std::stop_token& stop,
                         const std::function<absl::Status(const Response&)>& on_response) {
    grpc::ClientContext context;
    introduce(caller_, context);
    if (deadline_seconds > 0) {
      const auto limit = std::chrono::duration<double>(deadline_seconds);
      context.set_deadline(std::chrono::system_clock::now() +
                           std::chrono::duration_cast<std::chrono::system_clock::duration>(limit));
    }
    const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
    const auto reader = ((*stub_).*method)(&context, request);
    absl::Status taken;
    Response response;
    while (taken.ok() && reader->Read(&response)) taken = on_response(response);
    if (!taken.ok()) context.TryCancel();
    const grpc::Status ended = reader->Finish();
    return taken.ok() ? status_of(ended) : taken;
  }

  const std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<Stub> stub_;
  const std::chrono::milliseconds call_timeout_;
  const Caller caller_;
};

}  // namespace

absl::StatusOr<std::shared_ptr<Rpc>> Rpc::connect(const std::string& address, const ClientOptions& options,
                                                  const std::stop_token& stop) {
  absl::Status checked = check_address(address);
  if (checked.ok() && options.tls) checked = check_tls(*options.tls);
  if (!checked.ok()) return checked;
  keep_grpc();
  const auto channel = grpc::CreateCustomChannel(address, credentials_of(options.tls), channel_arguments());
  if (answers(*channel, std::chrono::system_clock::now() + options.connect_timeout, stop)) {
    return std::make_shared<GrpcRpc>(channel, options);
  }
  if (stop.stop_requested()) return absl::CancelledError("Connecting was stopped.");
  return no_server(address, problem_of(channel));
}

}  // namespace lpdeform::client
