#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/reproduce/convex_step.h"
#include "core/shapes/paper_poses.h"
#include "core/solve/deformer.h"

namespace lpdeform::reproduce {

struct Settings {
  double size = 1;                // of the generated shapes, see core/shapes/paper_poses.h
  int threads = 1;                // of one solve
  std::vector<PaperPose> others;  // besides the paper's poses
};

/// Reports progress, and can stop the work.
struct Watch {
  std::function<void(const std::string& task, int done, int total)> show;
  std::stop_token stop;
};

/// A pose solved once.
struct Solve {
  SolveSummary summary;
  double seconds = 0;  // set-up and solve: the median of `runs` solves
  int runs = 1;
  Points positions;
  Field energies;  // E_i
};

/// A pose solved for each of the paper's p.
struct Experiment {
  double size = 1;  // Settings::size; pictures are smaller below 1, too
  PaperPose pose;
  std::shared_ptr<const RestShape> shape;
  std::map<double, Solve> by_p;

  const Points& rest() const { return shape->positions(); }
};

/// A pose solved with p = 2 in the orange region and p = 1 elsewhere.
struct Mixed {
  std::vector<char> is_orange;  // one per vertex
  Solve solve;
};

struct Trace {
  double p = 1;
  SolveSummary summary;  // with its trace
};

/// A generated instance of the appendix's problem.
struct Sparse {
  Eigen::Index rows = 0, columns = 0, rank = 0;
  Eigen::Index non_zeros = 0, non_zeros_least_squares = 0;
  double gap = 0;  // (value - lower bound) / value
};

/// A pose on a coarser mesh, solved by line_search, to test "larger p converges sooner" also on shapes other
/// than the bar.
struct Descents {
  std::string shape;
  Eigen::Index vertices = 0;
  double share = 1;  // cells along each side, as a share of those in the other measurements of this shape
  Trace low, high;   // p = 1.5 and 6
};

/// How far the result moves as p changes from `p` to p + dp: the largest displacement of a vertex.
struct Variation {
  std::string shape;
  double p = 1;
  std::vector<double> displacements;  // in diagonals at rest, one for each of kSteps
};
inline constexpr double kSteps[] = {0.2, 0.1, 0.05};

/// The convex step of a pose for one p.
struct Minimum {
  std::string shape;
  ConvexStep step;
};
inline constexpr int kRandomStarts = 3;

struct Measurements {
  Experiment sheet, bar, block, creature, arm;
  std::vector<Experiment> others;
  Mixed mixed_sheet, mixed_block;
  std::vector<Trace> traces;       // of the bar: those of Fig. 1, and local_global
  std::vector<Descents> descents;  // of the paper's shapes except the bar
  std::vector<Minimum> minima;
  std::vector<Variation> variations;  // of the paper's shapes, by p
  std::vector<Sparse> sparse;
  int threads = 1;

  /// The bar's trace for p and a method, which must be one of those measured.
  const Trace& trace(double p, Method method) const;
  /// The paper's five shapes in the order of Table 1, then the others.
  std::vector<const Experiment*> all() const;
};

inline constexpr double kPaperP[] = {1, 1.5, 2, 6};

/// Measures everything that the page shows. CANCELLED if the watch says stop; errors of `others` as in
/// Deformer.
absl::StatusOr<Measurements> measure(const Settings& settings, const Watch& watch);

}  // namespace lpdeform::reproduce
