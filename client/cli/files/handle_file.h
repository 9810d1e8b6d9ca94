#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cpp/types.h"

namespace lpdeform::cli {

struct NamedHandle {
  std::string name;
  client::Handle handle;
};

/// Vertices with a name and, optionally, a material. They are not held.
struct VertexGroup {
  std::string name;
  std::vector<std::uint32_t> vertices;
  std::optional<double> p = {};
  std::optional<double> stiffness = {};
};

struct HandleFile {
  std::vector<NamedHandle> handles;
  std::vector<std::uint32_t> region;  // the vertices that may move; empty: all
  std::vector<VertexGroup> groups;    // a vertex may be in several groups
};

/// Reads the handles of a handle file in the file's order, its region and its groups; README.md describes the
/// format. Errors are INVALID_ARGUMENT and name the handle or group, the key and the value:
/// HANDLE_FILE_SYNTAX (line and column), HANDLE_FILE_KEY (unknown, given twice or missing), HANDLE_FILE_VALUE
/// (of the wrong type), HANDLE_FILE_EMPTY, HANDLE_NAME, HANDLE_NAME_TWICE, HANDLE_EMPTY,
/// HANDLE_VERTEX_OUT_OF_RANGE, HANDLE_VERTEX_TWICE, HANDLE_MOTION_TWICE (positions besides translate or
/// rotate), HANDLE_TARGET_COUNT, HANDLE_AXIS_ZERO, HANDLE_POINTS_AND_VERTICES, HANDLE_HOLD_TWICE,
/// HANDLE_BARYCENTRIC, HANDLE_WEIGHT_OUT_OF_RANGE, HANDLE_LOCK_DIRECTION, HANDLE_FOOTPRINT_OUT_OF_RANGE,
/// REGION_EMPTY, REGION_VERTEX_OUT_OF_RANGE. The server checks the faces.
absl::StatusOr<HandleFile> parse_handles(std::string_view json, std::int64_t vertex_count);

/// The same from a file, which is read once because it may be a pipe. More errors: NOT_FOUND
/// (FILE_NOT_FOUND).
absl::StatusOr<HandleFile> read_handles(const std::filesystem::path& path, std::int64_t vertex_count);

/// A handle file that parse_handles can read.
std::string handle_file_text(const std::vector<NamedHandle>& handles, std::string_view mesh,
                             std::string_view note);

}  // namespace lpdeform::cli
