#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cpp/client.h"
#include "client/cpp/ledger.h"
#include "lpdeform/v1/service.pb.h"

namespace lpdeform::client {

/// One Deform call. Call read() on one thread and write() on one other thread; cancel() on any thread, any number of
/// times.
class DeformCall {
 public:
  virtual ~DeformCall() = default;
  /// Waits until gRPC has accepted the message. False when the call has ended.
  virtual bool write(const v1::DeformRequest& request) = 0;
  /// Waits for a message. False when the call has ended.
  virtual bool read(v1::DeformResponse& response) = 0;
  virtual void cancel() = 0;
  /// The final status of the call. Call it once, when no thread reads or writes any more.
  virtual absl::Status finish() = 0;
};

/// The server's calls over one channel; hides what carries them: gRPC (rpc.cc) or gRPC-Web (grpc_web/web_rpc.cc), of which one is
/// linked. Thread-safe. Each call waits, unless its comment says otherwise for
/// at most the call timeout (DeleteSession: two seconds), and ends with CANCELLED when `stop` is requested.
class Rpc {
 public:
  /// `address` as in Client::connect. Waits until the server answers or the address refuses:
  /// UNAVAILABLE (NO_SERVER). INVALID_ARGUMENT as check_tls().
  static absl::StatusOr<std::shared_ptr<Rpc>> connect(const std::string& address,
                                                      const ClientOptions& options,
                                                      const std::stop_token& stop);
  virtual ~Rpc() = default;

  /// The value of the header lpdeform-session, which every call has. A proxy in front of several servers sends all
  /// calls with the same value to the same server.
  virtual std::string route() const = 0;
  /// The default deadline of a call.
  virtual std::chrono::milliseconds call_timeout() const = 0;
  /// The same channel with another route.
  virtual std::shared_ptr<Rpc> going_by(const std::string& route) const = 0;

  virtual absl::StatusOr<v1::CreateUploadResponse> call(const v1::CreateUploadRequest& request,
                                                        const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::UploadPartResponse> call(const v1::UploadPartRequest& request,
                                                      const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::DeleteUploadResponse> call(const v1::DeleteUploadRequest& request,
                                                        const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::CreateSessionResponse> call(const v1::CreateSessionRequest& request,
                                                         const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::GetSessionResponse> call(const v1::GetSessionRequest& request,
                                                      const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::DeleteSessionResponse> call(const v1::DeleteSessionRequest& request,
                                                         const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::AcquireWriterResponse> call(const v1::AcquireWriterRequest& request,
                                                         const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::UpdateHandlesResponse> call(const v1::UpdateHandlesRequest& request,
                                                         const std::stop_token& stop) = 0;

  virtual absl::StatusOr<v1::RestoreSessionResponse> call(const v1::RestoreSessionRequest& request,
                                                          const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::UndoUpdateResponse> call(const v1::UndoUpdateRequest& request,
                                                      const std::stop_token& stop) = 0;
  virtual absl::StatusOr<v1::TakeBetterShapeResponse> call(const v1::TakeBetterShapeRequest& request,
                                                           const std::stop_token& stop) = 0;

  /// Calls `on_response` for each message, on this thread; an error of it ends the call and is returned.
  virtual absl::Status snapshot(
      const v1::SnapshotSessionRequest& request, const std::stop_token& stop,
      const std::function<absl::Status(const v1::SnapshotSessionResponse&)>& on_response) = 0;

  /// Calls `on_response` for each message, on this thread; an error of it ends the call and is returned.
  /// `deadline_seconds` 0 is without limit.
  virtual absl::Status solve(const v1::SolveRequest& request, double deadline_seconds,
                             const std::stop_token& stop,
                             const std::function<absl::Status(const v1::SolveResponse&)>& on_response) = 0;

  virtual std::unique_ptr<DeformCall> deform() = 0;
  /// Of the updates that deform() writes.
  virtual Order order() const { return Order::kWritten; }

  enum class Connected { kWas, kCame, kIsNot };
  /// Waits until there is a connection, for at most `longest`. Use this instead of a plain pause: gRPC works on a
  /// connection only while a thread waits in a call, or every five seconds.
  virtual Connected wait_for_connection(std::chrono::milliseconds longest, const std::stop_token& stop) = 0;
};

}  // namespace lpdeform::client
