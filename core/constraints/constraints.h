#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/constraints/linear_constraints.h"
#include "core/constraints/soft_terms.h"
#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// What happens to a connected component that no handle holds.
enum class FreeComponents {
  kError,   // an error that names the component
  kStay,    // stays at rest
  kFollow,  // moves rigidly with the handle that has the vertex nearest to its centre at rest
};

/// Positions of some vertices.
struct HeldPositions {
  std::vector<std::int32_t> vertices;  // ascending
  Points positions;                    // of each of `vertices`

  /// `vertex` must be one of `vertices`. O(log n).
  Eigen::RowVector3d of(std::int32_t vertex) const {
    return positions.row(std::lower_bound(vertices.begin(), vertices.end(), vertex) - vertices.begin());
  }
};

/// The constraints that handles and the region of interest put on positions. Held vertices do not move in a solve. They
/// are the vertices of handles that hold Exactly, vertices outside the region of interest, unreferenced vertices and,
/// if asked for (FreeComponents), all vertices of components that nothing keeps from drifting off.
struct Constraints {
  std::vector<char> is_held;  // one per vertex
  Points targets;             // scaled units; rows of free vertices are the rest positions
  HeldPositions exact;        // of held vertices: the targets in the caller's units, exactly as given
  SoftTerms soft;             // terms of soft and orientation handles; the length unit is not set
  LinearConstraints linear;   // points inside faces and locks
  Field footprint;            // factors of the cells' stiffness; empty if all are 1

  std::size_t memory_bytes() const;
};

/// Makes the constraints. Errors: those of check_handles, check_targets and LinearConstraints::create;
/// FAILED_PRECONDITION: NO_HANDLES,
/// COMPONENT_WITHOUT_HANDLE (names the component and its lowest vertex; an orientation handle does not hold its
/// component). `outside`: positions at which vertices outside the region of interest are held, in the caller's units;
/// null means the rest positions.
absl::StatusOr<Constraints> make_constraints(const RestShape& shape, const HandleSet& handles,
                                             FreeComponents free_components, const Points* outside = nullptr);

/// Whether points held exactly and locks can hold together: the errors of LinearConstraints::create, without making
/// constraints. `handles` have passed check_handles, and their targets check_targets. A session asks
/// this when handles are set, to refuse the update; the Deformer makes the constraints later, once for the newest handles.
absl::Status check_equations(const RestShape& shape, const HandleSet& handles);

/// The rotation and translation that bring points `from` nearest to points `to`: to_k = R from_k + t. For a single
/// point, or points that coincide, this is a translation.
struct RigidTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::RowVector3d translation = Eigen::RowVector3d::Zero();

  Eigen::RowVector3d operator()(const Eigen::RowVector3d& point) const {
    return point * rotation.transpose() + translation;
  }
};
RigidTransform fit_rigid(const Points& from, const Points& to);

}  // namespace lpdeform
