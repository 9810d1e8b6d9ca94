#pragma once

#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// 32 random hexadecimal digits from the system's source of randomness: a request_id that makes a creating call
/// idempotent.
std::string new_request_id();

/// The uploads of one message, sent before it. `rpc` must outlive this object. Not thread-safe.
class Uploads {
 public:
  /// Idempotent: the same bytes in the same order with the same `id` give the same uploads.
  Uploads(Rpc& rpc, std::stop_token stop, std::string id = new_request_id());

  /// Sends `bytes` in parts of at most 1 MiB with a checksum; returns the upload's name. Waits, including the pauses
  /// that a server asks for if it limits its callers' bytes per second.
  absl::StatusOr<std::string> add(std::string_view bytes);

  bool empty() const { return names_.empty(); }

  /// Deletes the uploads on the server, when the message has been answered. Without this call they expire. Waits.
  void discard();

 private:
  absl::StatusOr<v1::UploadPartResponse> send(const v1::UploadPartRequest& part);

  Rpc* rpc_;
  std::stop_token stop_;
  std::string id_;
  int count_ = 0;
  std::vector<std::string> names_;
};

}  // namespace lpdeform::client
