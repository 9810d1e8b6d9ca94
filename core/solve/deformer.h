#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
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
  int threads = 1;
  /// Smaller meshes are computed by the calling thread alone: threads would cost them more than they bring.
  std::int32_t parallel_from = 8000;  // vertices
  /// Asked once, when it is known how much memory a solve takes and before it is taken; its error is create()'s.
  std::function<absl::Status(std::size_t bytes)> admit = {};
};

/// One mesh being deformed: handles, material, the present state and the factorisations that go with them.
/// Inputs may be changed at any time between steps; each change takes effect whole or not at all. Not
/// thread-safe: one caller at a time, which may be a different thread each time.
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

  /// Replaces all handles and the region of interest; where that is another one, what is outside of it is held at
  /// positions() as they are now. Numeric refactorisation where the set of held vertices changed, none where handles
  /// only moved. Errors: as make_constraints. Ends a running solve with kCancelled.
  absl::Status set_handles(const HandleSet& handles);

  /// Errors: as check_material. Ends a running solve with kCancelled.
  absl::Status set_material(const Material& material);

  /// Makes `positions` the present state, from which InitialGuess::kCurrent goes on. INVALID_ARGUMENT:
  /// POSITIONS_SIZE, POSITIONS_NOT_FINITE. Ends a running solve with kCancelled.
  absl::Status set_positions(const Points& positions);

  /// Begins a solve. Errors: FAILED_PRECONDITION (NO_HANDLES); INVALID_ARGUMENT (METHOD_NEEDS_P, METHOD_NEEDS_EXACT_HANDLES,
  /// TOLERANCE_OUT_OF_RANGE, ITERATIONS_OUT_OF_RANGE, TIME_LIMIT_OUT_OF_RANGE). `stop` is looked at in every
  /// iteration.
  absl::Status start(const SolveSettings& settings, std::stop_token stop = {});

  /// One iteration, or one step of the certificate where one is under way. True while there is more to do; false once
  /// the summary is whole.
  bool step();

  /// Begins the certificate of positions(), the result of a solve for the present inputs: step() goes on with it, and once that
  /// returns false summary().optimality_gap has it. Nothing else of the summary changes. Ends a running solve with
  /// kCancelled. FAILED_PRECONDITION (NOT_SOLVED). Starting anything and changing any input ends it without a result;
  /// where `stop` is requested, or after max_seconds, it ends with what it has.
  absl::Status start_certificate(std::stop_token stop = {},
                                 double max_seconds = std::numeric_limits<double>::infinity());
  /// The steps under way are those of a certificate: positions() do not change any more.
  bool is_certifying() const;

  /// Brings positions(), cell_energies() and summary() up to what the coarse level of a running kMultiresolution has found,
  /// where that is better than the guess; else does nothing. The steps that follow, and the result, are the same. Takes
  /// about as long as two iterations, and does nothing where the coarse level has not gone on much since the last call.
  void catch_up();

  /// start, then step until the end.
  absl::StatusOr<SolveSummary> solve(const SolveSettings& settings, std::stop_token stop = {});

  /// Of the running or the last solve.
  const SolveSummary& summary() const;

  /// The best state of the running or the last solve, in the caller's units and vertex order; always finite.
  /// The rest positions before the first solve.
  const Points& positions() const;
  /// E_i at positions(), in the caller's unit of length; 0 for unreferenced vertices.
  const Field& cell_energies() const;

  /// Bytes held while solving, the shared rest shape left out.
  std::size_t memory_bytes() const;

 private:
  struct Impl;
  explicit Deformer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lpdeform
