#pragma once

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/c/live_session.h"
#include "client/c/lpdeform.h"
#include "client/c/server.h"
#include "client/cpp/client.h"

namespace lpdeform::engine {

/// INVALID_ARGUMENT SECONDS_OUT_OF_RANGE if `seconds` is not in [0, 1e9].
absl::Status check_seconds(const char* name, double seconds);

/// The server that `connection` names; does not connect yet. ARGUMENT_MISSING, SECONDS_OUT_OF_RANGE; TLS_OFF if there
/// are certificates but no TLS.
absl::StatusOr<std::shared_ptr<Server>> make_server(const lpdeform_connection& connection);

struct ReadOptions {
  client::OpenOptions open;
  LiveSession::Facts facts;  // without the number of vertices
};

/// NULL means all defaults. Errors: ENUM_UNKNOWN, UNITS_OUT_OF_RANGE, and those of read_struct.
absl::StatusOr<ReadOptions> read_options(const lpdeform_options* options);

}  // namespace lpdeform::engine
