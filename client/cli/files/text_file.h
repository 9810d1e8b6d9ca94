#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lpdeform::cli {

/// NOT_FOUND (FILE_NOT_FOUND) where it cannot be read.
absl::StatusOr<std::string> read_text(const std::filesystem::path& path);

/// INVALID_ARGUMENT FILE_NOT_WRITTEN: "PATH" cannot be written: WHY.
absl::Status not_written(const std::filesystem::path& path, std::string_view why);

/// As write_whole_file: all of it, or what was there before stays. FILE_NOT_WRITTEN.
absl::Status write_text(const std::filesystem::path& path, std::string_view text);

/// INVALID_ARGUMENT (FILE_NOT_WRITTEN) where the folder that `path` is to be written to does not exist. Asked
/// before long work, not after it.
absl::Status check_folder(const std::filesystem::path& path);

}  // namespace lpdeform::cli
