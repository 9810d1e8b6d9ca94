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

/// The paper's subproblem of section 3.2: the positions of the least energy while all rotations R_i are held, those that fit the
/// naive Laplacian deformation. The energy is convex then, so whatever one starts from leads to one minimum.
struct ConvexStep {
  double p = 2;
  std::vector<double>
      lengths;  // E^(1/p) at the end, in the caller's unit: from the naive deformation, the rest shape, and
                // random starts, whose free vertices are a tenth of the diagonal off
  double certified =
      1;  // no positions have an E^(1/p) less than the lowest of them by more than this share of it

  /// (highest - lowest) / lowest of the lengths.
  double spread() const;
};

/// From 2 + `random_starts` starts, by the reweighted Laplacian's descent direction and backtracking. Errors: as Deformer has
/// them; CANCELLED once `stop` says so.
absl::StatusOr<ConvexStep> convex_step(const std::shared_ptr<const RestShape>& shape, const PaperPose& pose,
                                       double p, int random_starts, std::stop_token stop);

}  // namespace lpdeform::reproduce
