#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lpdeform {

/// The bytes of a file. NOT_FOUND (MESH_FILE_NOT_FOUND) if `path` is not a readable file.
absl::StatusOr<std::string> read_whole_file(const std::filesystem::path& path);

/// Writes `bytes` to a temporary file beside `path` and renames it, so that `path` holds either all of `bytes` or its
/// previous content. An existing file keeps its mode and, if this process is permitted to set them, its owner and
/// group. A link stays a link: the file that it points to changes. If `path` is not a regular file, such as a pipe or
/// /dev/stdout, the bytes are written to it directly. Errors carry FILE_NOT_WRITTEN and the system's reason.
absl::Status write_whole_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace lpdeform
