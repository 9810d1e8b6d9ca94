#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/multiresolution/level_solver.h"
#include "core/multiresolution/multiresolution.h"
#include "core/solve/deformer_impl.h"

namespace lpdeform {
namespace {

constexpr std::int32_t kLargeAtTwo = 10000;  // vertices from which on a coarse level pays off if every p is 2
constexpr std::int32_t kLargestSearchedLevel =
    5000;  // vertices of a coarse level that looks for lower minima itself
// Minima of a coarse level that differ by less than this may be in another order on the fine level. It counts where the fine
// level is too large to be searched itself.
constexpr double kLeastSavingOfLevel = 0.02;
// Of a level: fewer than DeformerOptions has, because nothing else of a session runs beside one of its levels but the
// lowest.
constexpr std::int32_t kVerticesAThread = 800;
constexpr std::int32_t kNever = std::numeric_limits<std::int32_t>::max();  // vertices
// See can_compare_guesses. At p = 1, where kinks move, going alone is not nearer to the minimum in the same time.
constexpr double kLeastPToCompare = 1.1;
constexpr double kWorthGoing = 32000;  // vertices; see is_guess_good_enough

class DeformerOfLevel : public LevelSolver {
 public:
  explicit DeformerOfLevel(std::unique_ptr<Deformer> deformer) : deformer_(std::move(deformer)) {}

  void set_bending(const Field& shares) override { deformer_->set_bending(shares); }
  void displace(const Points& by) override { deformer_->displace(by); }
  std::optional<double> least_energy(InitialGuess initial, std::stop_token stop) override {
    return deformer_->least_energy(initial, std::move(stop));
  }
  double lowest_energy() const override { return deformer_->lowest_energy(); }
  absl::Status set_material(const Material& material) override { return deformer_->set_material(material); }
  absl::Status set_handles(const HandleSet& handles) override { return deformer_->set_handles(handles); }
  absl::Status set_positions(const Points& positions) override { return deformer_->set_positions(positions); }
  absl::Status start(const SolveSettings& settings, std::stop_token stop) override {
    return deformer_->start(settings, std::move(stop));
  }
  absl::Status start_prepared(const SolveSettings& settings, std::stop_token stop) override {
    return deformer_->start_prepared(settings, std::move(stop));
  }
  bool step() override { return deformer_->step(); }
  void catch_up(bool is_last) override { deformer_->catch_up(is_last); }
  int iterations() const override { return deformer_->summary().iterations; }
  bool has_found_lower() const override {
    const SolveSummary& summary = deformer_->summary();
    return !summary.minima.empty() && summary.energy < summary.minima.front();
  }
  const Points& positions() const override { return deformer_->positions(); }
  double energy() const override { return deformer_->summary().energy; }
  std::vector<Eigen::Matrix3d> rotations() override { return deformer_->rotations(); }
  std::size_t memory_bytes() const override { return deformer_->idle_memory_bytes(); }

