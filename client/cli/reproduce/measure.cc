#include "client/cli/reproduce/measure.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/reproduce/least_absolute.h"
#include "core/base/check.h"

namespace lpdeform::reproduce {
namespace {

constexpr int kMostRuns = 5;             // of a solve, to measure its time
constexpr double kSecondsForRuns = 0.6;  // no further run once the runs took this long
constexpr int kTraceIterations = 20000;
constexpr double kVariationTolerance = 1e-6;

/// Makes the measurements one after another. After the first error it does nothing any more and returns empty
/// results; status() has the error.
class Laboratory {
 public:
  Laboratory(const Settings& settings, const Watch& watch, int total)
      : settings_(settings), watch_(watch), total_(total) {}

  Experiment experiment(const std::function<PaperPose()>& make_pose);
  Mixed mixed(const Experiment& on, int axis, double border);
  Trace trace(const Experiment& on, double p, Method method);
  Descents descents(const PaperPose& pose, double share);
  Minimum minimum(const Experiment& on, double p);
  Variation variation(const Experiment& on, double p);
  Sparse sparse(Eigen::Index rows, Eigen::Index columns, Eigen::Index rank);

  const absl::Status& status() const { return status_; }

 private:
  bool begin(const std::string& task);
  absl::StatusOr<Solve> try_solve(const Experiment& on, const Material& material,
                                  const SolveSettings& settings);
  Solve solve(const Experiment& on, const Material& material, SolveSettings settings, int most_runs);
  absl::StatusOr<Variation> vary(const Experiment& on, double p);

