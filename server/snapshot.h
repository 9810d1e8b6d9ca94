#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "lpdeform/v1/service.pb.h"
#include "server/session.h"
#include "server/stored_state.h"

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
};

/// About as many bytes as its file will have, twice: it is put together before it is written down.
std::size_t snapshot_bytes(const Session& session);

/// The file of a session as it is now: one moment of its inputs, and the newest frame. As long as copying its mesh takes.
std::string encode_snapshot(const Session& session);

/// INVALID_ARGUMENT: SNAPSHOT_FOREIGN, SNAPSHOT_NEWER, SNAPSHOT_TRUNCATED, SNAPSHOT_DAMAGED. What the values mean is not checked here.
absl::StatusOr<Snapshot> decode_snapshot(std::string_view file);

/// The header of a file with this content.
std::string snapshot_header(std::string_view content);

/// INVALID_ARGUMENT SNAPSHOT_DAMAGED.
absl::Status snapshot_damaged(std::string_view why);

}  // namespace lpdeform
