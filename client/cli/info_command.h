#pragma once

#include <filesystem>

#include "client/cli/exit_status.h"

namespace lpdeform::cli {

struct InfoOptions {
  std::filesystem::path mesh;
  bool is_json = false;
};

/// Prints what a mesh consists of and its defects. If the mesh cannot be deformed, a line on stderr says why,
/// and the status is kBadInput.
ExitStatus run_info(const InfoOptions& options);

}  // namespace lpdeform::cli
