#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace lpdeform::cli {

/// Reads the numbers of a field: one number per line and one line per vertex, in vertex order. Empty lines at
/// the end are ignored. INVALID_ARGUMENT: FIELD_FILE_SYNTAX names the line and quotes it, FIELD_SIZE names
/// both counts. `name`: the file's name, for messages. The server checks the range of the numbers.
absl::StatusOr<std::vector<double>> parse_field(std::string_view text, std::int64_t vertex_count,
                                                std::string_view name);

/// The same from a file; also NOT_FOUND (FILE_NOT_FOUND).
absl::StatusOr<std::vector<double>> read_field(const std::filesystem::path& path, std::int64_t vertex_count);

}  // namespace lpdeform::cli
