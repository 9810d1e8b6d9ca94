#pragma once

#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// The session as a file. Waits. DATA_LOSS where parts are missing.
absl::StatusOr<std::string> take_snapshot(Rpc& rpc, const std::string& session, const std::stop_token& stop);

/// Makes a session from such a file; its name. Waits.
absl::StatusOr<std::string> restore_snapshot(Rpc& rpc, std::string_view file, const std::stop_token& stop);

}  // namespace lpdeform::client
