#pragma once

#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/cpp/lease.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// The session as a file. Waits. DATA_LOSS where parts are missing.
absl::StatusOr<std::string> take_snapshot(Rpc& rpc, const std::string& session, const std::stop_token& stop);

/// Makes a session from such a file. The same `request_id` gives the same one. Waits.
absl::StatusOr<Lease> restore_session(Rpc& rpc, std::string_view file, const std::string& request_id,
                                      const std::stop_token& stop);

/// A session of `vertices` vertices can be made anew from the file that it was made from.
Copy copy_of(std::string file, std::int64_t vertices);

}  // namespace lpdeform::client
