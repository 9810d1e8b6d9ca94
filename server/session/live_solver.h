#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <stop_token>

#include "core/solve/deformer.h"
#include "server/runtime/timers.h"
#include "server/session/mailbox.h"
#include "server/session/publisher.h"
#include "server/session/solve_job.h"

namespace lpdeform {

/// What a session does with its deformer, slice by slice: takes the newest inputs over, begins a solve where
/// there is something new, steps, and publishes frames on the way. It works while somebody looks on or a
/// Solve call waits, rests otherwise, and goes on from where it was. One thread at a time.
///
/// Inputs with no handle at all leave the surface as it is: its present state is their result. Where a
/// component lacks a handle, no frame answers the inputs; a standing fault says so until newer inputs are
/// better.
///
/// Where a reader asked for certificates and a result has stood for kQuiet, it looks for the result's and publishes
/// the frame again with it, after kCertificateSeconds with what it has; a newer input or a Solve call ends the search.
class LiveSolver {
 public:
  /// How it asks to be run again later: `ring` is called on the timers' thread, and may outlive the solver.
  struct Alarm {
    std::shared_ptr<Timers> timers;
    std::function<void()> ring;
  };

  /// Publishes the present state, in the vertices of `mesh`. Ends its solves when `stop` is requested.
  LiveSolver(std::unique_ptr<Deformer> deformer, const Mailbox& mailbox, Publisher& publisher,
             std::shared_ptr<const DrawMesh> mesh, Alarm alarm, std::stop_token stop);

  static constexpr std::chrono::milliseconds kSlice{8};
  /// While others wait for an answer; under overload.
  static constexpr std::chrono::milliseconds kShortSlice{1}, kOneStep{0};
  static constexpr std::chrono::milliseconds kBetweenRefinements{250};
  static constexpr std::chrono::milliseconds kBetweenReports{100};
  /// While it runs for readers, none of whom may be sent a frame just now, the one that waits for them is not older.
  static constexpr std::chrono::milliseconds kOldestWaiting{100};
  static constexpr std::chrono::milliseconds kQuiet{100};
  static constexpr double kCertificateSeconds = 10;

  /// How it goes about a slice.
  struct Pace {
    std::chrono::milliseconds slice = kSlice;
    /// Frames that only refine what was shown for the same inputs come every kBetweenRefinements.
    bool is_sparing = false;
  };

  /// At most about pace.slice, or one step where that takes longer. `job` may be null. True where there is more
  /// to do.
  bool run_slice(SolveJob* job, const Pace& pace);
  bool run_slice(SolveJob* job) { return run_slice(job, Pace()); }

  /// Whether a solve was ever begun: from then on memory_bytes() includes the factors.
  bool has_solved() const { return deformer_->summary().method != Method::kAuto; }

  /// Bytes held, the shared rest shape left out.
  std::size_t memory_bytes() const;

 private:
  using Clock = std::chrono::steady_clock;
  enum class Phase {
    kDone,     // the inputs are answered, or cannot be
    kWaiting,  // they are not yet, and no solve runs
    kRunning,
    kAnswered,    // done but for a certificate
    kCertifying,  // it is being looked for
  };

  void take_over(const Inputs& inputs);
  bool begin_job(SolveJob& job);
  bool begin_live();
  void pause();
  void run_steps(SolveJob* job, const Pace& pace);
  void end_solve(SolveJob* job);
  bool look_for_certificate();
  bool begin_certificate();
  void set_alarm();
  void report(const SolveJob& job);
  bool is_frame_due(const Pace& pace) const;
  std::shared_ptr<const Frame> publish(bool is_final);

  const std::unique_ptr<Deformer> deformer_;
  const Mailbox& mailbox_;
  Publisher& publisher_;
  const std::shared_ptr<const DrawMesh> mesh_;
  const Alarm alarm_;
  const std::stop_token stop_;

  Inputs inputs_;                          // taken over, or tried
  std::shared_ptr<const HandleSet> held_;  // what the deformer has of them
  absl::Status blocked_;                   // why they cannot be solved for
  Phase phase_ = Phase::kDone;
  bool was_begun_ = false;  // a solve for them, so the next one goes on from its state
  static constexpr std::uint64_t kNobody = 0, kReaders = 1;
  std::uint64_t running_for_ = kNobody;  // the number of a job, or kReaders
  Clock::time_point last_report_;
  Clock::time_point last_published_;
  std::uint64_t shown_version_ = 0;  // of the inputs that the last frame is for
  Timers::TimePoint answered_at_;    // while kAnswered
  bool is_alarm_set_ = false;        // since then
};

}  // namespace lpdeform
