#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stop_token>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/workers.h"
#include "core/constraints/constraints.h"
#include "core/energy/material.h"
#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"
#include "core/problem/settings.h"
#include "core/solve/summary.h"

namespace lpdeform {

struct DeformerOptions {
  FreeComponents free_components = FreeComponents::kError;
  int threads = 1;  // at most; see vertices_a_thread
  /// A mesh has at most one thread for each so many vertices, which are at least 1. More threads would take longer to wake than they save.
  std::int32_t vertices_a_thread = 1000;
  /// Larger meshes look for lower minima on their coarse levels only.
  std::int32_t search_up_to = 15000;  // vertices
  /// The search of a solve keeps the first minimum unless another one saves at least this share of the energy.
  double least_saving = 0;
  /// Cold solves of meshes of this size may have a graded level between the coarse and the fine one (GradedLevel).
  std::int32_t graded_from = 200000;  // vertices
  /// Cold solves of meshes of this size may have one later, where the fine level has a long way to go and no p_i is above 2.
  std::int32_t late_graded_from = 60000;  // vertices
  /// Admission control: called once with the memory that a solve takes, before it is allocated. create() returns its
  /// error.
  std::function<absl::Status(std::size_t bytes)> admit = {};
};

/// One mesh being deformed: handles, material, the current state and its factorisations. Inputs may be changed at any
/// time between steps; each change takes effect completely or not at all. Not thread-safe: one caller at a time, which
/// may be a different thread each time.
///
///   auto deformer = Deformer::create(rest_shape, {});
///   deformer->set_handles(handles);
///   SolveSummary summary = deformer->solve({.certify = true});
///   use(deformer->positions(), deformer->cell_energies());
class Deformer {
 public:
  /// Errors: INVALID_ARGUMENT (NO_SHAPE, THREADS_OUT_OF_RANGE, FACTOR_TOO_LARGE); those of options.admit.
  static absl::StatusOr<std::unique_ptr<Deformer>> create(std::shared_ptr<const RestShape> shape,
                                                          DeformerOptions options);
  ~Deformer();

  const RestShape& shape() const;
  const HandleSet& handles() const;
  const Material& material() const;

  /// Replaces all handles and the region of interest. If the region changes, vertices outside it are held at the
  /// current positions(). If the set of held vertices changes, the metric is refactored numerically; if handles only
  /// move, it is not. Errors: as make_constraints. Ends a running solve with kCancelled.
  absl::Status set_handles(const HandleSet& handles);

  /// Replaces the material. Errors: as check_material. Ends a running solve with kCancelled.
  absl::Status set_material(const Material& material);

  /// Only for coarse levels: cells keep these shares of their resistance to bending (CellPass::set_bending), 0 < share <= 1.
  /// If they are not all 1, energies are not those of Eq. 2, and neither certificates nor any method but kQuasiNewton and
  /// kMultiresolution may be asked for. Ends a running solve with kCancelled.
  void set_bending(const Field& shares);

  /// Makes `positions` the current state, from which InitialGuess::kCurrent starts. Errors: as check_positions.
  /// Ends a running solve with kCancelled.
  absl::Status set_positions(const Points& positions);
  /// Makes cell_energies() and the energies of summary() those of positions(), for the present handles and material. Without this
  /// call they stay those of the last solve, 0 if there was none, until the next one begins. Without handles, soft terms and footprints do
  /// not count. Ends a running solve with kCancelled.
  void measure();

  /// Only for coarse levels: moves the current state by `by`, in the caller's units, and the levels below it in the same way. Not
  /// during a solve.
  void displace(const Points& by);
  /// Only for coarse levels: CoarseLevel::least_energy() of the level below. nullopt if there is none.
  std::optional<double> least_energy(InitialGuess initial, std::stop_token stop);
  /// Only for coarse levels: CoarseLevel::lowest_energy() of the level below. E of this one if there is none.
  double lowest_energy() const;

  /// Begins a solve. Errors: FAILED_PRECONDITION (NO_HANDLES); INVALID_ARGUMENT (METHOD_NEEDS_P,
  /// METHOD_NEEDS_EXACT_HANDLES, TOLERANCE_OUT_OF_RANGE, ITERATIONS_OUT_OF_RANGE, TIME_LIMIT_OUT_OF_RANGE,
  /// EFFORT_OUT_OF_RANGE, LEAST_SHARE_OUT_OF_RANGE). `stop` is checked in every iteration.
  absl::Status start(const SolveSettings& settings, std::stop_token stop = {});
  /// Only for coarse levels: the same from positions(), as from the result of a coarse level (Warmth::kPrepared), with held vertices at
  /// their targets. settings.initial does not matter.
  absl::Status start_prepared(const SolveSettings& settings, std::stop_token stop = {});

