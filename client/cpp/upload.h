#pragma once

#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// Sends `bytes` in parts of at most 1 MiB with a checksum; returns the upload's name. The same bytes with the same
/// `request_id` are the same upload. Waits.
absl::StatusOr<std::string> upload(Rpc& rpc, std::string_view bytes, const std::string& request_id,
                                   const std::stop_token& stop);

/// 32 hexadecimal digits from the system's source of randomness: an id for a call that creates.
std::string new_request_id();

}  // namespace lpdeform::client
