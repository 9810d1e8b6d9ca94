#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace lpdeform::client {

/// The body of a gRPC-Web request: a byte 0, the length of `message` in four bytes, the highest first, and `message`.
std::string framed(std::string_view message);

/// Reads the answer to one gRPC-Web call: messages, then a block of trailers with the status. Errors without messages
/// may have their status in the headers. Not thread-safe.
class AnswerReader {
 public:
  /// As gRPC's own limit of received messages.
  static constexpr std::size_t kMostMessageBytes = 4 << 20;
  /// Limit of all headers together, and of the block of trailers. Envoy's own is 60 KiB.
  static constexpr std::size_t kMostHeaderBytes = 64 << 10;

  /// `name` in lower case; ":status" is the HTTP status. RESOURCE_EXHAUSTED for headers of over kMostHeaderBytes.
  absl::Status header(std::string_view name, std::string_view value);

  /// The next bytes of the body, cut anywhere. Calls `take` for each message that is complete. RESOURCE_EXHAUSTED for a
  /// message or a page of over kMostMessageBytes and for trailers of over kMostHeaderBytes, UNIMPLEMENTED for what is compressed,
  /// INTERNAL for bytes after the trailers. Do not go on after an error.
  absl::Status bytes(std::string_view bytes, const std::function<void(std::string message)>& take);

  /// Whether something answered that speaks gRPC-Web.
  bool is_grpc_web() const;

  /// The status of the call, after the whole body; with the fault in its details. UNAVAILABLE if the answer ends without
  /// a status. Without gRPC's status, the code comes from the HTTP status.
  absl::Status status() const;

 private:
  void read_trailers(std::string_view block);

  std::string waiting_;  // of the frame that is not complete
  std::size_t header_bytes_ = 0, page_bytes_ = 0;
  bool has_trailers_ = false;
  std::map<std::string, std::string, std::less<>> fields_;
};

}  // namespace lpdeform::client
