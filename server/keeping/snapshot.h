#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "lpdeform/v1/service.pb.h"
#include "server/keeping/stored_state.h"
#include "server/session/session.h"

namespace lpdeform {

// A session as a file. It begins with 24 bytes, all numbers little-endian:
//   0   "lpdeform"                        8   uint32 the format, kSnapshotFormat
//   12  uint32 CRC-32C of what follows    16  uint64 how many bytes follow
// Then follows a message lpdeform.stored.Snapshot. Fields may be added to it within a format; a reader ignores
// fields that it does not know. The format number rises when an older reader would misread the file.

inline constexpr std::uint32_t kSnapshotFormat = 1;
inline constexpr std::size_t kSnapshotHeaderBytes = 24;

/// The content of such a file.
struct Snapshot {
  v1::CreateSessionRequest request;  // the mesh with weld and normals, with inline buffers of any size
  std::map<std::string, std::string> parts;  // as in a store, without head and writer
  std::optional<v1::Positions> surface;      // set if the session had been solved
  Reservation memory = {};                   // for all of this, and for what is made of it temporarily
};

/// Twice the approximate size of the file, because the content is put together before it is serialized.
std::size_t snapshot_bytes(const Session& session);

/// The session's file: a consistent state of its inputs, and the newest frame. Takes as long as copying its
/// mesh. FAILED_PRECONDITION SNAPSHOT_TOO_LARGE if the file would be larger than `most_bytes`; protobuf
/// cannot write a message of 2 GiB.
inline constexpr std::size_t kMostSnapshotBytes = (std::size_t{1} << 31) - 1;
absl::StatusOr<std::string> encode_snapshot(const Session& session,
                                            std::size_t most_bytes = kMostSnapshotBytes);

/// INVALID_ARGUMENT: SNAPSHOT_FOREIGN, SNAPSHOT_NEWER, SNAPSHOT_TRUNCATED, SNAPSHOT_DAMAGED. The values are
/// not checked here. RESOURCE_EXHAUSTED MEMORY_FULL, CALLER_MEMORY_FULL, before anything is parsed, because a
/// small forged file can expand to a large message.
absl::StatusOr<Snapshot> decode_snapshot(std::string_view file, Budget& budget, const std::string& owner);

/// The header of a file with this content.
std::string snapshot_header(std::string_view content);

/// INVALID_ARGUMENT SNAPSHOT_DAMAGED.
absl::Status snapshot_damaged(std::string_view why);

}  // namespace lpdeform
