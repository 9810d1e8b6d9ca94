#include "core/solve/deformer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/solve/certificate.h"
#include "core/solve/check_settings.h"
#include "core/solve/conic.h"
#include "core/solve/holds.h"
#include "core/solve/line_search.h"
#include "core/solve/local_global.h"
#include "core/solve/multiresolution.h"
#include "core/solve/quasi_newton.h"

namespace lpdeform {
namespace {

constexpr double kCertificateSeconds = 1;  // it gets, whatever is left of the time limit
constexpr std::size_t kWorkspace =
    24;  // positions of all vertices that a solve holds at most: the memory of L-BFGS
constexpr std::size_t kCopyChunk = 4096;     // vertices
constexpr std::int32_t kLargeMesh = 5000;    // vertices, from which on a coarse level pays
constexpr std::int32_t kLargeAtTwo = 60000;  // the same where every p is 2: there is less to gain
constexpr double kFarthestGuess = 2;         // of the last move, how much more of it is guessed at most
constexpr double kSameWay = 0.5;  // the squared cosine between two moves, from which on they are one drag
constexpr double kSteady =
    9;  // the square of how far the surface may have moved, in handles' moves, in such a drag
constexpr double kRounding = 1e-13;  // of the largest coordinate, in scaled units

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

int threads_for(const RestShape& shape, const DeformerOptions& options) {
  return shape.vertex_count() < options.parallel_from ? 1 : options.threads;
}

}  // namespace

struct Deformer::Impl {
  Impl(std::shared_ptr<const RestShape> rest_shape, DeformerOptions deformer_options)
      : shape(std::move(rest_shape)),
        options(deformer_options),
        objective(shape, Workers(threads_for(*shape, deformer_options))),
        metric(shape),
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
  double zero_objective() const;
  Problem make_problem();
  Method chosen_method(Method asked, bool is_warm);
  bool prepare_coarse();
  std::unique_ptr<Minimiser> make_minimiser(Method method, Points guess, Warmth warmth);
  bool prepare_metric(bool needs_plain_weights);
  void keep_if_best(double sum);
  Material effective_material() const;
  void record(const StepResult& result, double sum);
  void begin(const SolveSettings& new_settings, std::stop_token new_stop);
  void iterate();
  void end(StopReason reason);
  void begin_certificate(double max_seconds);
  bool certify();
  void replace_constraints(Constraints next);
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
  HandleSet handles;
  Material material;
  std::optional<Constraints> constraints;
  std::shared_ptr<const Points> outside;  // where the region's surroundings are held, the caller's units

  // The state, in scaled units: the best of the last solve, or what was set.
  Points x;
  Points x_before_move;  // when the last warm solve began; empty where there was none
  bool has_state = false;
  bool is_metric_of_rows = true;  // the last factor knows the present soft terms and linear rows
  bool is_metric_live = false;    // the last factor is quasi_newton's, for this material
  Field best_energies;            // E_i at x, the caller's units
  Points positions;               // x in the caller's units, made when asked for
  bool is_positions_current = true;

