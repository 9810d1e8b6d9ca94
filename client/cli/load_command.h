#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "client/cli/exit_status.h"
#include "client/cli/server_access.h"

namespace lpdeform::cli {

struct LoadOptions {
  ServerAccess server;  // its address is required
  int sessions = 10;
  std::vector<int> vertices = {1000};  // of the sessions' meshes, in turn
  double rate = 10;                    // updates per second and session
  double seconds = 10;
  double p = 2;
  int slow_readers = 0;           // how many sessions have one
  double slow_pause_seconds = 1;  // between two frames of a slow reader
  double reconnect_seconds = 0;   // between two reconnects of a session; 0: none
  std::optional<std::filesystem::path> report;
};

/// Sends updates to its own sessions at fixed times, and measures when the frames that answer them come.
/// Returns kDone if every update was answered and nothing failed, otherwise kShortOfTolerance.
ExitStatus run_load(const LoadOptions& options);

}  // namespace lpdeform::cli
