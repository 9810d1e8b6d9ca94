#pragma once

#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/cpp/lease.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// The session as a file. Waits. DATA_LOSS if parts are missing.
absl::StatusOr<std::string> take_snapshot(Rpc& rpc, const std::string& session, const std::stop_token& stop);

/// Creates a session from such a file. Idempotent: the same `request_id` gives the same session. Waits.
absl::StatusOr<Lease> restore_session(Rpc& rpc, std::string_view file, const std::string& request_id,
                                      const std::stop_token& stop);

/// The Copy that creates a session with `vertices` vertices again from its snapshot file.
Copy copy_of(std::string file, std::int64_t vertices);

}  // namespace lpdeform::client
