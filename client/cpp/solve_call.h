#pragma once

#include <cstdint>
#include <stop_token>

#include "absl/status/statusor.h"
#include "client/cpp/lease.h"
#include "client/cpp/ledger.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// Makes one Solve call: sends `update` if there is one, reports progress, and assembles the result. Waits.
absl::StatusOr<SolveResult> run_solve(Rpc& rpc, const Lease& lease,
                                      const std::optional<NumberedUpdate>& update,
                                      const SolveOptions& options, const std::stop_token& stop);

}  // namespace lpdeform::client
