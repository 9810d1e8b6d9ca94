#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace lpdeform::cli {

/// The numbers of a field: one a line, one line a vertex, in vertex order. Empty lines at the end are
/// nothing. INVALID_ARGUMENT: FIELD_FILE_SYNTAX names the line and what stands there, FIELD_SIZE both counts.
/// `name` is the file's, for messages. Whether the numbers are in range is for the server to say.
absl::StatusOr<std::vector<double>> parse_field(std::string_view text, std::int64_t vertex_count,
                                                std::string_view name);

/// The same from a file; also NOT_FOUND (FILE_NOT_FOUND).
absl::StatusOr<std::vector<double>> read_field(const std::filesystem::path& path, std::int64_t vertex_count);

}  // namespace lpdeform::cli
