#include "core/constraints/holds.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/base/match.h"

namespace lpdeform {
namespace {

/// The vertex that gives a term at this point its stiffness and p: the one with the largest coefficient.
std::int32_t anchor_of(const PointForm& point) {
  std::int32_t largest = 0;
  for (std::int32_t j = 1; j < point.count; ++j) {
    if (point.coefficients[j] > point.coefficients[largest]) largest = j;
  }
  return point.vertices[largest];
}

/// Adds the term of a cell with a prescribed rotation.
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

/// Adds the terms and rows of each kind for the handle's vertices or points.
struct HoldAdder {
  const RestShape& shape;
  const std::string& name;
  const Handle& handle;
  const Points& targets;
  Holds& out;

  void operator()(const Exactly&) const {
    if (handle.fixes_vertices()) return;
    for_each([&](const PointForm& point, const Eigen::RowVector3d& target) {
      for (int c = 0; c < 3; ++c) add_row(name, point, Eigen::Vector3d::Unit(c), target, out.rows);
    });
  }
  void operator()(const Soft& soft) const {
    if (soft.weight == 0) return;
    for_each([&](const PointForm& point, const Eigen::RowVector3d& target) {
      out.soft.add(anchor_of(point), {{point, target, soft.weight}});
    });
  }
  void operator()(const Orientation& orientation) const {
    if (orientation.weight == 0) return;
    const Eigen::Matrix3d rotation = rotation_of(handle.motion);
    for (const std::int32_t vertex : handle.vertices)
      add_turned_cell(shape, vertex, rotation, orientation.weight, out.soft);
  }
  void operator()(const AxisLock& lock) const {
    const Eigen::Vector3d along = lock.axis.stableNormalized(), across = along.unitOrthogonal();
    for_each([&](const PointForm& point, const Eigen::RowVector3d& target) {
      add_row(name, point, across, target, out.rows);
      add_row(name, point, along.cross(across), target, out.rows);
    });
  }
  void operator()(const PlaneLock& lock) const {
    const Eigen::Vector3d normal = lock.normal.stableNormalized();
    for_each([&](const PointForm& point, const Eigen::RowVector3d& target) {
      add_row(name, point, normal, target, out.rows);
    });
  }

 private:
  template <typename Action>
  void for_each(const Action& action) const {
    for (std::size_t k = 0; k < handle.size(); ++k)
      action(point_form(shape, handle, k), targets.row(static_cast<Eigen::Index>(k)));
  }
};

}  // namespace

PointForm point_form(const RestShape& shape, const Handle& handle, std::size_t k) {
  if (handle.points.empty()) return {1, {handle.vertices[k]}, {1}};
  const SurfacePoint& point = handle.points[k];
  PointForm form{0, {}, {}};
  for (int c = 0; c < 3; ++c) {
    const std::int32_t vertex = shape.faces()(point.face, c);
    std::int32_t j = 0;
    while (j < form.count && form.vertices[j] != vertex) ++j;  // a face may have the same corner twice
    if (j == form.count) form.vertices[form.count++] = vertex;
    form.coefficients[j] += point.barycentric[c];
  }
  return form;
}

void add_holds(const RestShape& shape, const std::string& name, const Handle& handle, const Points& targets,
               Holds& holds) {
  match(handle.hold, HoldAdder{shape, name, handle, targets, holds});
}

bool has_equations(const HandleSet& handles) {
  return std::any_of(handles.handles().begin(), handles.handles().end(), [](const auto& entry) {
    const Handle& handle = entry.second;
    return match(
        handle.hold, [&](const Exactly&) { return !handle.points.empty(); },
        [](const Soft&) { return false; }, [](const Orientation&) { return false; },
        [](const AxisLock&) { return true; }, [](const PlaneLock&) { return true; });
  });
}

Tie tie_of(const Hold& hold) {
  return match(
      hold, [](const Exactly&) { return Tie::kWhole; },
      [](const Soft& soft) { return soft.weight > 0 ? Tie::kWhole : Tie::kNone; },
      [](const Orientation&) { return Tie::kNone; }, [](const AxisLock&) { return Tie::kPartial; },
      [](const PlaneLock&) { return Tie::kPartial; });
}

}  // namespace lpdeform
