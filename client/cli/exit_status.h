#pragma once

#include "absl/status/status.h"
#include "client/cpp/types.h"

namespace lpdeform::cli {

/// The program's exit status. Scripts depend on these numbers.
enum ExitStatus {
  kDone = 0,              // converged, or ended by a limit that the caller set
  kShortOfTolerance = 1,  // broke down or stalled, or met a limit that the caller did not set
  kBadInput = 2,
  kNoServer = 3,       // unreachable, or it refuses
  kInterrupted = 130,  // as in shells for Ctrl-C
};

/// Whether the caller's input is at fault (2) or the server (3).
ExitStatus exit_status_of(const absl::Status& error);

/// `has_iteration_limit`, `has_time_limit`: whether the caller set that limit.
ExitStatus exit_status_of(client::StopReason reason, bool has_iteration_limit, bool has_time_limit);

/// Prints one line to stderr; returns exit_status_of(error).
ExitStatus complain(const absl::Status& error);

}  // namespace lpdeform::cli
