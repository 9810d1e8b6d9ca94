#pragma once

#include <filesystem>
#include <vector>

#include "client/cli/exit_status.h"

namespace lpdeform::cli {

struct ReproduceOptions {
  std::filesystem::path out;  // a folder
  double size = 1;
  int threads = 0;                             // 0: all cores
  std::vector<std::filesystem::path> meshes;   // of others
  std::vector<std::filesystem::path> handles;  // one for each mesh
  bool is_forced = false;
};

/// Makes the paper's table and figures again and writes them as a page, pictures and verdicts into a folder,
/// which is made where there is none. A folder that holds something and is not of this command's making is
/// refused (OUT_NOT_OURS) unless forced. Nothing is written before all is computed. kInterrupted after Ctrl-C.
ExitStatus run_reproduce(const ReproduceOptions& options);

}  // namespace lpdeform::cli
