#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>

#include "absl/status/statusor.h"
#include "client/cpp/lease.h"
#include "client/cpp/ledger.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// Makes one Solve call: sends `update` if there is one, reports progress, and assembles the result. Waits. Calls `on_solved`
/// once the server has solved, before the result has come.
absl::StatusOr<SolveResult> run_solve(Rpc& rpc, const Lease& lease,
                                      const std::optional<NumberedUpdate>& update,
                                      const SolveOptions& options, const std::stop_token& stop,
                                      const std::function<void()>& on_solved);

}  // namespace lpdeform::client
