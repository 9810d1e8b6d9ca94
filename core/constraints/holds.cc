#include "core/constraints/holds.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace lpdeform {
namespace {

/// A vertex, for the stiffness and p of a term at this point: that of the largest coefficient.
std::int32_t anchor_of(const PointForm& point) {
  std::int32_t largest = 0;
  for (std::int32_t j = 1; j < point.count; ++j) {
    if (point.coefficients[j] > point.coefficients[largest]) largest = j;
  }
  return point.vertices[largest];
}

/// The cell of a vertex with its rotation prescribed.
void add_turned_cell(const RestShape& shape, std::int32_t i, const Eigen::Matrix3d& rotation, double weight,
                     SoftTerms& terms) {
  const Points& rest = shape.scaled_positions();
  std::vector<SoftRow> rows;
  for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
    const std::int32_t j = shape.neighbours()[k];
    const Eigen::RowVector3d edge = rest.row(i) - rest.row(j);
    rows.push_back({{2, {i, j}, {1, -1}}, edge * rotation.transpose(), weight * shape.weights()[k]});
  }
  if (!rows.empty()) terms.add(i, rows);
}

void add_row(const std::string& name, const PointForm& point, const Eigen::Vector3d& direction,
             const Eigen::RowVector3d& target, std::vector<LinearRow>& rows) {
  rows.push_back({point, direction, target.dot(direction.transpose()), name});
}

}  // namespace

PointForm point_form(const RestShape& shape, const Handle& handle, std::size_t k) {
  if (handle.points.empty()) return {1, {handle.vertices[k]}, {1}};
  const SurfacePoint& point = handle.points[k];
  PointForm form{0, {}, {}};
  for (int c = 0; c < 3; ++c) {
    const std::int32_t vertex = shape.faces()(point.face, c);
    std::int32_t j = 0;
    while (j < form.count && form.vertices[j] != vertex) ++j;  // a face may have a corner twice
    if (j == form.count) form.vertices[form.count++] = vertex;
    form.coefficients[j] += point.barycentric[c];
  }
  return form;
}

void add_holds(const RestShape& shape, const std::string& name, const Handle& handle, const Points& targets,
               Holds& holds) {
  const auto* soft = std::get_if<Soft>(&handle.hold);
  const auto* orientation = std::get_if<Orientation>(&handle.hold);
  const auto* axis = std::get_if<AxisLock>(&handle.hold);
  const auto* plane = std::get_if<PlaneLock>(&handle.hold);
  const Eigen::Matrix3d rotation = rotation_of(handle.motion);
  for (std::size_t k = 0; k < handle.size(); ++k) {
    const PointForm point = point_form(shape, handle, k);
    const Eigen::RowVector3d target = targets.row(k);
    if (soft && soft->weight > 0) {
      holds.soft.add(anchor_of(point), {{point, target, soft->weight}});
    } else if (orientation && orientation->weight > 0) {
      add_turned_cell(shape, handle.vertices[k], rotation, orientation->weight, holds.soft);
    } else if (axis) {
      const Eigen::Vector3d along = axis->axis.stableNormalized(), across = along.unitOrthogonal();
      add_row(name, point, across, target, holds.rows);
      add_row(name, point, along.cross(across), target, holds.rows);
    } else if (plane) {
      add_row(name, point, plane->normal.stableNormalized(), target, holds.rows);
    } else if (!handle.points.empty() && !soft) {
      for (int c = 0; c < 3; ++c) add_row(name, point, Eigen::Vector3d::Unit(c), target, holds.rows);
    }
  }
}

bool has_equations(const HandleSet& handles) {
  return std::any_of(handles.handles().begin(), handles.handles().end(), [](const auto& entry) {
    const Hold& hold = entry.second.hold;
    return std::holds_alternative<AxisLock>(hold) || std::holds_alternative<PlaneLock>(hold) ||
           (std::holds_alternative<Exactly>(hold) && !entry.second.points.empty());
  });
}

bool ties_component(const Handle& handle) {
  if (const auto* soft = std::get_if<Soft>(&handle.hold)) return soft->weight > 0;
  return !std::holds_alternative<Orientation>(handle.hold);
}

}  // namespace lpdeform
