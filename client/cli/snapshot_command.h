#pragma once

#include <filesystem>
#include <string>

#include "client/cli/exit_status.h"
#include "client/cli/server_access.h"

namespace lpdeform::cli {

struct SnapshotOptions {
  std::string session;  // "sessions/..."
  std::filesystem::path file;
  ServerAccess server;
};

/// Writes a session of a server to a file, completely or not at all.
ExitStatus run_snapshot(const SnapshotOptions& options);

struct RestoreOptions {
  std::filesystem::path file;
  ServerAccess server;
};

/// Makes a session from the file of a snapshot and prints its name.
ExitStatus run_restore(const RestoreOptions& options);

}  // namespace lpdeform::cli
