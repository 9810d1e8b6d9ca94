#include "core/solve/deformer_impl.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/methods/conic.h"
#include "core/methods/kinks.h"
#include "core/methods/line_search.h"
#include "core/methods/local_global.h"
#include "core/multiresolution/multiresolution.h"

namespace lpdeform {
namespace {

constexpr int kMostTogether = 12;          // fine iterations after a coarse level's, for which it leads on
constexpr double kCertificateSeconds = 1;  // it may take this long, even beyond the time limit
constexpr std::size_t kCopyChunk = 4096;   // vertices

using Clock = std::chrono::steady_clock;

}  // namespace

double Deformer::Impl::seconds() const {
  return std::chrono::duration<double>(Clock::now() - started).count();
}

/// The norm whose sum is that of the E_i^2 and D_k^2, in scaled units.
LpNorm Deformer::Impl::even_norm() const {
  return {Material::uniform(2), shape->vertex_count(), unit(), 1};
}

/// The largest E_i or D_k at the guess. As the reference length, it keeps terms of any p in range.
double Deformer::Impl::typical_energy(const Points& guess) {
  if (!is_guess_evaluated) objective.evaluate(guess, even_norm());
  const auto& e2 = objective.cells().squared_energies();
  const auto& d2 = objective.soft_terms().squared_distances();
  double largest = *std::max_element(e2.begin(), e2.end());
  if (!d2.empty()) largest = std::max(largest, *std::max_element(d2.begin(), d2.end()));
  largest = std::sqrt(largest);
  return largest > 1e-12 ? largest : 1.0;
}

/// The objective if every E_i is only rounding error.
double Deformer::Impl::zero_objective() const {
  const double e2 = rounding() * rounding();
  if (norm->is_uniform()) return shape->vertex_count() * norm->term(0, e2).value;
  double sum = 0;
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) sum += norm->term(i, e2).value;
  return sum;
}

double Deformer::Impl::zero_squares() const {
  return shape->vertex_count() * rounding() * rounding();
}

/// Whether the kept state has no distortion except rounding: see Problem::is_zero.
bool Deformer::Impl::is_best_zero() const {
  if (best_sum > zero_objective()) return false;
  return norm->lowest_p() == norm->highest_p() ||
         best_energies.squaredNorm() <= unit() * unit() * zero_squares();
}

Problem Deformer::Impl::make_problem() {
  return {objective,
          metric,
          *constraints,
          *norm,
          settings.tolerance,
          length_unit() / unit(),
          shape->diagonal() / unit(),
          zero_objective(),
          zero_squares(),
          stop};
}

std::unique_ptr<Minimiser> Deformer::Impl::make_minimiser(Method method, Points guess, Warmth warmth) {
  Problem problem = make_problem();
  switch (method) {
    case Method::kLineSearch:
      return std::make_unique<LineSearch>(std::move(problem), std::move(guess));
    case Method::kLocalGlobal:
      return std::make_unique<LocalGlobal>(std::move(problem), std::move(guess));
    case Method::kConic:
      return std::make_unique<Conic>(std::move(problem), std::move(guess));
    case Method::kMultiresolution:
      return std::make_unique<Multiresolution>(std::move(problem), std::move(guess), *coarse, 0, grading());
    case Method::kAuto:
    case Method::kQuasiNewton:
      break;
  }
  return std::make_unique<QuasiNewton>(std::move(problem), std::move(guess), warmth);
}

/// Factors the metric for the current handles with equal cell weights, unless there is a usable factor. False if that
/// fails.
bool Deformer::Impl::prepare_metric(bool needs_plain_weights) {
  if (metric.is_factored_for(constraints->is_held) && !needs_plain_weights) return true;
  std::vector<MatrixEntry> entries = guess_springs().matrix_entries();
  constraints->linear.add_ties(2, entries);
  const auto precision =
      constraints->linear.empty() ? Metric::Precision::kSingle : Metric::Precision::kDouble;
  return metric.factor(std::vector<double>(shape->vertex_count(), 1.0), constraints->is_held, entries,
                       workers(), precision);
}

/// The material including the footprints of handles.
Material Deformer::Impl::effective_material() const {
  const Field& factors = constraints->footprint;
  if (factors.size() == 0) return material;
  Material result = material;
  if (material.stiffness.size() == 1)
    result.stiffness = material.stiffness[0] * factors;
  else
    result.stiffness = material.stiffness.cwiseProduct(factors);
  return result;
}

/// For a drag back to the start: a thin shape that was compressed can stay in a dimple, which is a local minimum,
/// although the rest shape has no distortion at all. In this case keeps the rest shape.
bool Deformer::Impl::keep_rest_if_best() {
  if ((constraints->targets - shape->scaled_positions()).cwiseAbs().maxCoeff() > rounding()) return false;
  if (is_best_zero()) return false;
  const Points rest = initial_guess(InitialGuess::kRest);
  const double sum = objective.evaluate(rest, *norm);
  if (sum <= zero_objective()) {
    keep(rest, sum);
    return true;
  }
  objective.evaluate(x, *norm);  // the next solve reads the previous soft targets from it
  return false;
}