  // The running solve.
  SolveSettings settings;
  std::stop_token stop;
  std::optional<LpNorm> norm;           // true norm, and the reference of the running solve
  std::unique_ptr<CoarseLevel> coarse;  // made when first needed
  std::unique_ptr<Minimiser> minimiser;
  std::unique_ptr<Certificate> certificate;  // under way, after the minimiser's end
  Clock::time_point started;
  double best_sum = 0, best_soft_sum = 0;
  SolveSummary summary;
};

/// The soft terms as springs beside cells of weight 1 (p = 2), at the rest shape with held vertices at their
/// targets.
SoftTerms Deformer::Impl::guess_springs() const {
  SoftTerms springs = constraints->soft;
  springs.evaluate(constraints->targets, LpNorm(Material::uniform(2), shape->vertex_count(), unit(), 1));
  return springs;
}

/// x = rest + u with u the harmonic extension of the handles' displacements: the solution of the naive
/// Laplacian system L x = L p with the handles' positions given; soft terms as springs in it.
Points Deformer::Impl::laplacian_guess() {
  Points u = constraints->targets - shape->scaled_positions();
  Points forces = Points::Zero(u.rows(), 3);
  guess_springs().add_gradient(forces);
  forces = -forces;
  metric.extend(constraints->is_held, u, workers(), &forces);
  return shape->scaled_positions() + u;
}

/// A drag goes on as it went: where the handles move about as they did the last time, by `share` of it, the
/// surface does too. What is left of the handles' move, and that of soft targets, is extended harmonically.
Points Deformer::Impl::current_guess() {
  Points last = std::exchange(x_before_move, x);
  last = last.rows() == x.rows() ? Points(x - last) : Points(Points::Zero(x.rows(), 3));
  Points u = Points::Zero(x.rows(), 3), forces = u;
  double along = 0, size = 0, left = 0, longest = 0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (!constraints->is_held[i]) continue;
    u.row(i) = constraints->targets.row(i) - x.row(i);
    along += u.row(i).dot(last.row(i));
    size += last.row(i).squaredNorm();
    longest = std::max(longest, last.row(i).squaredNorm());
    left += u.row(i).squaredNorm();
  }
  const SoftTerms& before = objective.soft_terms();
  if (constraints->soft.has_rows_of(before)) constraints->soft.add_pull(before, forces);
  if (left == 0 && forces.isZero(0)) return x;
  const double share = size > 0 ? along / size : 0;
  const bool goes_on = share > 0 && share < kFarthestGuess && along * along > kSameWay * size * left &&
                       last.rowwise().squaredNorm().maxCoeff() < kSteady * longest;
  if (goes_on) {
    forces.setZero();  // what is soft goes along
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      if (constraints->is_held[i]) u.row(i) -= share * last.row(i);
    }
  }
  metric.extend(constraints->is_held, u, workers(), &forces, false);
  if (goes_on) u += share * last;
  return x + u;
}

Points Deformer::Impl::initial_guess(InitialGuess guess) {
  Points result;
  if (guess == InitialGuess::kRest)
    result = constraints->targets;
  else if (guess == InitialGuess::kCurrent && has_state)
    result = current_guess();
  else
    result = laplacian_guess();
  // Held vertices are at their targets exactly, whatever the solve rounded to.
  for (Eigen::Index i = 0; i < result.rows(); ++i) {
    if (constraints->is_held[i]) result.row(i) = constraints->targets.row(i);
  }
  constraints->linear.satisfy_within(metric, result, workers());
  return result;
}

/// The largest E_i or D_k at the guess: the reference length that keeps terms of any p in range.
double Deformer::Impl::typical_energy(const Points& guess) {
  objective.evaluate(guess, LpNorm(Material::uniform(2), shape->vertex_count(), unit(), 1));
  const auto& e2 = objective.cells().squared_energies();
  const auto& d2 = objective.soft_terms().squared_distances();
  double largest = *std::max_element(e2.begin(), e2.end());
  if (!d2.empty()) largest = std::max(largest, *std::max_element(d2.begin(), d2.end()));
  largest = std::sqrt(largest);
  return largest > 1e-12 ? largest : 1.0;
}

/// The objective where every E_i is what rounding leaves of it.
double Deformer::Impl::zero_objective() const {
  const double rounding = kRounding * (1 + constraints->targets.cwiseAbs().maxCoeff());
  double sum = 0;
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) sum += norm->term(i, rounding * rounding).value;
  return sum;
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
          stop};
}

/// Makes the coarse level where there is none. False where the mesh cannot have one, or the handles are not known
/// to it.
bool Deformer::Impl::prepare_coarse() {
  const bool has_footprint = constraints->footprint.size() > 0;
  if (!holds_vertices_exactly(handles) || has_footprint) return false;  // it knows no other kind of handle
  if (!coarse) coarse = CoarseLevel::create(*shape, workers().threads());
  return coarse && coarse->take_over(*shape, handles, *constraints, material).ok();
}

