#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "absl/status/statusor.h"
#include "core/shapes/paper_poses.h"

namespace lpdeform {
class RestShape;
}

namespace lpdeform::reproduce {

/// The paper's subproblem of section 3.2: the positions of least energy while all rotations R_i are held,
/// namely those of the naive Laplacian deformation. The energy is then convex, so every start leads to the
/// same minimum.
struct ConvexStep {
  double p = 2;
  /// E^(1/p) at the end, in the caller's unit: from the naive deformation, from the rest shape, and from
  /// random starts, whose free vertices are moved by a tenth of the diagonal.
  std::vector<double> lengths;
  /// No positions have an E^(1/p) that is lower than the least of `lengths` by more than this share of it.
  double certified = 1;

  /// (highest - lowest) / lowest of the lengths.
  double spread() const;
};

/// Descends from 2 + `random_starts` starts, in the reweighted Laplacian's descent direction with
/// backtracking. Errors: those of Deformer; CANCELLED if `stop` is requested.
absl::StatusOr<ConvexStep> convex_step(const std::shared_ptr<const RestShape>& shape, const PaperPose& pose,
                                       double p, int random_starts, std::stop_token stop);

}  // namespace lpdeform::reproduce
