#include "core/constraints/constraints.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/constraints/check_positions.h"
#include "core/constraints/holds.h"
#include "core/energy/rotation_fit.h"
#include "core/problem/check_handle.h"
#include "core/problem/footprint.h"

namespace lpdeform {
namespace {

/// A position in the caller's units, as given.
struct GivenPosition {
  std::int32_t vertex;
  Eigen::RowVector3d at;
};

/// `hold` is called with each vertex that is held exactly, its target in scaled units and in the caller's.
template <typename HoldVertex>
absl::Status hold_handles(const RestShape& shape, const HandleSet& handles, Holds& holds,
                          const HoldVertex& hold) {
  for (const auto& [name, handle] : handles.handles()) {
    const Points targets = target_positions(handle, shape.positions(), shape.faces());
    if (absl::Status status = check_targets(shape, name, handle, targets); !status.ok()) return status;
    const Points scaled = (targets.rowwise() - shape.centre()) / shape.mean_edge_length();
    add_holds(shape, name, handle, scaled, holds);
    if (!handle.fixes_vertices()) continue;
    for (std::size_t k = 0; k < handle.vertices.size(); ++k) {
      hold(handle.vertices[k], scaled.row(k), targets.row(k));
    }
  }
  return absl::OkStatus();
}

/// For each vertex, whether it may move: it is in the region of interest and some face has it.
std::vector<char> movable_vertices(const RestShape& shape, const std::vector<std::int32_t>* region) {
  std::vector<char> may_move(shape.vertex_count(), region == nullptr);
  if (region != nullptr) {
    for (const std::int32_t vertex : *region) may_move[vertex] = true;
  }
  if (shape.cell_count() == shape.vertex_count()) return may_move;
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    if (shape.components()[i] < 0) may_move[i] = false;
  }
  return may_move;
}

/// Drops rows all of whose vertices are held: they constrain nothing.
void drop_void_rows(const std::vector<char>& may_move, Holds& holds) {
  std::erase_if(holds.rows, [&](const LinearRow& row) {
    return std::none_of(row.point.vertices.begin(), row.point.vertices.begin() + row.point.count,
                        [&](std::int32_t vertex) { return may_move[vertex]; });
  });
}

/// Holds all vertices outside the region at their positions in `outside`, and unreferenced vertices where handles have them or at rest.
void hold_outside(const RestShape& shape, const std::vector<char>& may_move, const Points& outside,
                  std::vector<GivenPosition>& exact, Constraints& constraints) {
  const auto count = static_cast<std::size_t>(std::count(may_move.begin(), may_move.end(), false));
  if (count == 0) return;
  exact.reserve(exact.size() + count);
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    if (may_move[i]) continue;
    const bool has_handle = std::exchange(constraints.is_held[i], true);
    if (shape.components()[i] < 0) {
      if (!has_handle) exact.push_back({i, shape.positions().row(i)});
      continue;
    }
    constraints.targets.row(i) = (outside.row(i) - shape.centre()) / shape.mean_edge_length();
    exact.push_back({i, outside.row(i)});
  }
}

/// Which components something ties, at least to the degree `least`. `exact` has all vertices that are held.
std::vector<char> tied_components(const RestShape& shape, const HandleSet& handles,
                                  const std::vector<GivenPosition>& exact, Tie least) {
  std::vector<char> is_tied(shape.component_count(), false);
  const auto tie = [&](std::int32_t vertex) {
    if (shape.components()[vertex] >= 0) is_tied[shape.components()[vertex]] = true;
  };
  for (const GivenPosition& held : exact) tie(held.vertex);
  for (const auto& [name, handle] : handles.handles()) {
    if (tie_of(handle.hold) < least) continue;
    for (std::size_t k = 0; k < handle.size(); ++k) tie(point_form(shape, handle, k).vertices[0]);
  }
  return is_tied;
}

absl::Status name_free_component(const RestShape& shape, std::int32_t component) {
  const auto& components = shape.components();
  const auto first = std::find(components.begin(), components.end(), component) - components.begin();
  const auto size = std::count(components.begin(), components.end(), component);
  return make_fault({Reason::kComponentWithoutHandle, absl::StrCat("component ", component),
                     "at least 1 handle a component"},
                    absl::StrCat("component ", component, " of the mesh (", size,
                                 " vertices, the first of them vertex ", first, ") has no handle"));
}

