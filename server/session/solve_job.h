#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>

#include "absl/status/statusor.h"
#include "core/solve/summary.h"
#include "server/session/frame.h"

namespace lpdeform {

/// What a Solve call asks for besides the session's handles and settings.
struct SolveOptions {
  bool certify = false;
  bool keep_trace = false;
  std::optional<Points> initial_positions = {};
};

struct SolveProgress {
  std::uint32_t iteration = 0;
  double energy = 0;
  double seconds = 0;
};

struct SolveResult {
  SolveSummary summary;
  std::shared_ptr<const Frame> frame;
};

/// A running Solve call. The first caller of finish() or abandon() decides how it ended. Both stop the
/// solver.
class SolveJob {
 public:
  using OnProgress = std::function<void(const SolveProgress&)>;
  using OnDone = std::function<void(absl::StatusOr<SolveResult>)>;

  /// Both callbacks are called from any thread and under no lock; `on_done` is called once. `on_progress` may
  /// be empty.
  SolveJob(SolveOptions options, OnProgress on_progress, OnDone on_done)
      : options_(std::move(options)), on_progress_(std::move(on_progress)), on_done_(std::move(on_done)) {}

  /// Unique within the process; over 1.
  std::uint64_t number() const { return number_; }
  const SolveOptions& options() const { return options_; }
  std::stop_token stop_token() const { return stop_.get_token(); }
  bool is_done() const { return is_done_; }

  void report(const SolveProgress& progress) const {
    if (on_progress_ && !is_done_) on_progress_(progress);
  }

  void finish(absl::StatusOr<SolveResult> result) {
    if (is_done_.exchange(true)) return;
    stop_.request_stop();
    on_done_(std::move(result));
  }

  /// Ends the job without a call of `on_done`, because its caller waits no longer.
  void abandon() {
    is_done_ = true;
    stop_.request_stop();
  }

  /// The inputs that the job is for. A newer version supersedes the job.
  std::uint64_t version = 0;

 private:
  static std::uint64_t next_number() {
    static std::atomic<std::uint64_t> last = 1;
    return ++last;
  }

  const std::uint64_t number_ = next_number();
  const SolveOptions options_;
  const OnProgress on_progress_;
  const OnDone on_done_;
  std::stop_source stop_;
  std::atomic<bool> is_done_ = false;
};

}  // namespace lpdeform
