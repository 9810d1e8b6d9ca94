#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace lpdeform {

/// The one place where our errors become gRPC's: the same code and text, with google.rpc.Status details.
/// ErrorInfo always (domain "lpdeform", the fault's stable reason, metadata "element" and "limit" where
/// known); BadRequest for INVALID_ARGUMENT, RetryInfo where trying again helps, QuotaFailure for
/// RESOURCE_EXHAUSTED, ResourceInfo for NOT_FOUND.
grpc::Status to_grpc(const absl::Status& status);

}  // namespace lpdeform