Method Deformer::Impl::chosen_method(Method asked, bool is_warm) {
  if (asked == Method::kAuto) {
    const std::int32_t large = (material.p.array() == 2).all() ? kLargeAtTwo : kLargeMesh;
    asked = is_warm || shape->vertex_count() < large ? Method::kQuasiNewton : Method::kMultiresolution;
  }
  if (asked != Method::kMultiresolution || (!is_warm && prepare_coarse())) return asked;
  return Method::kQuasiNewton;
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
      return std::make_unique<Multiresolution>(std::move(problem), std::move(guess), *coarse);
    case Method::kAuto:
    case Method::kQuasiNewton:
      break;
  }
  return std::make_unique<QuasiNewton>(std::move(problem), std::move(guess), warmth);
}

/// Factors for the present handles with equal cell weights, unless a usable factor is there. False where that
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

/// With the footprints of handles.
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

/// Called with the evaluation of minimiser->x() in `objective`, and its true sum.
void Deformer::Impl::keep_if_best(double sum) {
  const bool is_first = summary.iterations == 0;
  if (!is_first && !(sum < best_sum)) return;
  best_sum = std::isnan(sum) ? std::numeric_limits<double>::infinity() : sum;
  best_soft_sum = objective.soft_terms().sum(*norm);
  is_positions_current = false;
  const auto& e2 = objective.cells().squared_energies();
  const Points& from = minimiser->x();
  x.resize(from.rows(), 3);
  workers().for_chunks(e2.size(), kCopyChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::copy(from.data() + 3 * begin, from.data() + 3 * end, x.data() + 3 * begin);
    for (std::size_t i = begin; i < end; ++i) best_energies[i] = unit() * std::sqrt(e2[i]);
  });
}

void Deformer::Impl::record(const StepResult& result, double sum) {
  summary.energy = norm->true_energy(best_sum);
  summary.soft_energy = norm->true_energy(best_soft_sum);
  summary.solve_seconds = seconds_since(started);
  if (!settings.keep_trace) return;
  summary.trace.push_back(
      {summary.iterations, summary.solve_seconds, norm->true_energy(sum), result.objective, result.stage});
}

void Deformer::Impl::begin(const SolveSettings& new_settings, std::stop_token new_stop) {
  started = Clock::now();
  settings = new_settings;
  stop = std::move(new_stop);
  summary = {};
  summary.threads = workers().threads();
  const bool is_warm = settings.initial == InitialGuess::kCurrent && has_state;
  if (!is_warm) x_before_move.resize(0, 3);
  settings.method = summary.method = chosen_method(settings.method, is_warm);
  const bool keeps_metric =
      is_warm && is_metric_live && is_metric_of_rows && metric.is_factored_for(constraints->is_held);
  const bool is_factored = prepare_metric(!is_warm || !is_metric_of_rows);
  is_metric_of_rows = true;
  summary.setup_seconds = seconds_since(started);

  started = Clock::now();
  Points guess = is_factored ? initial_guess(settings.initial) : constraints->targets;
  if (!guess.allFinite()) {
    guess = constraints->targets;
    constraints->linear.satisfy(guess);
  }
  SoftTerms soft = constraints->soft;
  soft.set_length_unit(length_unit() / unit());
  objective.set_soft_terms(std::move(soft));
  const double typical = typical_energy(guess);
  const double reference = settings.method == Method::kLineSearch ? length_unit() / unit() : typical;
  norm.emplace(effective_material(), shape->vertex_count(), unit(), reference);
  objective.reweigh(*norm);  // typical_energy has evaluated the guess
  best_sum = std::numeric_limits<double>::infinity();
  const Warmth warmth = keeps_metric ? Warmth::kWithMetric : is_warm ? Warmth::kWarm : Warmth::kCold;
  minimiser = make_minimiser(settings.method, std::move(guess), warmth);
  is_metric_live = settings.method == Method::kQuasiNewton;
  const double sum = objective.sum(*norm);
  keep_if_best(sum);
  summary.initial_energy = norm->true_energy(sum);
  record({Outcome::kProgress, sum, 0}, sum);
  if (!is_factored) end(StopReason::kNumericalBreakdown);
}

