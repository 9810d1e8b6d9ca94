#pragma once

#include <cstdint>
#include <stop_token>

#include "absl/status/statusor.h"
#include "client/cpp/lease.h"
#include "client/cpp/ledger.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// One Solve call: sends `update` where there is one, passes progress on, puts the result together. Waits.
absl::StatusOr<SolveResult> run_solve(Rpc& rpc, const Lease& lease,
                                      const std::optional<NumberedUpdate>& update,
                                      const SolveOptions& options, const std::stop_token& stop);

}  // namespace lpdeform::client