  /// Whether the initial guess may be shown before the first iteration. After start(), positions() are that guess. It may in a drag of
  /// a large mesh with the same stiffness everywhere, without soft handles, locks or points held exactly. What decides is the guess's
  /// E^(1/2) at p = 2 over that of the state before the move. Where coarse levels lead, no p_i may be above 2, and the ratio is at most
  /// 1.2. Where the fine level goes alone, each p_i is 2, and the ratio is at most 1.1. E^(1/p) is then as a rule within a few percent
  /// of that after the first iteration.
  bool is_guess_smooth() const;

  /// Makes one iteration, or one step of a certificate. True while there is more to do; false when the summary is
  /// complete.
  bool step();

  /// Begins the certificate of positions(), which must be the result of a solve for the current inputs. step()
  /// continues it; when step() returns false, summary().optimality_gap has the result. Nothing else in the summary
  /// changes. Ends a running solve with kCancelled. FAILED_PRECONDITION (NOT_SOLVED). Starting anything else, or
  /// changing any input, ends the certificate without a result. If `stop` is requested, or after max_seconds, it ends
  /// with the best bound so far.
  absl::Status start_certificate(std::stop_token stop = {},
                                 double max_seconds = std::numeric_limits<double>::infinity());
  /// Whether the current steps are those of a certificate; positions() then do not change any more.
  bool is_certifying() const;

  static constexpr int kStartsOfEffort = 12;  // further starts for each unit of SolveSettings::effort
  /// Begins to look for minima lower than positions(), which must be the result of a solve for the current inputs, from as many
  /// further starts as SolveSettings::effort says. A second call goes on with other starts; on a mesh larger than
  /// DeformerOptions::search_up_to it repeats the one by the coarse levels. step() continues the search. When step() returns
  /// false, or a certificate or another search is started, better_energy() tells about what was found. positions() do not
  /// change. Limits of solves do not hold. Does nothing where a lower minimum cannot be. INVALID_ARGUMENT (EFFORT_OUT_OF_RANGE);
  /// FAILED_PRECONDITION (NOT_SOLVED). `stop` ends it.
  absl::Status start_search(int effort, std::stop_token stop = {});
  /// Whether a second call would go on with other starts.
  bool has_other_starts() const;
  /// Whether the current steps are those of such a search.
  bool is_searching() const;
  /// The true energy of the lowest minimum that searches have found for the current inputs, if it saves at least the share
  /// standing.least_share (of the settings of the last start()) of summary().energy, or of the energy of a shape that is reserved.
  std::optional<double> better_energy() const;
  /// Reserves that minimum: take_better() takes it, whatever a search finds meanwhile. Nothing changes if there is none.
  void reserve_better();
  /// Makes the reserved shape, or else the minimum of better_energy(), the current state: positions(), cell_energies() and the
  /// energies of summary(), which has no certificate then. Ends a search. False if there is none.
  bool take_better();

  /// Updates positions(), cell_energies() and summary() to the prolonged state of the coarse level of a running
  /// kMultiresolution, if that is better than the guess; otherwise does nothing. Later steps and the result do not
  /// change. Takes about as long as three iterations, or five while a graded level runs, and does nothing until four times that time has
  /// passed since it last did. With `is_last`, for a solve that will not go on, the state then depends on its steps alone, not on earlier
  /// calls or the time.
  void catch_up(bool is_last = false);

  /// Calls start, then step until the end.
  absl::StatusOr<SolveSummary> solve(const SolveSettings& settings, std::stop_token stop = {});

  /// The summary of the running or the last solve.
  const SolveSummary& summary() const;

  /// The best state of the running or the last solve, in the caller's units and vertex order; always finite.
  /// The rest positions before the first solve.
  const Points& positions() const;
  /// R_i at positions(), also of a running solve. Takes as long as an iteration.
  std::vector<Eigen::Matrix3d> rotations();
  /// E_i at positions(), in the caller's unit of length; 0 for unreferenced vertices.
  const Field& cell_energies() const;

  /// Bytes held while solving, without the shared rest shape. With what a solve takes again of a factor that it has freed.
  std::size_t memory_bytes() const;
  /// Bytes held between solves.
  std::size_t idle_memory_bytes() const;

 private:
  struct Impl;
  explicit Deformer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lpdeform