/// Keeps minimiser->x() if it is the best state so far. `objective` holds its evaluation; `sum` is its true sum.
void Deformer::Impl::keep_if_best(double sum) {
  const bool is_first = summary.iterations == 0;
  if (is_first || sum < best_sum) {
    best_step.reset();
    keep(minimiser->x(), sum);
  } else if (best_step && sum < best_step->sum) {
    best_step = KnownShape{minimiser->x(), sum};
  }
}

void Deformer::Impl::keep(const Points& from, double sum) {
  best_sum = std::isnan(sum) ? std::numeric_limits<double>::infinity() : sum;
  best_soft_sum = objective.soft_terms().sum(*norm);
  is_positions_current = false;
  const auto& e2 = objective.cells().squared_energies();
  x.resize(from.rows(), 3);
  workers().for_chunks(e2.size(), kCopyChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::copy(from.data() + 3 * begin, from.data() + 3 * end, x.data() + 3 * begin);
    for (std::size_t i = begin; i < end; ++i) best_energies[i] = unit() * std::sqrt(e2[i]);
  });
}

void Deformer::Impl::catch_up(bool is_last) {
  if (!minimiser) return;
  const std::optional<Points> found = minimiser->intermediate_state(is_last);
  if (!found) return;
  // A later look shows more of the shape to come, even if its kinks cost more than those of an earlier one.
  if (const double sum = objective.sum(*norm); sum < (best_step ? best_step->sum : best_sum)) {
    if (!best_step) best_step = KnownShape{x, best_sum};
    keep(*found, sum);
  }
  summarise();
}

/// Goes back to the best state that a step has reached.
void Deformer::Impl::forget_looks() {
  if (!best_step) return;
  objective.evaluate(best_step->x, *norm);
  keep(best_step->x, best_step->sum);
  best_step.reset();
}

void Deformer::Impl::summarise() {
  summary.energy = norm->true_energy(best_sum);
  summary.soft_energy = norm->true_energy(best_soft_sum);
  summary.solve_seconds = seconds();
  summary.evaluations = objective.evaluations() - evaluations_before;
  summary.back_substitutions = metric.back_substitutions() - back_substitutions_before;
  summary.factorisations = static_cast<int>(metric.version() - metric_before);
}

void Deformer::Impl::record(const StepResult& result, double sum) {
  summarise();
  if (!settings.keep_trace) return;
  summary.trace.push_back(
      {summary.iterations, summary.solve_seconds, norm->true_energy(sum), result.objective, result.stage});
}

void Deformer::Impl::begin(const SolveSettings& new_settings, std::stop_token new_stop, bool is_prepared) {
  started = Clock::now();
  settings = new_settings;
  stop = std::move(new_stop);
  energy_before = summary.energy;
  summary = {};
  summary.threads = workers().threads();
  lowest.reset();
  reserved.reset();
  next_start = 0;
  is_guess_smooth = false;
  evaluations_before = objective.evaluations();
  back_substitutions_before = metric.back_substitutions();
  metric_before = metric.version();
  const bool is_warm =
      !is_prepared && settings.initial == InitialGuess::kCurrent && state == State::kDeformed;
  if (!is_warm) {
    x_before_move.resize(0, 3);
    lead = Lead::kNone;
    usual_over_least.reset();
  }
  if (!settings.effort) settings.effort = default_effort(is_warm);
  summary.effort = *settings.effort;
  const bool keeps_metric =
      is_warm && factor == Factor::kQuasiNewton && metric.is_factored_for(constraints->is_held);
  warmth = keeps_metric  ? Warmth::kWithMetric
           : is_warm     ? Warmth::kWarm
           : is_prepared ? Warmth::kPrepared
                         : Warmth::kCold;
  bool is_factored = false;
  const auto make_coarse = [&] {
    settings.method = summary.method = chosen_method(settings.method, is_warm);
  };
  workers().run_both([&] { is_factored = prepare_metric(!is_warm || factor == Factor::kOutdated); },
                     make_coarse);
  summary.setup_seconds = seconds();

  started = Clock::now();
  is_guess_evaluated = false;
  Points guess = is_factored ? initial_guess(settings.initial) : constraints->targets;
  if (!guess.allFinite()) {
    is_guess_evaluated = is_guess_smooth = false;
    guess = constraints->targets;
    constraints->linear.satisfy(guess);
  }
  SoftTerms soft = constraints->soft;
  soft.set_length_unit(length_unit() / unit());
  objective.set_soft_terms(std::move(soft));
  const double typical = typical_energy(guess);
  if (is_guess_good_enough()) settings.method = summary.method = Method::kQuasiNewton;
  const double reference = settings.method == Method::kLineSearch ? length_unit() / unit() : typical;
  const auto set_norm = [&](double length) {
    norm.emplace(effective_material(), shape->vertex_count(), unit(), length);
    objective.reweigh(*norm);
  };
  set_norm(reference);
  const bool may_have_kinks = is_warm && settings.method == Method::kQuasiNewton && norm->highest_p() > 2;
  if (may_have_kinks && !is_at_targets(x) && ease_kinks(make_problem(), guess)) {
    is_guess_evaluated = true;
    set_norm(typical_energy(guess));
  }
  best_sum = std::numeric_limits<double>::infinity();
  minimiser = make_minimiser(settings.method, std::move(guess), warmth);
  // Also before the first step: the next move may come sooner.
  if (settings.method == Method::kMultiresolution) lead = Lead::kAhead;
  fine_iterations = 0;
  factor = settings.method == Method::kQuasiNewton ? Factor::kQuasiNewton : Factor::kUsable;
  const double sum = objective.sum(*norm);
  keep_if_best(sum);
  summary.initial_energy = norm->true_energy(sum);
  record({Outcome::kProgress, sum, 0}, sum);
  if (!is_factored) end(StopReason::kNumericalBreakdown);
}

