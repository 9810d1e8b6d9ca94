#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/exit_status.h"

namespace lpdeform::cli {

struct ShapeOptions {
  std::string name;
  int detail = 1;
  std::optional<int> vertices;  // in place of detail
  std::filesystem::path out;
  std::optional<std::filesystem::path> handles;
};

/// Writes a generated shape and, if requested, a handle file for it.
ExitStatus run_shape(const ShapeOptions& options);

}  // namespace lpdeform::cli
