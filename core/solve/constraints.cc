#include "core/solve/constraints.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/energy/rotation_fit.h"

namespace lpdeform {
namespace {

Points rows_of(const Points& points, const std::vector<std::int32_t>& rows) {
  Points result(rows.size(), 3);
  for (std::size_t k = 0; k < rows.size(); ++k) result.row(k) = points.row(rows[k]);
  return result;
}

absl::Status hold_handles(const RestShape& shape, const HandleSet& handles, Constraints& constraints) {
  for (const auto& [name, handle] : handles.handles()) {
    const Points targets = target_positions(handle, shape.positions());
    for (std::size_t k = 0; k < handle.vertices.size(); ++k) {
      const std::int32_t vertex = handle.vertices[k];
      const Eigen::RowVector3d scaled = (targets.row(k) - shape.centre()) / shape.mean_edge_length();
      if (!(scaled.stableNorm() * shape.mean_edge_length() <= kFarthestTarget * shape.diagonal())) {
        return invalid_input(
            {"HANDLE_TARGET_TOO_FAR", absl::StrCat("vertex ", vertex), "1e9 diagonals of the mesh"},
            absl::StrCat("handle \"", name, "\" sends vertex ", vertex,
                         " over 1e9 diagonals of the mesh away"));
      }
      constraints.is_held[vertex] = true;
      constraints.targets.row(vertex) = scaled;
      constraints.exact.row(vertex) = targets.row(k);
    }
  }
  return absl::OkStatus();
}

absl::Status name_free_component(const RestShape& shape, std::int32_t component) {
  const auto& components = shape.components();
  const auto first = std::find(components.begin(), components.end(), component) - components.begin();
  const auto size = std::count(components.begin(), components.end(), component);
  return make_fault(
      absl::StatusCode::kFailedPrecondition,
      {"COMPONENT_WITHOUT_HANDLE", absl::StrCat("component ", component), "at least 1 handle a component"},
      absl::StrCat("component ", component, " of the mesh (", size, " vertices, the first of them vertex ",
                   first, ") has no handle"));
}

/// The rigid motion of the handle that has the vertex nearest to `point`, all at rest, in scaled units.
RigidTransform nearest_handle_motion(const RestShape& shape, const HandleSet& handles,
                                     const Eigen::RowVector3d& point) {
  const Points& rest = shape.scaled_positions();
  const Handle* nearest = nullptr;
  double shortest = std::numeric_limits<double>::infinity();
  for (const auto& [name, handle] : handles.handles()) {
    for (const std::int32_t held : handle.vertices) {
      const double distance = (rest.row(held) - point).squaredNorm();
      if (distance < shortest) shortest = distance, nearest = &handle;
    }
  }
  Points to = target_positions(*nearest, shape.positions());
  to = (to.rowwise() - shape.centre()) / shape.mean_edge_length();
  return fit_rigid(rows_of(rest, nearest->vertices), to);
}

Points component_centres(const RestShape& shape) {
  Points sums = Points::Zero(shape.component_count(), 3);
  std::vector<double> counts(shape.component_count(), 0.0);
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0) continue;
    sums.row(component) += shape.scaled_positions().row(i);
    ++counts[component];
  }
  for (std::int32_t c = 0; c < shape.component_count(); ++c) sums.row(c) /= counts[c];
  return sums;
}

/// Holds every vertex of the components that no handle holds, moved as `free_components` says.
void hold_free_components(const RestShape& shape, const HandleSet& handles, FreeComponents free_components,
                          const std::vector<char>& has_handle, Constraints& constraints) {
  std::vector<RigidTransform> motions(shape.component_count());
  if (free_components == FreeComponents::kFollow) {
    const Points centres = component_centres(shape);
    for (std::int32_t c = 0; c < shape.component_count(); ++c) {
      if (!has_handle[c]) motions[c] = nearest_handle_motion(shape, handles, centres.row(c));
    }
  }
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0 || has_handle[component]) continue;
    constraints.is_held[i] = true;
    constraints.targets.row(i) = motions[component](shape.scaled_positions().row(i));
    if (free_components == FreeComponents::kStay) continue;
    constraints.exact.row(i) = constraints.targets.row(i) * shape.mean_edge_length() + shape.centre();
  }
}

}  // namespace

absl::StatusOr<Constraints> make_constraints(const RestShape& shape, const HandleSet& handles,
                                             FreeComponents free_components) {
  if (absl::Status status = check_handles(handles, shape.vertex_count()); !status.ok()) return status;
  if (handles.handles().empty()) {
    return make_fault(absl::StatusCode::kFailedPrecondition, {"NO_HANDLES", "", "at least 1 handle"},
                      "there is no handle; a deformation needs at least one");
  }
  Constraints constraints{std::vector<char>(shape.vertex_count(), false), shape.scaled_positions(),
                          shape.positions()};
  if (absl::Status status = hold_handles(shape, handles, constraints); !status.ok()) return status;

  std::vector<char> has_handle(shape.component_count(), false);
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0)
      constraints.is_held[i] = true;
    else if (constraints.is_held[i])
      has_handle[component] = true;
  }
  const auto free = std::find(has_handle.begin(), has_handle.end(), false);
  if (free == has_handle.end()) return constraints;
  if (free_components == FreeComponents::kError) {
    return name_free_component(shape, static_cast<std::int32_t>(free - has_handle.begin()));
  }
  hold_free_components(shape, handles, free_components, has_handle, constraints);
  return constraints;
}

RigidTransform fit_rigid(const Points& from, const Points& to) {
  const Eigen::RowVector3d from_mean = from.colwise().mean(), to_mean = to.colwise().mean();
  const Eigen::Matrix3d b = (to.rowwise() - to_mean).transpose() * (from.rowwise() - from_mean);
  RigidTransform result;
  result.rotation = fit_rotation(b);
  result.translation = to_mean - from_mean * result.rotation.transpose();
  return result;
}

}  // namespace lpdeform