void Deformer::Impl::iterate() {
  const StepResult result = minimiser->step();
  ++summary.iterations;
  const double sum = result.is_true ? result.objective : objective.sum(*norm);
  keep_if_best(sum);
  record(result, sum);
  switch (result.outcome) {
    case Outcome::kProgress:
      return;
    case Outcome::kConverged:
      return end(StopReason::kConverged);
    case Outcome::kStalled:
      return end(StopReason::kStalled);
    case Outcome::kBreakdown:
      return end(StopReason::kNumericalBreakdown);
  }
}

void Deformer::Impl::end(StopReason reason) {
  // Before its end the metric may still be that of the guess.
  if (settings.method == Method::kMultiresolution) is_metric_live = reason == StopReason::kConverged;
  minimiser.reset();
  has_state = true;
  summary.stop_reason = reason;
  summary.solve_seconds = seconds_since(started);
  if (!settings.certify || reason == StopReason::kCancelled) return;
  const double rest = settings.time_limit_seconds - summary.solve_seconds;
  begin_certificate(std::max(kCertificateSeconds, rest));
}

void Deformer::Impl::begin_certificate(double max_seconds) {
  is_metric_live = false;  // the certificate factors for itself
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

/// Keeps what is factored where only targets changed.
void Deformer::Impl::replace_constraints(Constraints next) {
  if (constraints) {
    const bool has_footprint_of_before =
        next.footprint.size() == constraints->footprint.size() && next.footprint == constraints->footprint;
    const bool has_rows_of_before =
        next.linear.reuse(constraints->linear) && next.soft.has_rows_of(constraints->soft);
    if (!has_footprint_of_before) is_metric_live = false;
    is_metric_of_rows = is_metric_of_rows && has_rows_of_before;
  }
  constraints = std::move(next);
}

Deformer::Deformer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Deformer::~Deformer() = default;

absl::StatusOr<std::unique_ptr<Deformer>> Deformer::create(std::shared_ptr<const RestShape> shape,
                                                           DeformerOptions options) {
  if (shape == nullptr) return invalid_input({"NO_SHAPE", "", ""}, "no rest shape was given");
  if (options.threads < 1 || options.threads > 1024) {
    return invalid_input({"THREADS_OUT_OF_RANGE", "threads", "1 <= threads <= 1024"},
                         absl::StrCat("threads is ", options.threads, "; it must be from 1 to 1024"));
  }
  return std::unique_ptr<Deformer>(new Deformer(std::make_unique<Impl>(std::move(shape), options)));
}

const RestShape& Deformer::shape() const {
  return *impl_->shape;
}
const HandleSet& Deformer::handles() const {
  return impl_->handles;
}
const Material& Deformer::material() const {
  return impl_->material;
}
const SolveSummary& Deformer::summary() const {
  return impl_->summary;
}
const Field& Deformer::cell_energies() const {
  return impl_->best_energies;
}

absl::Status Deformer::set_handles(const HandleSet& handles) {
  Impl& self = *impl_;
  std::shared_ptr<const Points> outside;
  if (handles.region() != nullptr) {
    outside = handles.has_region_of(self.handles) ? self.outside : std::make_shared<Points>(positions());
  }
  auto constraints = make_constraints(*self.shape, handles, self.options.free_components, outside.get());
  if (!constraints.ok()) return constraints.status();
  self.change_inputs();
  positions();  // the present ones go with the constraints before
  self.handles = handles;
  self.outside = std::move(outside);
  self.replace_constraints(*std::move(constraints));
  return absl::OkStatus();
}

absl::Status Deformer::set_material(const Material& material) {
  if (absl::Status status = check_material(material, impl_->shape->vertex_count()); !status.ok())
    return status;
  impl_->change_inputs();
  impl_->material = material;
  impl_->is_metric_live = false;
  return absl::OkStatus();
}

absl::Status Deformer::set_positions(const Points& positions) {
  const std::int32_t n = impl_->shape->vertex_count();
  if (positions.rows() != n) {
    return invalid_input({"POSITIONS_SIZE", "positions", absl::StrCat(n, " positions")},
                         absl::StrCat("there are ", positions.rows(), " positions for ", n, " vertices"));
  }
  const double farthest = kFarthestTarget * impl_->shape->diagonal();
  for (Eigen::Index i = 0; i < n; ++i) {
    if ((positions.row(i) - impl_->shape->centre()).stableNorm() <= farthest) continue;
    return invalid_input(
        {"POSITIONS_NOT_FINITE", absl::StrCat("vertex ", i), "1e9 diagonals of the mesh"},
        absl::StrCat("the position of vertex ", i, " is not finite, or over 1e9 diagonals of the mesh away"));
  }
  impl_->change_inputs();
  impl_->x_before_move.resize(0, 3);
  impl_->x = (positions.rowwise() - impl_->shape->centre()) / impl_->unit();
  impl_->positions = positions;
  impl_->is_positions_current = true;
  impl_->has_state = true;
  return absl::OkStatus();
}

absl::Status Deformer::start(const SolveSettings& settings, std::stop_token stop) {
  Impl& self = *impl_;
  if (absl::Status status = check_settings(settings, self.material); !status.ok()) return status;
  if (!self.constraints) {
    return make_fault(absl::StatusCode::kFailedPrecondition, {"NO_HANDLES", "", "at least 1 handle"},
                      "there is no handle; a deformation needs at least one");
  }
  if (absl::Status status = check_method_takes(settings.method, self.handles); !status.ok()) return status;
  self.interrupt();
  self.begin(settings, std::move(stop));
  return absl::OkStatus();
}

bool Deformer::step() {
  Impl& self = *impl_;
  if (self.certificate) return self.certify();
  if (!self.minimiser) return false;
  if (self.stop.stop_requested())
    self.end(StopReason::kCancelled);
  else if (seconds_since(self.started) >= self.settings.time_limit_seconds)
    self.end(StopReason::kTimeLimit);
  else if (self.summary.iterations >= self.settings.max_iterations)
    self.end(StopReason::kIterationLimit);
  else
    self.iterate();
  return self.minimiser != nullptr || self.certificate != nullptr;
}

absl::Status Deformer::start_certificate(std::stop_token stop, double max_seconds) {
  Impl& self = *impl_;
  self.interrupt();
  if (!self.norm) {
    return make_fault(absl::StatusCode::kFailedPrecondition, {"NOT_SOLVED", "", ""},
                      "there was no solve for the present inputs; a certificate is that of a result");
  }
  self.stop = std::move(stop);
  self.begin_certificate(max_seconds);
  return absl::OkStatus();
}

bool Deformer::is_certifying() const {
  return impl_->certificate != nullptr;
}

absl::StatusOr<SolveSummary> Deformer::solve(const SolveSettings& settings, std::stop_token stop) {
  if (absl::Status status = start(settings, std::move(stop)); !status.ok()) return status;
  while (step()) {
  }
  return summary();
}

const Points& Deformer::positions() const {
  Impl& self = *impl_;
  if (!self.is_positions_current) {
    self.positions = (self.x * self.unit()).rowwise() + self.shape->centre();
    for (Eigen::Index i = 0; i < self.x.rows(); ++i) {
      if (self.constraints->is_held[i]) self.positions.row(i) = self.constraints->exact.row(i);
    }
    self.is_positions_current = true;
  }
  return self.positions;
}

std::size_t Deformer::memory_bytes() const {
  const std::size_t points = impl_->x.size() * sizeof(double);
  const std::size_t held = impl_->constraints ? impl_->constraints->memory_bytes() : 0;
  const std::size_t coarse = impl_->coarse ? impl_->coarse->memory_bytes() : 0;
  return sizeof(Impl) + held + coarse + impl_->objective.cells().memory_bytes() +
         impl_->metric.memory_bytes() + kWorkspace * points;
}

}  // namespace lpdeform
