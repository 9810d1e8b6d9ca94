#pragma once

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/c/live_session.h"
#include "client/c/lpdeform.h"
#include "client/c/server.h"
#include "client/cpp/client.h"

namespace lpdeform::engine {

/// INVALID_ARGUMENT SECONDS_OUT_OF_RANGE where `seconds` is not within 0 to 1e9.
absl::Status check_seconds(const char* name, double seconds);

/// The server that `connection` names, not connected to yet. ARGUMENT_MISSING, SECONDS_OUT_OF_RANGE; TLS_OFF where there are
/// certificates and no TLS.
absl::StatusOr<std::shared_ptr<Server>> make_server(const lpdeform_connection& connection);

struct ReadOptions {
  client::OpenOptions open;
  LiveSession::Facts facts;  // but for the number of vertices
};

/// NULL is all defaults. ENUM_UNKNOWN, UNITS_OUT_OF_RANGE, and what read_struct says.
absl::StatusOr<ReadOptions> read_options(const lpdeform_options* options);

}  // namespace lpdeform::engine
