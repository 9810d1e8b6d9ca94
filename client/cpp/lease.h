#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "client/cpp/client.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// The client's claim on a session on the server.
struct Lease {
  std::string session;
  std::string writer_token;  // empty for a reader
  std::uint64_t epoch = 0;
  std::uint64_t input_seq = 0;  // the newest update that the session had
  MeshReport mesh;
  std::string route;  // value of the header lpdeform-session, see Rpc::going_by; may be empty
};

/// The lease of a session that the server has described.
Lease lease_of(const v1::Session& session, const std::string& writer_token);

/// What a session that the server has lost is created again from; empty for a session that was joined.
struct Copy {
  /// Idempotent: the same `request_id` gives the same session. Waits.
  using Make = std::function<absl::StatusOr<Lease>(Rpc& rpc, const std::string& request_id,
                                                   const std::stop_token& stop)>;
  Make make = {};
  bool is_bare = true;  // the new session has no handles: all are sent after it

  explicit operator bool() const { return make != nullptr; }
};

/// Creates a session. Idempotent: the same `request_id` gives the same session. Waits.
absl::StatusOr<Lease> create_session(Rpc& rpc, const Mesh& mesh, const OpenOptions& options,
                                     const std::string& request_id, const std::stop_token& stop);

/// The Copy that calls create_session() again with these arguments.
Copy copy_of(Mesh mesh, OpenOptions options);

/// The route in a SESSION_ELSEWHERE error: the header value for a session that is at another of several servers. Empty
/// for any other status.
std::string route_of(const absl::Status& status);

/// Looks up a session; for Role::kWriter, also acquires it. Waits.
absl::StatusOr<Lease> join_session(Rpc& rpc, const std::string& session, Role role,
                                   const std::stop_token& stop);

/// DATA_LOSS FRAME_VERTICES if the server reports `count` vertices but the mesh has `wanted`, for which the buffers
/// were made.
absl::Status check_vertex_count(std::int64_t count, std::int64_t wanted);

/// Whether the error means that the server no longer has the session of the call.
bool is_session_lost(const absl::Status& status);

/// Whether to retry after this error: the server may still accept the update, or the creation of the session. This
/// includes a server that restarted between an upload and its use, and a server that is full and says when to retry.
bool is_undecided(const absl::Status& status);

/// Whether the error is about solving, not about the update: the server has accepted the update.
bool is_taken_all_the_same(const absl::Status& status);

}  // namespace lpdeform::client
