#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/geometry.h"
#include "core/base/workers.h"
#include "core/certificate/certificate.h"
#include "core/methods/minima_search.h"
#include "core/methods/minimiser.h"
#include "core/methods/quasi_newton.h"
#include "core/multiresolution/coarse_level.h"
#include "core/multiresolution/multiresolution.h"
#include "core/solve/deformer.h"

namespace lpdeform {

constexpr std::size_t kRowChunk = 4096;  // vertices

/// Calls body(i) for each row of `points`, in parallel.
template <typename Body>
void for_rows(const Points& points, const Workers& workers, const Body& body) {
  workers.for_chunks(static_cast<std::size_t>(points.rows()), kRowChunk,
                     [&](std::size_t, std::size_t begin, std::size_t end) {
                       for (auto i = static_cast<Eigen::Index>(begin); i < static_cast<Eigen::Index>(end);
                            ++i)
                         body(i);
                     });
}

/// The state of a Deformer, and the loop of a solve. Initial guesses are in deformer_guess.cc, what has to do with coarse levels in
/// deformer_levels.cc, the search for lower minima in deformer_search.cc, and everything else in deformer_impl.cc.
struct Deformer::Impl {
  Impl(std::shared_ptr<const RestShape> rest_shape, DeformerOptions deformer_options,
       Objective first_objective, Metric first_metric, std::optional<CoarseMesh> first_coarse_mesh)
      : shape(std::move(rest_shape)),
        options(std::move(deformer_options)),
        objective(std::move(first_objective)),
        metric(std::move(first_metric)),
        coarse_mesh(std::move(first_coarse_mesh)),
        x(shape->scaled_positions()),
        best_energies(Field::Zero(shape->vertex_count())),
        positions(shape->positions()) {}

  static constexpr std::int32_t kLargeMesh = 5000;  // vertices from which on a coarse level pays off
  /// A guess whose E^(1/2) is at most this many times that of the lowest level needs no coarse level.
  static constexpr double kMostOverLeast = 1.8;

  static constexpr double kRounding = 1e-13;  // relative to the largest coordinate, in scaled units

  double unit() const { return shape->mean_edge_length(); }
  const Workers& workers() const { return objective.cells().workers(); }
  double length_unit() const { return material.length_unit > 0 ? material.length_unit : unit(); }

  Points laplacian_guess();
  Points fitted(const Points& moved, Points forces) const;
  template <typename Motion>
  Points turning_forces(const Motion& motion);
  Points continued(Points forces);
  double most_over_least();
  std::optional<Points> guess_alone(double most_over);
  Points current_guess();
  std::optional<Points> led_guess();
  void follow(const Points& guess);
  bool compares_at_p() const;
  bool is_good(double led, double other) const;
  bool is_as_good_as_before(const Points& led);
  bool is_led_near_lowest(const Points& led, bool is_refused);
  bool may_be_shown(double sum) const;
  bool are_cells_alike() const;
  void begin_move();
  bool is_at_targets(const Points& from) const;
  Points go_with(Points led);
  FineInputs coarse_inputs(const Material& effective) const;
  SoftTerms guess_springs() const;
  Points initial_guess(InitialGuess guess);
  LpNorm even_norm() const;
  double typical_energy(const Points& guess);
  /// The rounding error of a length.
  double rounding() const { return kRounding * (1 + largest_target); }
  double zero_objective() const;
  double zero_squares() const;
  bool is_best_zero() const;
  Problem make_problem();
  bool can_judge_guesses() const;
  bool can_compare_guesses() const;
  double over_least(double least) const;
  bool is_guess_good_enough() const;
  Method chosen_method(Method asked, bool is_warm);
  MakeLevelSolver level_maker(bool is_graded) const;
  std::optional<Grading> grading() const;
  bool make_coarse();
  bool prepare_coarse();
  std::unique_ptr<Minimiser> make_minimiser(Method method, Points guess, Warmth warmth);
  bool prepare_metric(bool needs_plain_weights);
  void keep_if_best(double sum);
  void keep(const Points& from, double sum);
  bool keep_rest_if_best();
  void catch_up(bool is_last);
  void forget_looks();
  Material effective_material() const;
  void summarise();
  void record(const StepResult& result, double sum);
  void begin(const SolveSettings& new_settings, std::stop_token new_stop, bool is_prepared);
  void iterate();
  void settle(StopReason reason);
  void end_minimiser(StopReason reason);
  void end(StopReason reason);
  void conclude();
  bool is_large() const { return shape->vertex_count() > options.search_up_to; }
  int default_effort(bool is_warm) const;
  int further_starts() const;
  Points displaced(const Points& from, int number) const;
  std::unique_ptr<Minimiser> make_start(int number, const Points& guess, const Points& lowest);
  bool is_by_coarse_levels(int start) const;
  std::unique_ptr<Minimiser> make_coarse_start(const Points& guess);
  void begin_search(int starts);
  void search_on();
  void end_search();
  void restore_metric();
  /// A state for the present inputs.
  struct KnownShape {
    Points x;
    double sum;  // true sum
  };
  std::shared_ptr<const KnownShape> better() const;
  void take(const KnownShape& shape);
  void begin_certificate(double max_seconds);
  bool certify();
  void replace_constraints(Constraints next);
  double seconds() const;  // since `started`
  /// The factor's weights are not those that quasi_newton left any more.
  void forget_weights() { factor = std::min(factor, Factor::kUsable); }
  /// Whether this is a coarse level that bends like a finer one. Such levels go on together with theirs.
  bool is_coarse() const { return least_bending() < 1; }
  double least_bending() const { return bending.minCoeff(); }
  void interrupt() {
    certificate.reset();
    if (search && is_search_apart)
      end_search();
    else if (search || minimiser)
      end(StopReason::kCancelled);
  }
  void change_inputs() {
    interrupt();
    lowest.reset();
    reserved.reset();
    next_start = 0;
    norm.reset();
  }

