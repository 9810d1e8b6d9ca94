#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lpdeform::cli {

/// NOT_FOUND (FILE_NOT_FOUND) if the file cannot be read.
absl::StatusOr<std::string> read_text(const std::filesystem::path& path);

/// INVALID_ARGUMENT FILE_NOT_WRITTEN: "PATH" cannot be written: WHY.
absl::Status not_written(const std::filesystem::path& path, std::string_view why);

/// Like write_whole_file: writes the whole text, or leaves the previous contents. FILE_NOT_WRITTEN.
absl::Status write_text(const std::filesystem::path& path, std::string_view text);

/// INVALID_ARGUMENT (FILE_NOT_WRITTEN) if the folder of `path` does not exist. Check this before long work,
/// not after it.
absl::Status check_folder(const std::filesystem::path& path);

}  // namespace lpdeform::cli
