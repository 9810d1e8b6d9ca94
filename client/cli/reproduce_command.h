#pragma once

#include <filesystem>
#include <vector>

#include "client/cli/exit_status.h"

namespace lpdeform::cli {

struct ReproduceOptions {
  std::filesystem::path out;  // a folder
  double size = 1;
  int threads = 0;                             // 0: all cores
  std::vector<std::filesystem::path> meshes;   // besides the paper's
  std::vector<std::filesystem::path> handles;  // one per mesh
  bool is_forced = false;
};

/// Reproduces the paper's table and figures, and writes a page, pictures and verdicts to a folder, which is
/// made if it does not exist. A folder that holds files of anything else is refused (OUT_NOT_OURS) unless
/// forced. Nothing is written before everything is computed. kInterrupted after Ctrl-C.
ExitStatus run_reproduce(const ReproduceOptions& options);

}  // namespace lpdeform::cli