/// The rigid motion, in scaled units, of the handle with the vertex that is nearest to `point` at rest.
RigidTransform nearest_handle_motion(const RestShape& shape, const HandleSet& handles,
                                     const Eigen::RowVector3d& point) {
  const Points& rest = shape.scaled_positions();
  const Handle* nearest = nullptr;
  double shortest = std::numeric_limits<double>::infinity();
  for (const auto& [name, handle] : handles.handles()) {
    const Points from = rest_positions(handle, rest, shape.faces());
    const double distance = (from.rowwise() - point).rowwise().squaredNorm().minCoeff();
    if (distance < shortest) shortest = distance, nearest = &handle;
  }
  const Points from = rest_positions(*nearest, rest, shape.faces());
  Points to = target_positions(*nearest, shape.positions(), shape.faces());
  to = (to.rowwise() - shape.centre()) / shape.mean_edge_length();
  if (std::holds_alternative<TargetPositions>(nearest->motion)) return fit_rigid(from, to);
  // The positions of one vertex, or of several on a line, do not determine a rotation.
  RigidTransform motion;
  motion.rotation = rotation_of(nearest->motion);
  motion.translation = to.colwise().mean() - from.colwise().mean() * motion.rotation.transpose();
  return motion;
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

/// Holds every vertex of the components that no handle holds, at rest or moved, as `free_components` says.
void hold_free_components(const RestShape& shape, const HandleSet& handles, FreeComponents free_components,
                          const std::vector<char>& has_handle, std::vector<GivenPosition>& exact,
                          Constraints& constraints) {
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
    if (free_components == FreeComponents::kStay)
      exact.push_back({i, shape.positions().row(i)});
    else
      exact.push_back({i, constraints.targets.row(i) * shape.mean_edge_length() + shape.centre()});
  }
}

/// The positions of held vertices. `given` has each of them; of several for one vertex the last counts.
HeldPositions held_positions(const std::vector<char>& is_held, const std::vector<GivenPosition>& given) {
  HeldPositions result;
  std::vector<std::int32_t> place(is_held.size());
  for (std::size_t i = 0; i < is_held.size(); ++i) {
    if (!is_held[i]) continue;
    place[i] = static_cast<std::int32_t>(result.vertices.size());
    result.vertices.push_back(static_cast<std::int32_t>(i));
  }
  result.vertices.shrink_to_fit();
  result.positions.resize(static_cast<Eigen::Index>(result.vertices.size()), 3);
  for (const GivenPosition& one : given) result.positions.row(place[one.vertex]) = one.at;
  return result;
}

}  // namespace

absl::StatusOr<Constraints> make_constraints(const RestShape& shape, const HandleSet& handles,
                                             FreeComponents free_components, const Points* outside) {
  absl::Status status = check_handles(handles, shape.vertex_count(), shape.face_count());
  if (!status.ok()) return status;
  if (handles.handles().empty()) return no_handles();
  Constraints constraints{std::vector<char>(shape.vertex_count(), false),
                          shape.scaled_positions(),
                          {},
                          {},
                          {},
                          footprint_stiffness(shape, handles)};
  std::vector<GivenPosition> exact;
  Holds holds;
  const auto hold = [&](std::int32_t vertex, const auto& scaled, const auto& as_given) {
    constraints.is_held[vertex] = true;
    constraints.targets.row(vertex) = scaled;
    exact.push_back({vertex, as_given});
  };
  if (status = hold_handles(shape, handles, holds, hold); !status.ok()) return status;
  const std::vector<char> may_move = movable_vertices(shape, handles.region());
  hold_outside(shape, may_move, outside ? *outside : shape.positions(), exact, constraints);
  drop_void_rows(may_move, holds);
  const std::vector<char> is_tied = tied_components(shape, handles, exact, Tie::kPartial);
  const auto free = std::find(is_tied.begin(), is_tied.end(), false);
  if (free != is_tied.end() && free_components == FreeComponents::kError) {
    return name_free_component(shape, static_cast<std::int32_t>(free - is_tied.begin()));
  }
  if (free != is_tied.end())
    hold_free_components(shape, handles, free_components, is_tied, exact, constraints);
  constraints.exact = held_positions(constraints.is_held, exact);
  constraints.soft = std::move(holds.soft);
  auto linear = LinearConstraints::create(std::move(holds.rows), constraints.is_held);
  if (!linear.ok()) return linear.status();
  constraints.linear = *std::move(linear);
  if (tied_components(shape, handles, exact, Tie::kWhole) !=
      std::vector<char>(shape.component_count(), true)) {
    constraints.linear.tie_locks();
  }
  return constraints;
}

absl::Status check_equations(const RestShape& shape, const HandleSet& handles) {
  if (!has_equations(handles)) return absl::OkStatus();
  const std::vector<char> may_move = movable_vertices(shape, handles.region());
  std::vector<char> is_held(may_move.size());
  std::transform(may_move.begin(), may_move.end(), is_held.begin(), std::logical_not<>());
  Holds holds;
  const auto hold = [&](std::int32_t vertex, const auto&...) { is_held[vertex] = true; };
  if (absl::Status status = hold_handles(shape, handles, holds, hold); !status.ok()) return status;
  drop_void_rows(may_move, holds);
  return LinearConstraints::create(std::move(holds.rows), is_held).status();
}

std::size_t Constraints::memory_bytes() const {
  return is_held.capacity() + (targets.size() + exact.positions.size() + footprint.size()) * sizeof(double) +
         exact.vertices.capacity() * sizeof(std::int32_t) + soft.rows().capacity() * sizeof(SoftRow) +
         linear.memory_bytes();
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
