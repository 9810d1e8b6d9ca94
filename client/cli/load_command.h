#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "client/cli/exit_status.h"
#include "client/cli/server_access.h"

namespace lpdeform::cli {

struct LoadOptions {
  ServerAccess server;  // its address is needed
  int sessions = 10;
  std::vector<int> vertices = {1000};  // of the sessions' meshes, in turn
  double rate = 10;                    // updates a second, of each session
  double seconds = 10;
  double p = 2;
  int slow_readers = 0;           // sessions with one
  double slow_pause_seconds = 1;  // between two frames that a slow reader takes
  double reconnect_seconds = 0;   // between two reconnects of each session; 0: none
  std::optional<std::filesystem::path> report;
};

/// Sends updates to sessions of its own at fixed times and measures when frames that answer them come. kDone where every
/// update was answered and nothing failed, kShortOfTolerance where not.
ExitStatus run_load(const LoadOptions& options);

}  // namespace lpdeform::cli
