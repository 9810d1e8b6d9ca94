// Rpc by gRPC-Web over HTTP/1.1, through the proxy that stands in front of a server.

#include "client/cpp/rpc.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cpp/grpc_web/web_calls.h"
#include "client/cpp/grpc_web/web_deform_call.h"
#include "client/cpp/grpc_web/web_inbox.h"
#include "client/cpp/grpc_web/web_origin.h"
#include "client/cpp/recovery.h"
#include "client/cpp/tls_texts.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

/// Deadline of DeleteSession. It is short, because a user may be waiting for a window to close; a session that is not
/// deleted expires.
constexpr std::chrono::milliseconds kLongestClosing{2000};
/// Deadline of a call that only finds out whether the server answers.
constexpr std::chrono::milliseconds kLongestProbe{5000};

void sleep_for(std::chrono::milliseconds pause, const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_for(lock, stop, pause, [] { return false; });
}

class WebRpc final : public Rpc {
 public:
  WebRpc(std::shared_ptr<Http> http, Caller caller, std::chrono::milliseconds call_timeout)
      : http_(std::move(http)), calls_(*http_, std::move(caller)), call_timeout_(call_timeout) {}

  std::string route() const override { return calls_.caller().route; }
  std::chrono::milliseconds call_timeout() const override { return call_timeout_; }
  std::shared_ptr<Rpc> going_by(const std::string& route) const override {
    Caller caller = calls_.caller();
    if (is_header_text(route)) caller.route = route;
    return std::make_shared<WebRpc>(http_, std::move(caller), call_timeout_);
  }
  Order order() const override { return Order::kAny; }

  absl::StatusOr<v1::CreateUploadResponse> call(const v1::CreateUploadRequest& request,
                                                const std::stop_token& stop) override {
    return unary<v1::CreateUploadResponse>("CreateUpload", request, stop);
  }
  absl::StatusOr<v1::UploadPartResponse> call(const v1::UploadPartRequest& request,
                                              const std::stop_token& stop) override {
    return unary<v1::UploadPartResponse>("UploadPart", request, stop);
  }
  absl::StatusOr<v1::DeleteUploadResponse> call(const v1::DeleteUploadRequest& request,
                                                const std::stop_token& stop) override {
    return unary<v1::DeleteUploadResponse>("DeleteUpload", request, stop);
  }
  absl::StatusOr<v1::CreateSessionResponse> call(const v1::CreateSessionRequest& request,
                                                 const std::stop_token& stop) override {
    return unary<v1::CreateSessionResponse>("CreateSession", request, stop);
  }
  absl::StatusOr<v1::GetSessionResponse> call(const v1::GetSessionRequest& request,
                                              const std::stop_token& stop) override {
    return unary<v1::GetSessionResponse>("GetSession", request, stop);
  }
  absl::StatusOr<v1::DeleteSessionResponse> call(const v1::DeleteSessionRequest& request,
                                                 const std::stop_token& stop) override {
    return unary<v1::DeleteSessionResponse>("DeleteSession", request, stop,
                                            std::min(call_timeout_, kLongestClosing));
  }
  absl::StatusOr<v1::AcquireWriterResponse> call(const v1::AcquireWriterRequest& request,
                                                 const std::stop_token& stop) override {
    return unary<v1::AcquireWriterResponse>("AcquireWriter", request, stop);
  }
  absl::StatusOr<v1::UpdateHandlesResponse> call(const v1::UpdateHandlesRequest& request,
                                                 const std::stop_token& stop) override {
    return unary<v1::UpdateHandlesResponse>("UpdateHandles", request, stop);
  }
  absl::StatusOr<v1::RestoreSessionResponse> call(const v1::RestoreSessionRequest& request,
                                                  const std::stop_token& stop) override {
    return unary<v1::RestoreSessionResponse>("RestoreSession", request, stop);
  }
  absl::StatusOr<v1::UndoUpdateResponse> call(const v1::UndoUpdateRequest& request,
                                              const std::stop_token& stop) override {
    return unary<v1::UndoUpdateResponse>("UndoUpdate", request, stop);
  }
  absl::StatusOr<v1::TakeBetterShapeResponse> call(const v1::TakeBetterShapeRequest& request,
                                                   const std::stop_token& stop) override {
    return unary<v1::TakeBetterShapeResponse>("TakeBetterShape", request, stop);
  }

  absl::Status snapshot(
      const v1::SnapshotSessionRequest& request, const std::stop_token& stop,
      const std::function<absl::Status(const v1::SnapshotSessionResponse&)>& on_response) override {
    return streaming("SnapshotSession", request, call_timeout_, stop, on_response);
  }

