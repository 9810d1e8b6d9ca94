#pragma once

#include <filesystem>

#include "client/cli/exit_status.h"

namespace lpdeform::cli {

struct InfoOptions {
  std::filesystem::path mesh;
  bool is_json = false;
};

/// Prints what a mesh is made of and what is wrong with it. Also where it cannot be deformed: then one line
/// on stderr says why, and the status is kBadInput.
ExitStatus run_info(const InfoOptions& options);

}  // namespace lpdeform::cli
