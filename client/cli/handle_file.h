#pragma once

#include <cstdint>
#include <filesystem>
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

/// The handles of a handle file, in its order; README.md describes the format whole. Errors are
/// INVALID_ARGUMENT and name the handle, the key and the value: HANDLE_FILE_SYNTAX (line and column),
/// HANDLE_FILE_KEY (unknown, given twice or missing), HANDLE_FILE_VALUE (of the wrong kind),
/// HANDLE_FILE_EMPTY, HANDLE_NAME, HANDLE_NAME_TWICE, HANDLE_EMPTY, HANDLE_VERTEX_OUT_OF_RANGE,
/// HANDLE_VERTEX_TWICE, HANDLE_MOTION_TWICE (positions beside translate or rotate), HANDLE_TARGET_COUNT,
/// HANDLE_AXIS_ZERO.
absl::StatusOr<std::vector<NamedHandle>> parse_handles(std::string_view json, std::int64_t vertex_count);

/// The same from a file; also NOT_FOUND (FILE_NOT_FOUND).
absl::StatusOr<std::vector<NamedHandle>> read_handles(const std::filesystem::path& path,
                                                      std::int64_t vertex_count);

/// A handle file that parse_handles reads back.
std::string handle_file_text(const std::vector<NamedHandle>& handles, std::string_view mesh,
                             std::string_view note);

}  // namespace lpdeform::cli
