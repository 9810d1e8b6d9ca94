#include "client/cli/exit_status.h"

#include <cstdio>
#include <string>

#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::cli {

ExitStatus exit_status_of(const absl::Status& error) {
  if (fault_of(error).reason == Reason::kFileNotWritten) return kBadInput;
  switch (error.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kNotFound:  // a file, or a handle
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kAlreadyExists:
      return kBadInput;
    default:
      return kNoServer;
  }
}

ExitStatus exit_status_of(client::StopReason reason, bool has_iteration_limit, bool has_time_limit) {
  switch (reason) {
    case client::StopReason::kConverged:
      return kDone;
    case client::StopReason::kIterationLimit:
      return has_iteration_limit ? kDone : kShortOfTolerance;
    case client::StopReason::kTimeLimit:
      return has_time_limit ? kDone : kShortOfTolerance;
    default:
      return kShortOfTolerance;
  }
}

ExitStatus complain(const absl::Status& error) {
  std::string line(error.message());
  for (char& character : line) {
    if (character == '\n') character = ' ';
  }
  std::fprintf(stderr, "lpdeform: %s\n", line.c_str());
  return exit_status_of(error);
}

}  // namespace lpdeform::cli
