#pragma once

#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// 32 hexadecimal digits from the system's source of randomness: an id for a call that creates.
std::string new_request_id();

/// The uploads that one message needs, sent ahead of it. `rpc` outlives it. Not thread-safe.
class Uploads {
 public:
  /// The same bytes in the same order with the same `id` are the same uploads.
  Uploads(Rpc& rpc, std::stop_token stop, std::string id = new_request_id());

  /// Sends `bytes` in parts of at most 1 MiB with a checksum; returns the upload's name. Waits, also for as long as a server asks
  /// for that limits the bytes a second of its callers.
  absl::StatusOr<std::string> add(std::string_view bytes);

  bool empty() const { return names_.empty(); }

  /// The message has been answered: gives the server's memory back. Without it they expire. Waits.
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
