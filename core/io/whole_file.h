#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lpdeform {

/// The bytes of a file. NOT_FOUND (MESH_FILE_NOT_FOUND) where `path` is no file that can be read.
absl::StatusOr<std::string> read_whole_file(const std::filesystem::path& path);

/// Writes `bytes` to a temporary file beside `path` and renames it, so that `path` holds all of them or what
/// it held before. A file that is there keeps its mode and, where this process may say so, its owner and group. A link stays a link:
/// the file behind it changes. What is no plain file, such as a pipe or /dev/stdout, gets the bytes as they are. Errors carry
/// FILE_NOT_WRITTEN and the system's reason.
absl::Status write_whole_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace lpdeform
