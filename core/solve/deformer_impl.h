#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "core/certificate/certificate.h"
#include "core/methods/minimiser.h"
#include "core/methods/quasi_newton.h"
#include "core/multiresolution/coarse_level.h"
#include "core/solve/deformer.h"

namespace lpdeform {

/// The state of a Deformer, and the loop of a solve. Initial guesses are in deformer_guess.cc, everything else in
/// deformer_impl.cc.
struct Deformer::Impl {
  Impl(std::shared_ptr<const RestShape> rest_shape, DeformerOptions deformer_options, Metric first_metric,
       std::optional<CoarseMesh> first_coarse_mesh)
      : shape(std::move(rest_shape)),
        options(std::move(deformer_options)),
        objective(shape, Workers(shape->vertex_count() < options.parallel_from ? 1 : options.threads)),
        metric(std::move(first_metric)),
        coarse_mesh(std::move(first_coarse_mesh)),
        x(shape->scaled_positions()),
        best_energies(Field::Zero(shape->vertex_count())),
        positions(shape->positions()) {}

  double unit() const { return shape->mean_edge_length(); }
  const Workers& workers() const { return objective.cells().workers(); }
  double length_unit() const { return material.length_unit > 0 ? material.length_unit : unit(); }

  Points laplacian_guess();
  Points current_guess();
  SoftTerms guess_springs() const;
  Points initial_guess(InitialGuess guess);
  double typical_energy(const Points& guess);
  double rounding() const;
  double zero_objective() const;
  double zero_squares() const;
  bool is_best_zero() const;
  Problem make_problem();
  Method chosen_method(Method asked, bool is_warm);
  bool prepare_coarse();
  std::unique_ptr<Minimiser> make_minimiser(Method method, Points guess, Warmth warmth);
  Method second_method(Method asked, bool is_warm);
  std::unique_ptr<Minimiser> with_second(std::unique_ptr<Minimiser> first, const Points& guess);
  bool prepare_metric(bool needs_plain_weights);
  void keep_if_best(double sum);
  void keep(const Points& from, double sum);
  bool keep_rest_if_best();
  void catch_up();
  Material effective_material() const;
  void summarise();
  void record(const StepResult& result, double sum);
  void settle_methods();
  void begin(const SolveSettings& new_settings, std::stop_token new_stop);
  void iterate();
  void end(StopReason reason);
  void begin_certificate(double max_seconds);
  bool certify();
  void replace_constraints(Constraints next);
  double seconds() const;  // since `started`
  /// The factor's weights are not those that quasi_newton left any more.
  void forget_weights() { factor = std::min(factor, Factor::kUsable); }
  void interrupt() {
    certificate.reset();
    if (minimiser) end(StopReason::kCancelled);
  }
  void change_inputs() {
    interrupt();
    norm.reset();
  }

  std::shared_ptr<const RestShape> shape;
  DeformerOptions options;
  Objective objective;
  Metric metric;
  std::optional<CoarseMesh> coarse_mesh;  // of `coarse`, where it was made beforehand
  HandleSet handles;
  Material material;
  std::optional<Constraints> constraints;
  std::shared_ptr<const Points> outside;  // where vertices outside the region are held, in the caller's units

  // The state, in scaled units: the best of the last solve, or what was set.
  Points x;
  enum class State {
    kUntouched,    // nothing was solved or set: x are the rest positions
    kUndistorted,  // the last solve ended with no distortion: the next one begins as the first
    kDeformed,     // the next solve may go on from x
  };
  State state = State::kUntouched;
  Points x_before_move;  // when the last warm solve began; empty where there was none
  Field best_energies;   // E_i at x, the caller's units
  Points positions;      // x in the caller's units, made when asked for
  bool is_positions_current = true;

  enum class Factor {
    kOutdated,  // made for other soft terms or linear rows than the present ones
    kUsable,    // for the present ones, with any cell weights
    kQuasiNewton,  // and with the weights that quasi_newton left, for this material: a warm solve goes on with it
  };
  Factor factor = Factor::kUsable;

  // The running solve.
  SolveSettings settings;
  Warmth warmth = Warmth::kCold;
  Method second = Method::kAuto;  // tried after settings.method; kAuto: none
  std::stop_token stop;
  std::optional<LpNorm> norm;           // true norm, and the reference of the running solve
  std::unique_ptr<CoarseLevel> coarse;  // made when first needed
  std::unique_ptr<Minimiser> minimiser;
  std::unique_ptr<Certificate> certificate;  // runs after the minimiser has ended
  std::chrono::steady_clock::time_point started;
  double best_sum = 0, best_soft_sum = 0;
  int evaluations_before = 0, back_substitutions_before = 0;  // counts of this Deformer when the solve began
  SolveSummary summary;
};

}  // namespace lpdeform