  absl::Status solve(const v1::SolveRequest& request, double deadline_seconds, const std::stop_token& stop,
                     const std::function<absl::Status(const v1::SolveResponse&)>& on_response) override {
    const std::chrono::milliseconds limit(
        std::llround(std::ceil(std::min(deadline_seconds, kMostSeconds) * 1000)));
    return streaming("Solve", request, limit, stop, on_response);
  }

  std::unique_ptr<DeformCall> deform() override {
    return deform_by_web(http_, calls_.caller(), call_timeout_);
  }

  /// HTTP has connections only while there are requests: this asks until the server answers.
  Connected wait_for_connection(std::chrono::milliseconds longest, const std::stop_token& stop) override {
    const auto end = std::chrono::steady_clock::now() + longest;
    Backoff backoff;
    for (Connected found = Connected::kWas;; found = Connected::kCame) {
      if (probe(stop).ok()) return found;
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
      if (left.count() <= 0 || stop.stop_requested()) return Connected::kIsNot;
      sleep_for(std::min(left, backoff.next()), stop);
    }
  }

  /// OK if the server answers anything. A proxy's own errors have no reason.
  absl::Status probe(const std::stop_token& stop, std::chrono::milliseconds longest = kLongestProbe) const {
    const absl::Status status = calls_.wait("GetSession", v1::GetSessionRequest(), longest, stop).status();
    return fault_of(status).reason.empty() ? status : absl::OkStatus();
  }

 private:
  /// Longer deadlines are as good as none, and would overflow a clock.
  static constexpr double kMostSeconds = 24 * 60 * 60;

  template <typename Response, typename Request>
  absl::StatusOr<Response> unary(const char* method, const Request& request, const std::stop_token& stop,
                                 std::optional<std::chrono::milliseconds> longest = {}) {
    const auto message = calls_.wait(method, request, longest.value_or(call_timeout_), stop);
    if (!message.ok()) return message.status();
    Response response;
    if (!response.ParseFromString(*message)) return absl::InternalError("The answer cannot be read.");
    return response;
  }

  template <typename Response, typename Request>
  absl::Status streaming(const char* method, const Request& request, std::chrono::milliseconds limit,
                         const std::stop_token& stop,
                         const std::function<absl::Status(const Response&)>& on_response) {
    const auto inbox = std::make_shared<Inbox<std::string>>();
    const std::shared_ptr<HttpCall> call =
        calls_.start(method, request, limit,
                     {.has_room = [inbox] { return inbox->has_room(); },
                      .message =
                          [inbox](std::string message) {
                            const std::size_t bytes = message.size();
                            inbox->put(std::move(message), bytes);
                          },
                      .end = [inbox](const absl::Status& status) { inbox->end(status); }});
    const std::stop_callback cancel(stop, [&call] { call->cancel(); });
    absl::Status taken;
    Response response;
    while (const std::optional<std::string> message = inbox->take([&call] { call->resume(); })) {
      if (!response.ParseFromString(*message)) taken = absl::InternalError("A message cannot be read.");
      if (taken.ok()) taken = on_response(response);
      if (!taken.ok()) break;
    }
    if (!taken.ok()) call->cancel();
    return taken.ok() ? inbox->status() : taken;
  }

  const std::shared_ptr<Http> http_;
  const Calls calls_;
  const std::chrono::milliseconds call_timeout_;
};

}  // namespace

absl::StatusOr<std::shared_ptr<Rpc>> Rpc::connect(const std::string& address, const ClientOptions& options,
                                                  const std::stop_token& stop) {
  absl::StatusOr<Origin> origin = origin_of(address, options.tls.has_value());
  if (!origin.ok()) return origin.status();
  if (options.tls) {
    if (absl::Status checked = check_tls(*options.tls); !checked.ok()) return checked;
  }
  const auto http = Http::make(origin->url, origin->socket, options.tls);
  auto rpc = std::make_shared<WebRpc>(http, Caller{options.token}, options.call_timeout);
  const absl::Status answered =
      rpc->probe(stop, std::max(options.connect_timeout, std::chrono::milliseconds(1)));
  if (answered.ok()) return rpc;
  if (stop.stop_requested()) return absl::CancelledError("Connecting was stopped.");
  return make_fault({Reason::kNoServer, address, ""},
                    absl::StrCat("No server answers at \"", address, "\": ", answered.message()));
}

}  // namespace lpdeform::client