  std::shared_ptr<const RestShape> shape;
  DeformerOptions options;
  Objective objective;
  Metric metric;
  std::optional<CoarseMesh> coarse_mesh;  // of `coarse`, where it was made beforehand
  HandleSet handles;
  Material material;
  Field bending = Field::Ones(1);  // see set_bending()
  std::optional<Constraints> constraints;
  double largest_target = 0;              // the largest coordinate of its targets
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
  bool is_guess_evaluated = false;  // whether `objective` holds the evaluation of the last initial_guess()
  std::stop_token stop;
  std::optional<LpNorm> norm;             // true norm, and the reference of the running solve
  std::unique_ptr<CoarseLevel> coarse;    // made when first needed
  std::optional<double> least_of_lowest;  // E of the lowest level; see is_guess_good_enough()
  enum class Lead {
    kNone,   // the coarse level's state has nothing to do with x
    kAhead,  // it is for the same inputs, but x is at most a look at it (Multiresolution::intermediate_state)
    kTogether,  // it is for the same inputs, and has come as far as x
  };
  Lead lead = Lead::kNone;
  bool is_coarsest = false;      // the coarse level could not be made
  bool goes_alone = false;       // the guess of the running or the last solve is that of guess_alone()
  bool is_close = false;         // and its E^(1/p) is little above that of the lowest level, or as usual
  bool is_guess_smooth = false;  // see Deformer::is_guess_smooth()
  int moves_to_lead = 0;         // by the coarse levels, before guess_alone() is tried again
  int refused = 0;               // guesses of the coarse levels in a row; see current_guess()
  int fine_iterations = 0;       // of the running solve
  double energy_before = 0;      // E at the end of the solve before it
  // E^(1/p) at the end of the last move that had time, over that of the lowest level; see can_compare_guesses().
  std::optional<double> usual_over_least;
  std::unique_ptr<Minimiser> minimiser;
  std::unique_ptr<MinimaSearch> search;      // runs after the minimiser has ended
  bool is_search_apart = false;              // its result goes to `lowest`, not to x
  int search_stage = 0;                      // of its records
  int next_start = 0;                        // of the next search for the same inputs
  std::shared_ptr<const KnownShape> lowest;  // minimum that searches apart have found, if it was lower than x
  std::shared_ptr<const KnownShape> reserved;  // see Deformer::reserve_better()
  std::unique_ptr<Certificate> certificate;    // runs after the minimiser and the search have ended
  std::chrono::steady_clock::time_point started;
  double best_sum = 0, best_soft_sum = 0;
  std::optional<KnownShape> best_step;  // while x is a better state, which catch_up() has found
  int evaluations_before = 0, back_substitutions_before = 0;  // counts of this Deformer when the solve began
  std::uint64_t metric_before = 0;                            // its version then
  SolveSummary summary;
};

}  // namespace lpdeform
