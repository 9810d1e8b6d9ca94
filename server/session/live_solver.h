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

/// What a session does with its deformer, slice by slice. It takes over the newest inputs, begins a solve if
/// they changed, steps, and publishes frames on the way. It works while a stream is open or a Solve call
/// waits. Otherwise it rests, and later continues from where it stopped. For one thread at a time.
///
/// Inputs without any handle leave the surface as it is: its present state is their result. If a component of
/// the mesh lacks a handle, no frame answers the inputs. A standing fault then says so until newer inputs can
/// be solved for.
///
/// If a reader asked for certificates and a result has stood for kQuiet, the solver searches for the
/// certificate of that result. It publishes the frame again with the certificate, after kCertificateSeconds
/// with the bound found so far. A newer input or a Solve call ends the search.
///
/// Solves for readers take the first minimum. If a result has stood for kSearchQuiet, the solver looks for lower
/// minima (Deformer::start_search) while nobody waits for an answer, and announces or shows the lowest one, if it saves enough. It
/// goes on with further starts, with ever longer pauses, until it has made kMostStarts for these inputs, or as many as the effort asks for if
/// these are more.
/// Once a writer has taken the announced shape (Publisher::take_better), all that follows goes on from it.
class LiveSolver {
 public:
  /// How the solver asks to be run again later. `ring` is called on the timers' thread and may outlive the
  /// solver.
  struct Alarm {
    std::shared_ptr<Timers> timers;
    std::function<void()> ring;
  };

  /// Publishes the present state, in the vertices of `mesh`. When `stop` is requested, its solves end.
  LiveSolver(std::unique_ptr<Deformer> deformer, const Mailbox& mailbox, Publisher& publisher,
             std::shared_ptr<const DrawMesh> mesh, Alarm alarm, std::stop_token stop);

  static constexpr std::chrono::milliseconds kSlice{8};
  /// Until inputs are shown for the first time: their first frame comes this soon, and better ones follow.
  static constexpr std::chrono::milliseconds kFirstSlice{1};
  /// While others wait for an answer; under overload.
  static constexpr std::chrono::milliseconds kShortSlice{1}, kOneStep{0};
  static constexpr std::chrono::milliseconds kBetweenRefinements{250};
  static constexpr std::chrono::milliseconds kBetweenReports{100};
  /// While it runs for readers who cannot be sent a frame just now, the frame that waits for them is at most
  /// this old.
  static constexpr std::chrono::milliseconds kOldestWaiting{100};
  static constexpr std::chrono::milliseconds kQuiet{100};
  static constexpr double kCertificateSeconds = 10;
  static constexpr std::chrono::milliseconds kSearchQuiet{1000};
  /// Starts for the same inputs, unless the effort asks for more.
  static constexpr int kMostStarts = 72;

  /// How a slice is run.
  struct Pace {
    std::chrono::milliseconds slice = kSlice;
    /// Frames that only refine the result of inputs already shown come once per kBetweenRefinements.
    bool is_sparing = false;
  };

  /// Runs for about pace.slice, or for one step if that takes longer. The first slice for new inputs is at most
  /// kFirstSlice, unless their guess is shown. A slice ends early when newer inputs come. A guess that is smooth
  /// (Deformer::is_guess_smooth) is shown before the first step, but not under overload, when the frame after that step would come too
  /// late. `job` may be null. Returns true if
  /// there is more to do.
  bool run_slice(SolveJob* job, const Pace& pace);
  bool run_slice(SolveJob* job) { return run_slice(job, Pace()); }

  /// Whether all that is left to do is to look for a better shape.
  bool is_searching() const { return deformer_->is_searching(); }

  /// Whether a solve was ever begun. From then on memory_bytes() includes the factors.
  bool has_solved() const { return deformer_->summary().method != Method::kAuto; }

  /// Bytes held, without the shared rest shape.
  std::size_t memory_bytes() const;

 private:
  using Clock = std::chrono::steady_clock;
  enum class Phase {
    kDone,     // the inputs are answered, or cannot be
    kWaiting,  // the inputs are not answered yet, and no solve runs
    kRunning,
    kAnswered,    // done except for a certificate
    kCertifying,  // searching for a certificate
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
  // The search for lower minima: live_search.cc.
  int standing_effort() const;
  void plan_search();
  bool look_for_better(const Pace& pace);
  bool begin_search();
  bool postpone_search(Timers::TimePoint until);
  void end_search();
  void offer_better();
  void withdraw_better();
  void show_better();
  void report(const SolveJob& job);
  bool is_refinement() const { return shown_version_ == inputs_.version; }
  bool is_outdated() const { return mailbox_.version() != inputs_.version; }
  bool is_frame_due(const Pace& pace) const;
  bool is_guess_due(const Pace& pace) const;
  std::shared_ptr<const Frame> publish(bool is_final);

  const std::unique_ptr<Deformer> deformer_;
  const Mailbox& mailbox_;
  Publisher& publisher_;
  const std::shared_ptr<const DrawMesh> mesh_;
  const Alarm alarm_;
  const std::stop_token stop_;

  Inputs inputs_;                          // taken over, or tried and refused
  std::shared_ptr<const HandleSet> held_;  // the handles that the deformer has
  absl::Status blocked_;                   // why the inputs cannot be solved for
  Phase phase_ = Phase::kDone;
  bool was_begun_ = false;  // a solve for these inputs was begun, so the next one continues from its state
  static constexpr std::uint64_t kNobody = 0, kReaders = 1;
  std::uint64_t running_for_ = kNobody;  // the number of a job, or kReaders
  Clock::time_point last_report_;
  Clock::time_point last_published_;
  std::uint64_t shown_version_ = 0;  // of the inputs in the last frame
  double shown_energy_ = 0;          // of the last frame
  Timers::TimePoint answered_at_;    // while kAnswered
  bool is_alarm_set_ = false;        // set since answered_at_
  bool is_search_due_ = false;       // there are starts to make for the result, from search_from_ on
  Timers::TimePoint search_from_;
  Timers::TimePoint search_alarm_;  // the next to ring; in the past if none is set
};

}  // namespace lpdeform
