#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cpp/client.h"
#include "lpdeform/v1/service.pb.h"

namespace lpdeform::client {

/// Printable ASCII: what a header may be. gRPC ends the process over any other.
bool is_header_text(std::string_view text);

/// One Deform call. read() on one thread, write() on one other; cancel() on any, as often as one likes.
class DeformCall {
 public:
  virtual ~DeformCall() = default;
  /// Waits until gRPC has taken the message. False once the call is over.
  virtual bool write(const v1::DeformRequest& request) = 0;
  /// Waits for a message. False once the call is over.
  virtual bool read(v1::DeformResponse& response) = 0;
  virtual void cancel() = 0;
  /// How it ended. Once, when nobody reads or writes any more.
  virtual absl::Status finish() = 0;
};

/// The server's calls over one channel, gRPC hidden behind it. Thread-safe. Each waits, for at most the call
/// timeout (and DeleteSession two seconds) where nothing else is said, and ends with CANCELLED when `stop` is requested.
class Rpc {
 public:
  /// `address` as in Client::connect. Waits until the server answers or the address refuses:
  /// UNAVAILABLE (NO_SERVER). INVALID_ARGUMENT as check_tls().
  static absl::StatusOr<std::shared_ptr<Rpc>> connect(const std::string& address,
                                                      const ClientOptions& options,
                                                      const std::stop_token& stop);
  virtual ~Rpc() = default;

  /// The value of the header lpdeform-session, which every call has: where a proxy stands before several servers, all calls
  /// with the same one come to the same server.
  virtual std::string route() const = 0;
  /// What a call may take where nothing else is said.
  virtual std::chrono::milliseconds call_timeout() const = 0;
  /// The same channel by another way.
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

  enum class Connected { kWas, kCame, kIsNot };
  /// Waits for a connection where there is none, `longest` at most. To be called in place of a mere pause: gRPC makes
  /// progress with a connection only while somebody waits in a call, or every five seconds.
  virtual Connected wait_for_connection(std::chrono::milliseconds longest, const std::stop_token& stop) = 0;
};

}  // namespace lpdeform::client
