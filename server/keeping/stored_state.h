#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "lpdeform/v1/service.pb.h"
#include "server/session/session.h"
#include "server/store/store.h"
#include "server/wire/decode.h"

namespace lpdeform {

// Converts a session to the parts that a store keeps (server/keeping/stored.proto), and back. The parts are:
// "head", which never changes; "writer"; "inputs", small values; "p", "stiffness", "region"; "removed",
// removed handles; for each handle "g:NAME", its vertices and kind, and "m:NAME", its motion; "s:NUMBER", a
// step of its history. So a drag writes only "inputs" and one "m:".

using StoredParts = std::map<std::string, std::optional<std::string>>;

/// The part that never changes. Mesh, weld and normals are stored as blobs.
struct StoredHead {
  std::string part;                          // "head"
  std::map<std::string, std::string> blobs;  // by key
};

/// `request`: as received. `decoder`: knows the uploads that the request names.
absl::StatusOr<StoredHead> encode_head(const v1::CreateSessionRequest& request, Decoder& decoder,
                                       std::uint64_t fingerprint, std::int64_t created_unix_ms);

/// The same for a live session whose blobs the store has lost: its mesh exact to the last bit, however it was
/// first sent. `part`: the session's previous "head". NOT_FOUND SESSION_DAMAGED.
absl::StatusOr<StoredHead> encode_head_again(const Session& session, const std::string& part);

/// The parts to write for these changes.
StoredParts encode_changes(const SessionChanges& changes);

/// The part "writer".
std::string encode_writer(const std::string& token);

/// A decoded head.
struct SessionHead {
  v1::CreateSessionRequest request;  // its large buffers name blobs
  std::uint64_t fingerprint = 0;
  std::int64_t created_unix_ms = 0;
};
/// NOT_FOUND SESSION_DAMAGED.
absl::StatusOr<SessionHead> decode_head(const std::map<std::string, std::string>& parts);

/// The message type of a part; null if there is no part of this name, or if nothing reads it.
const google::protobuf::Descriptor* part_type(std::string_view name);

/// The names of the blobs that a head's request uses.
std::vector<std::string> blobs_of(const v1::CreateSessionRequest& head);

/// Decoded handles and settings.
struct SessionState {
  Update state;
  SessionPast past;
};
/// `vertex_count`: of the client's mesh. NOT_FOUND SESSION_DAMAGED.
absl::StatusOr<SessionState> decode_state(const StoredSession& stored, const SessionHead& head,
                                          Uploads& uploads);

/// A number that identifies a request's content. It is the same in every process.
std::uint64_t fingerprint_of(const google::protobuf::Message& request);

}  // namespace lpdeform
