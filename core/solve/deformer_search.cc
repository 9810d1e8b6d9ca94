#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/multiresolution/multiresolution.h"
#include "core/solve/deformer_impl.h"
#include "core/solve/random_waves.h"

namespace lpdeform {
namespace {

constexpr int kEffortOfLevel = 2;            // times the effort: starts of a coarse level take less time
constexpr std::int32_t kSmallestMesh = 100;  // vertices; smaller ones have few minima
constexpr double kWork = 2e7;                // iterations times vertices of a start, at most

/// Start k begins at the Laplacian deformation or at the lowest minimum, displaced by waves: at kOrigins[k mod 3]. No single one of
/// them reaches the lowest minimum of every problem (tests/bench/tried.md, "Minima").
struct Origin {
  bool is_lowest;
  RandomWaves::Size waves;
};
constexpr std::array kOrigins = {Origin{true, {.share = 0.2, .radius = 0.15}},
                                 Origin{true, {.share = 0.2, .radius = 0}},
                                 Origin{false, {.share = 0.12, .radius = 0}}};

const Origin& origin_of(int number) {
  return kOrigins[static_cast<std::size_t>(number) % kOrigins.size()];
}

constexpr double kRoughTolerance = 1e-3;
constexpr std::size_t kChunk = 4096;  // vertices

/// Minimises with p = 2 everywhere first, and from there with the true norm. Where p is mixed, this leads to other minima than
/// a path that changes all p_i together.
class ByWayOfTwo : public Minimiser {
 public:
  ByWayOfTwo(Problem problem, Points x)
      : problem_(std::move(problem)), two_(problem_.norm.nearer_two(0)), present_(at_two(std::move(x))) {}

  StepResult step() override {
    StepResult result = present_->step();
    result.true_sum = problem_.objective.sum(problem_.norm);
    result.stage += is_second_ ? 1 : 0;
    if (is_second_ || result.outcome == Outcome::kProgress) return result;
    problem_.objective.reweigh(problem_.norm);
    Points x = present_->x();
    present_.reset();  // two of them would take twice the memory
    present_ = std::make_unique<QuasiNewton>(problem_, std::move(x), Warmth::kWarm);
    is_second_ = true;
    result.outcome = Outcome::kProgress;
    return result;
  }
  const Points& x() const override { return present_->x(); }

 private:
  std::unique_ptr<Minimiser> at_two(Points x) const {
    problem_.objective.reweigh(two_);
    const Problem& of = problem_;
    return std::make_unique<QuasiNewton>(
        Problem{of.objective, of.metric, of.constraints, two_, of.tolerance, of.length_unit, of.diagonal,
                of.zero_objective, of.zero_squares, of.stop},
        std::move(x), Warmth::kCold);
  }

  const Problem problem_;
  const LpNorm two_;
  std::unique_ptr<Minimiser> present_;
  bool is_second_ = false;
};

}  // namespace

int Deformer::Impl::default_effort(bool is_warm) const {
  return settings.method == Method::kAuto && !is_warm && material.p.minCoeff() < 2 ? 1 : 0;
}

int Deformer::Impl::further_starts() const {
  if (state == State::kUndistorted || shape->vertex_count() < kSmallestMesh) return 0;
  return *settings.effort == 0 || !is_large() ? kStartsOfEffort * *settings.effort : 1;
}

/// `from` displaced by random waves, which depend on `number`. Held vertices stay at their targets, and the surface around them
/// follows.
Points Deformer::Impl::displaced(const Points& from, int number) const {
  const Points& rest = shape->scaled_positions();
  const RandomWaves waves(number, rest, shape->diagonal() / unit(), origin_of(number).waves,
                          constraints->is_held);
  Points x = from;
  workers().for_chunks(
      static_cast<std::size_t>(x.rows()), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (auto i = static_cast<Eigen::Index>(begin); i < static_cast<Eigen::Index>(end); ++i)
          x.row(i) += waves.at(rest.row(i));
      });
  Points back = Points::Zero(x.rows(), 3);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (constraints->is_held[i]) back.row(i) = constraints->targets.row(i) - x.row(i);
  }
  metric.extend(constraints->is_held, back, workers());
  x += back;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (constraints->is_held[i]) x.row(i) = constraints->targets.row(i);
  }
  constraints->linear.satisfy_within(metric, x, workers());
  return x;
}

std::unique_ptr<Minimiser> Deformer::Impl::make_start(int number, const Points& guess, const Points& lowest) {
  const int first = is_by_coarse_levels(0) ? 1 : 0;
  const bool goes_by_two = number == first && !material.has_uniform_p();
  forget_weights();
  const bool is_factored = prepare_metric(true);  // of equal weights, which displaced() reads, too
  Points x = lowest;
  if (is_factored) x = goes_by_two ? guess : displaced(origin_of(number).is_lowest ? lowest : guess, number);
  if (!x.allFinite()) x = lowest;
  objective.evaluate(x, *norm);
  Problem problem = make_problem();
  problem.tolerance = std::max(problem.tolerance, kRoughTolerance);
  if (goes_by_two) return std::make_unique<ByWayOfTwo>(std::move(problem), std::move(x));
  return std::make_unique<QuasiNewton>(std::move(problem), std::move(x), Warmth::kWithMetric);
}

