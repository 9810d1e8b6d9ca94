#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cpp/caller.h"
#include "client/cpp/grpc_web/web_http.h"
#include "lpdeform/v1/service.pb.h"

namespace lpdeform::client {

/// What becomes of a call; as HttpEvents, on the same thread.
struct CallEvents {
  /// Whether there is room for another message; if not, none comes until HttpCall::resume().
  std::function<bool()> has_room;
  std::function<void(std::string message)> message;
  /// Last, and once: the call's status, with the server's fault in it.
  std::function<void(const absl::Status& status)> end;
};

/// Calls of lpdeform.v1.DeformService by gRPC-Web. Copies share an Http, which must outlive them. Thread-safe.
class Calls {
 public:
  Calls(Http& http, Caller caller) : http_(&http), caller_(std::move(caller)) {}

  const Caller& caller() const { return caller_; }

  /// `method`: the name alone. `limit`: the call's deadline; 0 is without limit.
  std::shared_ptr<HttpCall> start(const std::string& method, const google::protobuf::MessageLite& request,
                                  std::chrono::milliseconds limit, CallEvents events) const;

  /// Waits for the one message of the answer. CANCELLED when `stop` is requested.
  absl::StatusOr<std::string> wait(const std::string& method, const google::protobuf::MessageLite& request,
                                   std::chrono::milliseconds limit, const std::stop_token& stop) const;

 private:
  Http* http_;
  Caller caller_;
};

}  // namespace lpdeform::client