void Deformer::Impl::iterate() {
  ++summary.iterations;
  if (search) return search_on();
  const StepResult result = minimiser->step();
  const bool is_ahead = settings.method == Method::kMultiresolution && result.stage == 0;
  if (!is_ahead) ++fine_iterations;
  // After many iterations of a first move, x has left the coarse level's shape.
  if (is_ahead)
    lead = Lead::kAhead;
  else if (settings.method == Method::kMultiresolution)
    lead = fine_iterations > kMostTogether ? Lead::kNone : Lead::kTogether;
  double sum = result.true_sum ? *result.true_sum : objective.sum(*norm);
  keep_if_best(sum);
  const bool is_over = result.outcome == Outcome::kConverged || result.outcome == Outcome::kStalled;
  if (is_over && warmth != Warmth::kCold && keep_rest_if_best()) sum = best_sum;
  record(result, sum);
  switch (result.outcome) {
    case Outcome::kProgress:
      return;
    case Outcome::kConverged:
      return settle(StopReason::kConverged);
    case Outcome::kStalled:
      return settle(StopReason::kStalled);
    case Outcome::kBreakdown:
      return end(StopReason::kNumericalBreakdown);
  }
}

/// The minimiser has converged or stalled: goes on with the search for lower minima, if one is wanted.
void Deformer::Impl::settle(StopReason reason) {
  end_minimiser(reason);
  summary.minima.push_back(summary.energy);
  const int starts = further_starts();
  is_search_apart = false;
  if (starts > 0) begin_search(starts);
  if (!search) conclude();
}

void Deformer::Impl::end_minimiser(StopReason reason) {
  const bool has_settled = reason == StopReason::kConverged || reason == StopReason::kStalled;
  if (has_settled && !is_coarse()) lead = Lead::kNone;
  // Who cancels is in a hurry; every other result must not depend on whether somebody has looked on.
  const bool is_last = reason != StopReason::kCancelled;
  if (is_last) forget_looks();
  catch_up(is_last);
  best_step.reset();
  // Before convergence the metric may still be that of the guess.
  if (settings.method == Method::kMultiresolution && reason == StopReason::kConverged)
    factor = Factor::kQuasiNewton;
  else if (settings.method == Method::kMultiresolution)
    forget_weights();
  minimiser.reset();
  state = is_best_zero() ? State::kUndistorted : State::kDeformed;
  summary.stop_reason = reason;
  summary.solve_seconds = seconds();
}

/// Ends the running solve because of a limit or because it was cancelled.
void Deformer::Impl::end(StopReason reason) {
  if (minimiser) end_minimiser(reason);
  if (search) end_search();
  if (reason == StopReason::kCancelled)
    summary.stop_reason = reason;
  else
    conclude();
}

/// Goes on with the certificate, if one is wanted.
void Deformer::Impl::conclude() {
  if (!settings.certify) return;
  const double rest = settings.time_limit_seconds - summary.solve_seconds;
  begin_certificate(std::max(kCertificateSeconds, rest));
}

void Deformer::Impl::begin_certificate(double max_seconds) {
  forget_weights();  // the certificate factors for itself
  objective.evaluate(x, *norm);
  certificate =
      std::make_unique<Certificate>(make_problem(), x, CertificateSettings{.max_seconds = max_seconds});
}

bool Deformer::Impl::certify() {
  if (certificate->step()) return true;
  summary.optimality_gap = certificate->relative_gap();
  certificate.reset();
  return false;
}

/// Replaces the constraints. Keeps factorisations if only targets have changed.
void Deformer::Impl::replace_constraints(Constraints next) {
  if (constraints) {
    const bool has_footprint_of_before =
        next.footprint.size() == constraints->footprint.size() && next.footprint == constraints->footprint;
    const bool has_rows_of_before =
        next.linear.reuse(constraints->linear) && next.soft.has_rows_of(constraints->soft);
    if (!has_footprint_of_before) forget_weights();
    if (!has_rows_of_before) factor = Factor::kOutdated;
    if (!has_footprint_of_before || !has_rows_of_before || next.is_held != constraints->is_held)
      lead = Lead::kNone;
  }
  constraints = std::move(next);
  largest_target = constraints->targets.cwiseAbs().maxCoeff();
}

}  // namespace lpdeform