 private:
  std::unique_ptr<Deformer> deformer_;
};

}  // namespace

/// Makes the solvers of levels. They have no graded levels themselves. The metric of a graded level may be rough: its triangles between fine and
/// coarse parts can be thin, and a factor in double precision would take memory that nobody has admitted.
MakeLevelSolver Deformer::Impl::level_maker(bool is_graded) const {
  return [this, is_graded](std::shared_ptr<const RestShape> level) -> std::unique_ptr<LevelSolver> {
    const DeformerOptions of_level{.free_components = FreeComponents::kStay,
                                   .threads = workers().threads(),
                                   .vertices_a_thread = kVerticesAThread,
                                   .search_up_to = kLargestSearchedLevel,
                                   .least_saving = is_large() ? kLeastSavingOfLevel : 0,
                                   .graded_from = kNever,
                                   .late_graded_from = kNever};
    auto deformer = Deformer::create(std::move(level), of_level);
    if (!deformer.ok()) return nullptr;
    if (is_graded) (*deformer)->impl_->metric.raise_few_pivots();
    return std::make_unique<DeformerOfLevel>(*std::move(deformer));
  };
}

/// What a graded level takes, where a solve is to have one.
std::optional<Grading> Deformer::Impl::grading() const {
  const bool is_early = shape->vertex_count() >= options.graded_from;
  const bool may_come_late = shape->vertex_count() >= options.late_graded_from;
  if (!(is_early || may_come_late) || shape->weight_kind() == WeightKind::kUniform) return std::nullopt;
  return Grading{handles, effective_material(), level_maker(true), is_early, may_come_late};
}

/// Makes the coarse level if there is none. False if the mesh cannot be coarsened, which is tried once.
bool Deformer::Impl::make_coarse() {
  if (!coarse && !is_coarsest) {
    CoarseMesh mesh = coarse_mesh ? *std::exchange(coarse_mesh, {}) : CoarseLevel::coarsened(*shape);
    coarse = CoarseLevel::create(*shape, std::move(mesh), level_maker(false));
    is_coarsest = coarse == nullptr;
  }
  return coarse != nullptr;
}

FineInputs Deformer::Impl::coarse_inputs(const Material& effective) const {
  return {*shape, handles, *constraints, effective, least_bending()};
}

/// Makes the coarse level if there is none, and restricts the inputs to it, for a solve that begins there. False if the mesh cannot
/// be coarsened, or if the coarse level has no vertices for the handles.
bool Deformer::Impl::prepare_coarse() {
  lead = Lead::kNone;
  return make_coarse() && coarse->take_over(coarse_inputs(effective_material())).ok();
}

/// Whether the lowest level's energy tells how good a guess is: not at another p than 2, or with soft targets.
bool Deformer::Impl::can_judge_guesses() const {
  return !is_coarse() && (material.p.array() == 2).all() && constraints->soft.empty() &&
         constraints->linear.empty() && CoarseLevel::can_lead(*shape, least_bending());
}

/// Whether the change of the lowest level's energy since a move that had time tells so: at one p below 2 that is not too near 1.
bool Deformer::Impl::can_compare_guesses() const {
  return !is_coarse() && material.p.size() == 1 && material.p(0) >= kLeastPToCompare && material.p(0) < 2 &&
         constraints->soft.empty() && constraints->linear.empty();
}

/// The E^(1/p) of the last evaluation of `objective` over that of the lowest level, for one p. Stiffness counts: where it is low, large
/// E_i are no sign of a bad guess.
double Deformer::Impl::over_least(double least) const {
  const LpNorm weighted(effective_material(), shape->vertex_count(), unit(), 1);
  return std::pow(weighted.true_energy(objective.sum(weighted)) / least, 1 / material.p(0));
}

/// Whether a cold solve does without a coarse level, because its guess, the last evaluation of `objective`, is good enough already. The
/// limit is lower on large meshes, where what is left takes the fine level longer than the coarse levels.
bool Deformer::Impl::is_guess_good_enough() const {
  return least_of_lowest &&
         over_least(*least_of_lowest) <= std::min(kMostOverLeast, 1 + kWorthGoing / shape->vertex_count());
}

Method Deformer::Impl::chosen_method(Method asked, bool is_warm) {
  least_of_lowest.reset();
  if (asked == Method::kAuto) {
    const std::int32_t large = is_coarse()                       ? CoarseLevel::kLeastEasedLevel
                               : (material.p.array() == 2).all() ? kLargeAtTwo
                                                                 : kLargeMesh;
    asked = is_warm || shape->vertex_count() < large ? Method::kQuasiNewton : Method::kMultiresolution;
    if (asked == Method::kMultiresolution && can_judge_guesses() && make_coarse()) {
      least_of_lowest =
          coarse->least_energy(coarse_inputs(effective_material()), InitialGuess::kLaplacian, stop);
    }
  }
  if (asked != Method::kMultiresolution || (!is_warm && prepare_coarse())) return asked;
  return Method::kQuasiNewton;
}

}  // namespace lpdeform
