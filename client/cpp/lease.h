#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "client/cpp/client.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// What we hold of a session on the server.
struct Lease {
  std::string session;
  std::string writer_token;  // empty for a reader
  std::uint64_t epoch = 0;
  std::uint64_t input_seq = 0;  // the newest update that the server had taken
  MeshReport mesh;
  std::string route;  // the header that leads to it, see Rpc::going_by; may be empty
};

/// Of a session that a server has told of.
Lease lease_of(const v1::Session& session, const std::string& writer_token);

/// What a session that the server has lost can be made anew from; nothing for one that was joined.
struct Copy {
  /// The same `request_id` gives the same session. Waits.
  using Make = std::function<absl::StatusOr<Lease>(Rpc& rpc, const std::string& request_id,
                                                   const std::stop_token& stop)>;
  Make make = {};
  bool is_bare = true;  // without handles: all that there were are sent after it

  explicit operator bool() const { return make != nullptr; }
};

/// Makes a session. The same `request_id` gives the same one. Waits.
absl::StatusOr<Lease> create_session(Rpc& rpc, const Mesh& mesh, const OpenOptions& options,
                                     const std::string& request_id, const std::stop_token& stop);

/// That does so again.
Copy copy_of(Mesh mesh, OpenOptions options);

/// What a status says of the header that leads to a session which is at another of several servers; empty where it says
/// nothing of that.
std::string route_of(const absl::Status& status);

/// Looks up a session; as its writer, takes it over. Waits.
absl::StatusOr<Lease> join_session(Rpc& rpc, const std::string& session, Role role,
                                   const std::stop_token& stop);

/// DATA_LOSS FRAME_VERTICES where a server speaks of `count` vertices of a mesh that has `wanted`: buffers were made for those.
absl::Status check_vertex_count(std::int64_t count, std::int64_t wanted);

/// The server no longer has the session that a call was about.
bool is_session_lost(const absl::Status& status);

/// The server may still take in what failed like this, an update or a session to be made: it is to be sent again. Among
/// them a server that began anew between an upload and its use, and one that has no room and says when it may have.
bool is_undecided(const absl::Status& status);

/// The error is about solving, not about the update: the server has taken that in.
bool is_taken_all_the_same(const absl::Status& status);

}  // namespace lpdeform::client
