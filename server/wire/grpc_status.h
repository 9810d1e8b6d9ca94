#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace lpdeform {

/// Converts the project's errors to those of gRPC; nothing else does. The code and text stay the same.
/// Details (google.rpc.Status): always ErrorInfo (domain "lpdeform", the fault's stable reason, metadata
/// "element" and "limit" if known); BadRequest for INVALID_ARGUMENT; RetryInfo if a retry helps; QuotaFailure
/// for RESOURCE_EXHAUSTED; ResourceInfo for NOT_FOUND.
grpc::Status to_grpc(const absl::Status& status);

}  // namespace lpdeform
