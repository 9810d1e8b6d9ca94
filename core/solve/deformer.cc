#include "core/solve/deformer.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/constraints/check_positions.h"
#include "core/problem/check_handle.h"
#include "core/problem/check_settings.h"
#include "core/solve/deformer_impl.h"

namespace lpdeform {
namespace {

// What a running solve holds of each vertex, and the same while a graded level runs: four states and a diagonal.
constexpr std::size_t kWorkspace = QuasiNewton::kBytesPerVertex, kWorkspaceOfLevel = 13 * sizeof(double);
// What a Deformer holds of each vertex besides: x, positions, x_before_move, energies and weights.
constexpr std::size_t kStates = 12 * sizeof(double);
constexpr std::size_t kCellBytes = 60, kEdgeBytes = 30;  // of CellPass: per vertex, per directed edge
// The coarse levels take about 1 / kCoarseShare more; of a fine shape of CoarseLevel::kLarge vertices or more, 1 / kCoarseShareOfLarge.
constexpr std::size_t kCoarseShare = 4, kCoarseShareOfLarge = 6;
/// Vertices from which on the coarse mesh is made beside the ordering: cold solves have a coarse level then, whatever p is.
constexpr std::int32_t kCoarsenBeforehand = 10000;

/// Memory of a Deformer without its metric.
std::size_t bytes_beside_metric(const RestShape& shape) {
  const auto n = static_cast<std::size_t>(shape.vertex_count());
  return n * (kWorkspace + kStates + kCellBytes) + kEdgeBytes * shape.neighbours().size();
}

/// What a graded level takes at most, with a metric in single precision, beyond the workspace that the solver of the fine level does not have while it runs.
std::size_t bytes_of_graded_level(const RestShape& shape, std::size_t own) {
  const auto n = static_cast<std::size_t>(shape.vertex_count());
  const std::size_t as_large = own + shape.memory_bytes() + GradedLevel::kBytesPerVertex * n;
  const std::size_t level = static_cast<std::size_t>(GradedLevel::kLargest * static_cast<double>(as_large)) +
                            CoarseLevel::kBytesPerFineVertex * n;
  const std::size_t unused = (kWorkspace - kWorkspaceOfLevel) * n;
  return std::max(level, unused) - unused;
}

absl::Status not_solved(const char* what) {
  return make_fault({Reason::kNotSolved, "", ""},
                    absl::StrCat("Solve for the current inputs before you ", what, "."));
}

}  // namespace

Deformer::Deformer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Deformer::~Deformer() = default;

absl::StatusOr<std::unique_ptr<Deformer>> Deformer::create(std::shared_ptr<const RestShape> shape,
                                                           DeformerOptions options) {
  if (shape == nullptr) return make_fault({Reason::kNoShape, "", ""}, "no rest shape was given");
  if (options.threads < 1 || options.threads > 1024) {
    return make_fault({Reason::kThreadsOutOfRange, "threads", "1 <= threads <= 1024"},
                      absl::StrCat("threads is ", options.threads, "; it must be from 1 to 1024"));
  }
  const Metric::Admission admit = [&](std::size_t metric_bytes) {
    if (!options.admit) return absl::OkStatus();
    const std::size_t own = metric_bytes + bytes_beside_metric(*shape);
    const bool has_coarse = shape->vertex_count() >= Impl::kLargeMesh;
    const bool is_large = shape->vertex_count() >= CoarseLevel::kLarge;
    std::size_t with_levels = has_coarse ? own + own / (is_large ? kCoarseShareOfLarge : kCoarseShare) : own;
    if (shape->vertex_count() >= std::min(options.graded_from, options.late_graded_from))
      with_levels += bytes_of_graded_level(*shape, own);
    return options.admit(with_levels);
  };
  std::optional<absl::StatusOr<Metric>> metric;
  std::optional<Objective> objective;
  std::optional<CoarseMesh> coarse;
  const Workers workers(std::clamp(shape->vertex_count() / options.vertices_a_thread, 1, options.threads));
  workers.run_both(
      [&] {
        metric = Metric::create(shape, admit);
        if (metric->ok()) objective.emplace(shape, workers);
      },
      [&] {
        if (workers.threads() > 1 && shape->vertex_count() >= kCoarsenBeforehand)
          coarse = CoarseLevel::coarsened(*shape);
      });
  if (!metric->ok()) return metric->status();
  options.admit = nullptr;
  return std::unique_ptr<Deformer>(new Deformer(std::make_unique<Impl>(
      std::move(shape), std::move(options), *std::move(objective), **std::move(metric), std::move(coarse))));
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

void Deformer::set_bending(const Field& shares) {
  impl_->change_inputs();
  if (shares.size() == impl_->bending.size() && shares == impl_->bending) return;
  impl_->bending = shares;
  impl_->lead = Impl::Lead::kNone;
  impl_->objective.set_bending(shares);
}

absl::Status Deformer::set_material(const Material& material) {
  if (absl::Status status = check_material(material, impl_->shape->vertex_count()); !status.ok())
    return status;
  impl_->change_inputs();
  if (material == impl_->material) return absl::OkStatus();
  impl_->material = material;
  impl_->lead = Impl::Lead::kNone;
  impl_->forget_weights();
  return absl::OkStatus();
}

absl::Status Deformer::set_positions(const Points& positions) {
  if (absl::Status status = check_positions(*impl_->shape, positions); !status.ok()) return status;
  impl_->change_inputs();
  impl_->x_before_move.resize(0, 3);
  impl_->lead = Impl::Lead::kNone;
  impl_->x = (positions.rowwise() - impl_->shape->centre()) / impl_->unit();
  impl_->positions = positions;
  impl_->is_positions_current = true;
  impl_->state = Impl::State::kDeformed;
  return absl::OkStatus();
}

void Deformer::measure() {
  Impl& self = *impl_;
  self.interrupt();
  if (self.constraints) {
    SoftTerms soft = self.constraints->soft;
    soft.set_length_unit(self.length_unit() / self.unit());
    self.objective.set_soft_terms(std::move(soft));
  }
  self.is_guess_evaluated = false;
  const double typical = self.typical_energy(self.x);
  const Material material = self.constraints ? self.effective_material() : self.material;
  const LpNorm norm(material, self.shape->vertex_count(), self.unit(), typical);
  self.summary.energy = norm.true_energy(self.objective.sum(norm));
  self.summary.soft_energy = norm.true_energy(self.objective.soft_terms().sum(norm));
  const auto& e2 = self.objective.cells().squared_energies();
  for (std::size_t i = 0; i < e2.size(); ++i)
    self.best_energies[static_cast<Eigen::Index>(i)] = self.unit() * std::sqrt(e2[i]);
}

void Deformer::displace(const Points& by) {
  Impl& self = *impl_;
  if (self.lead == Impl::Lead::kTogether) self.coarse->go_alone(self.x);
  self.x += by / self.unit();
  self.is_positions_current = false;
  self.x_before_move.resize(0, 3);
}

double Deformer::lowest_energy() const {
  return impl_->coarse ? impl_->coarse->lowest_energy() : impl_->summary.energy;
}

std::optional<double> Deformer::least_energy(InitialGuess initial, std::stop_token stop) {
  Impl& self = *impl_;
  if (!self.constraints || !self.make_coarse()) return std::nullopt;
  return self.coarse->least_energy(self.coarse_inputs(self.effective_material()), initial, std::move(stop));
}

absl::Status Deformer::start(const SolveSettings& settings, std::stop_token stop) {
  Impl& self = *impl_;
  if (absl::Status status = check_settings(settings, self.material); !status.ok()) return status;
  if (!self.constraints) return no_handles();
  if (absl::Status status = check_method_takes(settings.method, self.handles); !status.ok()) return status;
  self.interrupt();
  self.begin(settings, std::move(stop), false);
  return absl::OkStatus();
}

absl::Status Deformer::start_prepared(const SolveSettings& settings, std::stop_token stop) {
  Impl& self = *impl_;
  if (absl::Status status = check_settings(settings, self.material); !status.ok()) return status;
  if (!self.constraints) return no_handles();
  self.interrupt();
  self.begin(settings, std::move(stop), true);
  return absl::OkStatus();
}

bool Deformer::is_guess_smooth() const {
  return impl_->is_guess_smooth;
}

bool Deformer::step() {
  Impl& self = *impl_;
  if (self.certificate) return self.certify();
  if (is_searching()) {
    if (self.stop.stop_requested())
      self.interrupt();
    else
      self.search_on();
    return self.search != nullptr;
  }
  if (!self.minimiser && !self.search) return false;
  if (self.stop.stop_requested())
    self.end(StopReason::kCancelled);
  else if (self.seconds() >= self.settings.time_limit_seconds)
    self.end(StopReason::kTimeLimit);
  else if (self.summary.iterations >= self.settings.max_iterations)
    self.end(StopReason::kIterationLimit);
  else
    self.iterate();
  return self.minimiser != nullptr || self.search != nullptr || self.certificate != nullptr;
}

void Deformer::catch_up(bool is_last) {
  if (is_last) impl_->forget_looks();
  impl_->catch_up(is_last);
}

absl::Status Deformer::start_certificate(std::stop_token stop, double max_seconds) {
  Impl& self = *impl_;
  self.interrupt();
  if (!self.norm) return not_solved("ask for a certificate");
  self.stop = std::move(stop);
  self.begin_certificate(max_seconds);
  return absl::OkStatus();
}

absl::Status Deformer::start_search(int effort, std::stop_token stop) {
  Impl& self = *impl_;
  if (absl::Status status = check_settings({.effort = effort}, self.material); !status.ok()) return status;
  self.interrupt();
  if (!self.norm) return not_solved("look for a lower minimum");
  self.settings.effort = effort;
  const int starts = self.further_starts();
  if (starts == 0) return absl::OkStatus();
  self.stop = std::move(stop);
  self.is_search_apart = true;
  self.begin_search(starts);
  return absl::OkStatus();
}

bool Deformer::has_other_starts() const {
  return !impl_->is_large();
}

bool Deformer::is_searching() const {
  return impl_->search != nullptr && impl_->is_search_apart;
}

std::optional<double> Deformer::better_energy() const {
  const auto better = impl_->better();
  if (!better) return std::nullopt;
  return impl_->norm->true_energy(better->sum);
}

void Deformer::reserve_better() {
  if (auto better = impl_->better()) impl_->reserved = std::move(better);
}

bool Deformer::take_better() {
  Impl& self = *impl_;
  const auto taken = self.reserved ? self.reserved : self.better();
  if (!taken) return false;
  self.interrupt();
  self.take(*taken);
  return true;
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
    const double unit = self.unit();
    const Eigen::RowVector3d centre = self.shape->centre();
    self.positions.resize(self.x.rows(), 3);
    for_rows(self.x, self.workers(),
             [&](Eigen::Index i) { self.positions.row(i) = unit * self.x.row(i) + centre; });
    const HeldPositions& exact = self.constraints->exact;
    for (std::size_t k = 0; k < exact.vertices.size(); ++k)
      self.positions.row(exact.vertices[k]) = exact.positions.row(static_cast<Eigen::Index>(k));
    self.is_positions_current = true;
  }
  return self.positions;
}

std::vector<Eigen::Matrix3d> Deformer::rotations() {
  Impl& self = *impl_;
  if (self.minimiser || self.search || self.certificate) {
    // The running solve needs the objective's evaluation as it is.
    CellPass cells(self.shape, self.workers());
    cells.evaluate(self.x, self.even_norm());
    return cells.rotations();
  }
  self.objective.evaluate(self.x, self.even_norm());
  return self.objective.cells().rotations();
}

std::size_t Deformer::memory_bytes() const {
  const auto n = static_cast<std::size_t>(impl_->shape->vertex_count());
  const std::size_t levels = impl_->minimiser ? impl_->minimiser->level_bytes() : 0;
  // What the fine level takes again after a graded level counts all the time, so that nobody else is promised it.
  const std::size_t of_fine = kWorkspace * n + impl_->metric.released_bytes();
  return idle_memory_bytes() + std::max(of_fine, kWorkspaceOfLevel * n + levels);
}

std::size_t Deformer::idle_memory_bytes() const {
  const std::size_t points = impl_->x.size() * sizeof(double);
  const std::size_t numbers =
      impl_->x.size() + impl_->positions.size() + impl_->x_before_move.size() + impl_->best_energies.size();
  const std::size_t held = impl_->constraints ? impl_->constraints->memory_bytes() : 0;
  const std::size_t coarse = impl_->coarse ? impl_->coarse->memory_bytes() : 0;
  const std::size_t searched = (impl_->lowest ? points : 0) +
                               (impl_->reserved && impl_->reserved != impl_->lowest ? points : 0) +
                               (impl_->search ? 3 * points : 0);
  const std::size_t looked_at = impl_->best_step ? points : 0;
  return sizeof(Impl) + searched + looked_at + held + coarse + impl_->objective.cells().memory_bytes() +
         impl_->metric.memory_bytes() + numbers * sizeof(double) +
         (impl_->coarse_mesh ? impl_->coarse_mesh->memory_bytes() : 0);
}

}  // namespace lpdeform