  const Settings& settings_;
  const Watch& watch_;
  int done_ = 0, total_;
  absl::Status status_;
};

/// Returns false if nothing more is to be done.
bool Laboratory::begin(const std::string& task) {
  if (status_.ok() && watch_.stop.stop_requested()) status_ = absl::CancelledError();
  if (!status_.ok()) return false;
  watch_.show(task, done_++, total_);
  return true;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

absl::StatusOr<Solve> Laboratory::try_solve(const Experiment& on, const Material& material,
                                            const SolveSettings& settings) {
  auto deformer = Deformer::create(on.shape, {.threads = settings_.threads});
  if (!deformer.ok()) return deformer.status();
  absl::Status status = (*deformer)->set_handles(on.pose.handles);
  if (status.ok()) status = (*deformer)->set_material(material);
  if (!status.ok()) return status;
  absl::StatusOr<SolveSummary> summary = (*deformer)->solve(settings, watch_.stop);
  if (!summary.ok()) return summary.status();
  if (summary->stop_reason == StopReason::kCancelled) return absl::CancelledError();
  const double seconds = summary->setup_seconds + summary->solve_seconds;
  return Solve{*std::move(summary), seconds, 1, (*deformer)->positions(), (*deformer)->cell_energies()};
}

Solve Laboratory::solve(const Experiment& on, const Material& material, SolveSettings settings,
                        int most_runs) {
  settings.initial = InitialGuess::kLaplacian;
  Solve last;
  std::vector<double> seconds;
  for (double sum = 0; std::ssize(seconds) < most_runs && sum < kSecondsForRuns; sum += last.seconds) {
    absl::StatusOr<Solve> solved = try_solve(on, material, settings);
    if (!solved.ok()) {
      status_ = solved.status();
      return {};
    }
    last = *std::move(solved);
    seconds.push_back(last.seconds);
  }
  last.seconds = median(seconds);
  last.runs = static_cast<int>(seconds.size());
  return last;
}

Experiment Laboratory::experiment(const std::function<PaperPose()>& make_pose) {
  Experiment result;
  if (!status_.ok()) return result;
  result.size = settings_.size;
  result.pose = make_pose();
  absl::StatusOr<std::shared_ptr<const RestShape>> shape = RestShape::create(result.pose.mesh);
  if (!shape.ok()) {
    status_ = shape.status();
    return result;
  }
  result.shape = *std::move(shape);
  for (const double p : kPaperP) {
    if (!begin(absl::StrCat(result.pose.name, ", p = ", p))) return result;
    result.by_p.emplace(p, solve(result, Material::uniform(p), {}, kMostRuns));
  }
  return result;
}

/// The region above `border` along `axis` is orange.
Mixed Laboratory::mixed(const Experiment& on, int axis, double border) {
  Mixed result;
  if (!begin(absl::StrCat(on.pose.name, ", p = 1 and 2"))) return result;
  Material material;
  material.p.resize(on.rest().rows());
  for (Eigen::Index i = 0; i < on.rest().rows(); ++i) {
    const bool is_orange = on.rest()(i, axis) > border;
    result.is_orange.push_back(is_orange ? 1 : 0);
    material.p[i] = is_orange ? 2 : 1;
  }
  result.solve = solve(on, material, {}, 1);
  return result;
}

Trace Laboratory::trace(const Experiment& on, double p, Method method) {
  if (!begin(absl::StrCat(on.pose.name, ", p = ", p, " by ", std::string(method_name(method))))) return {};
  SolveSettings settings;
  settings.method = method;
  settings.max_iterations = kTraceIterations;
  settings.keep_trace = true;
  return {p, solve(on, Material::uniform(p), settings, 1).summary};
}

Descents Laboratory::descents(const PaperPose& pose, double share) {
  Descents result{pose.name, pose.mesh.vertices.rows(), share, {}, {}};
  Experiment coarse{settings_.size, pose, nullptr, {}};
  if (!status_.ok()) return result;
  absl::StatusOr<std::shared_ptr<const RestShape>> shape = RestShape::create(pose.mesh);
  status_ = shape.status();
  if (!shape.ok()) return result;
  coarse.shape = *std::move(shape);
  result.low = trace(coarse, 1.5, Method::kLineSearch);
  result.high = trace(coarse, 6, Method::kLineSearch);
  return result;
}

Minimum Laboratory::minimum(const Experiment& on, double p) {
  if (!begin(absl::StrCat(on.pose.name, ", p = ", p, ", rotations held"))) return {};
  absl::StatusOr<ConvexStep> step = convex_step(on.shape, on.pose, p, kRandomStarts, watch_.stop);
  if (!step.ok()) status_ = step.status();
  return {on.pose.name, step.ok() ? *std::move(step) : ConvexStep{}};
}

/// Each solve starts from the result for p, as when a user changes one number.
absl::StatusOr<Variation> Laboratory::vary(const Experiment& on, double p) {
  auto deformer = Deformer::create(on.shape, {.threads = settings_.threads});
  if (!deformer.ok()) return deformer.status();
  absl::Status status = (*deformer)->set_handles(on.pose.handles);
  const SolveSettings settings{.initial = InitialGuess::kCurrent, .tolerance = kVariationTolerance};
  const auto solve_from = [&](const Points& positions, double other_p) {
    if (status.ok()) status = (*deformer)->set_material(Material::uniform(other_p));
    if (status.ok()) status = (*deformer)->set_positions(positions);
    if (status.ok()) status = (*deformer)->solve(settings, watch_.stop).status();
    return (*deformer)->positions();
  };
  const Points base = solve_from(on.by_p.at(p).positions, p);
  Variation result{on.pose.name, p, {}};
  for (const double step : kSteps) {
    const Points moved = solve_from(base, p + step) - base;
    result.displacements.push_back(moved.rowwise().norm().maxCoeff() / on.shape->diagonal());
  }
  if (watch_.stop.stop_requested()) return absl::CancelledError();
  if (!status.ok()) return status;
  return result;
}

Variation Laboratory::variation(const Experiment& on, double p) {
  if (!begin(absl::StrCat(on.pose.name, ", p from ", p))) return {};
  absl::StatusOr<Variation> result = vary(on, p);
  if (!result.ok()) status_ = result.status();
  return result.ok() ? *std::move(result) : Variation{};
}

Sparse Laboratory::sparse(Eigen::Index rows, Eigen::Index columns, Eigen::Index rank) {
  if (!begin(absl::StrCat("min |Ax + b|, ", rows, " x ", columns))) return {};
  std::mt19937 random(static_cast<std::uint32_t>(1000 * rows + rank));
  std::normal_distribution<double> normal;
  const auto entry = [&] { return normal(random); };
  const Eigen::MatrixXd left = Eigen::MatrixXd::NullaryExpr(rows, rank, entry);
  const Eigen::MatrixXd right = Eigen::MatrixXd::NullaryExpr(rank, columns, entry);
  const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(rows, entry).normalized();
  const LeastAbsolute least = least_absolute(left * right, b);
  const Eigen::VectorXd least_squares = b - left * left.colPivHouseholderQr().solve(b);
  const double value = least.u.lpNorm<1>();
  return {rows,
          columns,
          least.rank,
          non_zeros(least.u),
          non_zeros(least_squares),
          (value - least.lower_bound) / value};
}

constexpr std::pair<double, Method> kTraces[] = {{1, Method::kConic},         {1, Method::kLineSearch},
                                                 {1, Method::kQuasiNewton},   {1.5, Method::kLineSearch},
                                                 {1.5, Method::kQuasiNewton}, {6, Method::kLineSearch},
                                                 {6, Method::kQuasiNewton},   {2, Method::kLocalGlobal}};

struct Generated {
  Eigen::Index rows, columns, rank;
};
constexpr Generated kSparse[] = {{60, 10, 10}, {200, 40, 40}, {200, 80, 25}, {400, 100, 100}};

}  // namespace

std::vector<const Experiment*> Measurements::all() const {
  std::vector<const Experiment*> result{&sheet, &bar, &block, &creature, &arm};
  for (const Experiment& other : others) result.push_back(&other);
  return result;
}

const Trace& Measurements::trace(double p, Method method) const {
  const auto found = std::ranges::find_if(
      traces, [&](const Trace& trace) { return trace.p == p && trace.summary.method == method; });
  LPDEFORM_CHECK(found != traces.end());
  return *found;
}

absl::StatusOr<Measurements> measure(const Settings& settings, const Watch& watch) {
  const auto solves = static_cast<int>((5 + settings.others.size()) * std::size(kPaperP));
  const auto rest = static_cast<int>(2 + std::size(kTraces) + std::size(kSparse) + 8 + 13 + 20);
  Laboratory laboratory(settings, watch, solves + rest);
  Measurements result;
  result.threads = settings.threads;
  // Others' meshes first, so that an error in them is reported at once.
  for (const PaperPose& other : settings.others)
    result.others.push_back(laboratory.experiment([&] { return other; }));
  const double size = settings.size;
  result.sheet = laboratory.experiment([&] { return paper_sheet(size); });
  result.bar = laboratory.experiment([&] { return paper_bar(size); });
  result.block = laboratory.experiment([&] { return paper_block(size); });
  result.creature = laboratory.experiment([&] { return paper_creature(size); });
  result.arm = laboratory.experiment([&] { return paper_arm(size); });
  if (!laboratory.status().ok()) return laboratory.status();

  const double middle_of_sheet = result.sheet.rest().col(1).maxCoeff() / 2;
  result.mixed_sheet = laboratory.mixed(result.sheet, 1, middle_of_sheet);
  result.mixed_block = laboratory.mixed(result.block, 2, 0);
  for (const auto& [p, method] : kTraces) result.traces.push_back(laboratory.trace(result.bar, p, method));
  const double half = std::max(kSmallestPoseSize, size / 2);
  for (const auto pose : {paper_sheet, paper_block, paper_creature, paper_arm})
    result.descents.push_back(laboratory.descents(pose(half), half / size));
  for (const Experiment* const experiment : {&result.bar, &result.block, &result.creature, &result.arm}) {
    for (const double p : kPaperP) {
      const bool is_quick = p > 1 || experiment == &result.bar;
      if (is_quick) result.minima.push_back(laboratory.minimum(*experiment, p));
    }
  }
  for (const Experiment* const experiment :
       {&result.sheet, &result.bar, &result.block, &result.creature, &result.arm}) {
    for (const double p : kPaperP) result.variations.push_back(laboratory.variation(*experiment, p));
  }
  for (const auto& [rows, columns, rank] : kSparse)
    result.sparse.push_back(laboratory.sparse(rows, columns, rank));
  if (!laboratory.status().ok()) return laboratory.status();
  return result;
}

}  // namespace lpdeform::reproduce