/// The first start on a mesh with coarse levels, and every start on one that is too large to be searched itself.
bool Deformer::Impl::is_by_coarse_levels(int start) const {
  return is_large() || (start == 0 && shape->vertex_count() >= kLargeMesh);
}

/// A solve by way of the coarse levels, which look for lower minima. Null if there is no coarse level.
std::unique_ptr<Minimiser> Deformer::Impl::make_coarse_start(const Points& guess) {
  if (!prepare_coarse()) return nullptr;
  objective.evaluate(guess, *norm);
  const int effort = std::min(kEffortOfLevel * *settings.effort, SolveSettings::kHighestEffort);
  return std::make_unique<Multiresolution>(make_problem(), guess, *coarse, effort);
}

void Deformer::Impl::begin_search(int starts) {
  forget_weights();
  MinimaSearch::Scope scope{.first = next_start, .starts = starts};
  scope.most_iterations = static_cast<int>(kWork / shape->vertex_count());
  if (is_large()) scope.most_iterations = std::numeric_limits<int>::max();
  if (!prepare_metric(true)) return;
  auto start = [this, guess = laplacian_guess()](int number, const Points& lowest) {
    std::unique_ptr<Minimiser> by_coarse = is_by_coarse_levels(number) ? make_coarse_start(guess) : nullptr;
    return by_coarse ? std::move(by_coarse) : make_start(number, guess, lowest);
  };
  auto finish = [this](Points rough) {
    return std::make_unique<QuasiNewton>(make_problem(), std::move(rough), Warmth::kWithMetric);
  };
  search = std::make_unique<MinimaSearch>(std::move(start), std::move(finish), scope, lowest ? lowest->x : x,
                                          lowest ? lowest->sum : best_sum);
  search_stage = summary.trace.empty() ? 0 : summary.trace.back().stage + 1;
}

void Deformer::Impl::search_on() {
  const bool has_more = search->step();
  if (!is_search_apart) {
    ++summary.search_iterations;
    summarise();
  }
  if (has_more) return;
  end_search();
  if (is_search_apart)
    restore_metric();
  else
    conclude();
}

/// Keeps the lowest minimum found, in `lowest` or as x, and leaves the evaluation at x, of which the next solve reads the previous
/// soft targets.
void Deformer::Impl::end_search() {
  summary.further_starts += search->starts();
  next_start += search->starts();
  for (const double sum : search->minima()) summary.minima.push_back(norm->true_energy(sum));
  if (search->has_improved() && is_search_apart)
    lowest = std::make_shared<const KnownShape>(KnownShape{search->lowest(), search->lowest_sum()});
  const bool saves_enough = search->lowest_sum() <= (1 - options.least_saving) * best_sum;
  const bool takes_it = search->has_improved() && !is_search_apart && saves_enough;
  objective.evaluate(takes_it ? search->lowest() : x, *norm);
  if (takes_it) {
    keep(search->lowest(), search->lowest_sum());
    x_before_move.resize(0, 3);
    lead = Lead::kNone;
  }
  search.reset();
  if (!is_search_apart) record({Outcome::kProgress, best_sum, search_stage}, best_sum);
}

/// Makes the metric of x in which a warm solve begins, as quasi_newton had left one before the search. Otherwise the next move
/// would begin with a factorisation, and that while somebody waits for it.
void Deformer::Impl::restore_metric() {
  if (summary.method != Method::kQuasiNewton && summary.method != Method::kMultiresolution) return;
  const QuasiNewton made_for_its_metric(make_problem(), x, Warmth::kWarm);
  factor = Factor::kQuasiNewton;
}

/// The lowest minimum found, if it saves enough of what the reserved shape or else x has; null if not.
auto Deformer::Impl::better() const -> std::shared_ptr<const KnownShape> {
  const double known = reserved ? reserved->sum : best_sum;
  const bool saves_enough =
      lowest && lowest->sum < known && lowest->sum <= (1 - settings.standing.least_share) * known;
  return saves_enough ? lowest : nullptr;
}

void Deformer::Impl::take(const KnownShape& shape) {
  forget_weights();  // those of x, from which `shape` differs
  objective.evaluate(shape.x, *norm);
  keep(shape.x, shape.sum);
  reserved.reset();
  if (lowest && lowest->sum >= best_sum) lowest.reset();
  x_before_move.resize(0, 3);
  lead = Lead::kNone;
  summary.energy = norm->true_energy(best_sum);
  summary.soft_energy = norm->true_energy(best_soft_sum);
  summary.optimality_gap.reset();
}

}  // namespace lpdeform
