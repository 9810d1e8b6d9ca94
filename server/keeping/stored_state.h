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

// From a session to the parts that a store has of it (server/keeping/stored.proto), and back. The parts: "head", what never
// changes; "writer"; "inputs", what is small; "p", "stiffness", "region"; "removed", handles let go of; for each handle
// "g:NAME", what it holds, and "m:NAME", where it goes; "s:NUMBER", a step of its history. So a drag writes "inputs" and one "m:".

using StoredParts = std::map<std::string, std::optional<std::string>>;

/// What never changes, with its mesh, weld and normals apart.
struct StoredHead {
  std::string part;                          // "head"
  std::map<std::string, std::string> blobs;  // by key
};

/// `request`: as it came. `decoder`: knows the uploads that it names.
absl::StatusOr<StoredHead> encode_head(const v1::CreateSessionRequest& request, Decoder& decoder,
                                       std::uint64_t fingerprint, std::int64_t created_unix_ms);

/// The same for a session that lives and whose blobs the store has lost: its mesh to the last bit, whatever it came as. `part`: its
/// "head" as it was. NOT_FOUND SESSION_DAMAGED.
absl::StatusOr<StoredHead> encode_head_again(const Session& session, const std::string& part);

/// What to write for these changes.
StoredParts encode_changes(const SessionChanges& changes);

/// The part "writer".
std::string encode_writer(const std::string& token);

/// The head, read.
struct SessionHead {
  v1::CreateSessionRequest request;  // its large buffers name blobs
  std::uint64_t fingerprint = 0;
  std::int64_t created_unix_ms = 0;
};
/// NOT_FOUND SESSION_DAMAGED.
absl::StatusOr<SessionHead> decode_head(const std::map<std::string, std::string>& parts);

/// What the bytes of a part are; null where there is no part of this name, or nobody reads it.
const google::protobuf::Descriptor* part_type(std::string_view name);

/// The names of the blobs of a head's request.
std::vector<std::string> blobs_of(const v1::CreateSessionRequest& head);

/// Handles and settings, read.
struct SessionState {
  Update state;
  SessionPast past;
};
/// `vertex_count`: of the client's mesh. NOT_FOUND SESSION_DAMAGED.
absl::StatusOr<SessionState> decode_state(const StoredSession& stored, const SessionHead& head,
                                          Uploads& uploads);

/// A number for a request, the same for the same one in every process.
std::uint64_t fingerprint_of(const google::protobuf::Message& request);

}  // namespace lpdeform
