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

// A session as a file. 24 bytes, all numbers little-endian:
//   0   "lpdeform"                        8   uint32 the format, kSnapshotFormat
//   12  uint32 CRC-32C of what follows    16  uint64 how many bytes follow
// then a message lpdeform.stored.Snapshot. Fields may be added to it within a format; a reader leaves those that it does not
// know. The format rises when an older reader would get something wrong.

inline constexpr std::uint32_t kSnapshotFormat = 1;
inline constexpr std::size_t kSnapshotHeaderBytes = 24;

/// What is in such a file.
struct Snapshot {
  v1::CreateSessionRequest request;  // the mesh and all that goes with it, with inline buffers of any size
  std::map<std::string, std::string> parts;  // as a store has them; neither head nor writer
  std::optional<v1::Positions> surface;      // where something had been solved for
  Reservation memory = {};                   // of all this, and of what is made of it for a moment
};

/// About as many bytes as its file will have, twice: it is put together before it is written down.
std::size_t snapshot_bytes(const Session& session);

/// The file of a session as it is now: one moment of its inputs, and the newest frame. As long as copying its mesh takes.
/// FAILED_PRECONDITION SNAPSHOT_TOO_LARGE where it would have more than `most_bytes`; protobuf writes no message of 2 GiB.
inline constexpr std::size_t kMostSnapshotBytes = (std::size_t{1} << 31) - 1;
absl::StatusOr<std::string> encode_snapshot(const Session& session,
                                            std::size_t most_bytes = kMostSnapshotBytes);

/// INVALID_ARGUMENT: SNAPSHOT_FOREIGN, SNAPSHOT_NEWER, SNAPSHOT_TRUNCATED, SNAPSHOT_DAMAGED. What the values mean is not checked
/// here. RESOURCE_EXHAUSTED MEMORY_FULL, CALLER_MEMORY_FULL, before anything is parsed: few bytes of a file that somebody made up
/// can become many.
absl::StatusOr<Snapshot> decode_snapshot(std::string_view file, Budget& budget, const std::string& owner);

/// The header of a file with this content.
std::string snapshot_header(std::string_view content);

/// INVALID_ARGUMENT SNAPSHOT_DAMAGED.
absl::Status snapshot_damaged(std::string_view why);

}  // namespace lpdeform
