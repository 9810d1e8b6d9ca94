#include "core/multiresolution/coarse_handles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"

namespace lpdeform {
namespace {

/// The point of a face that is nearest to `point`; only approximately if the projection of `point` is outside the face.
SurfacePoint foot_on(const RestShape& shape, std::int32_t face, const Eigen::RowVector3d& point) {
  const auto corner = [&](int c) -> Eigen::RowVector3d {
    return shape.positions().row(shape.faces()(face, c));
  };
  const Eigen::RowVector3d u = corner(1) - corner(0), v = corner(2) - corner(0), w = point - corner(0);
  const Eigen::RowVector3d normal = u.cross(v);
  const double area = normal.squaredNorm();
  SurfacePoint result{face, {1, 0, 0}};
  if (!(area > 0)) return result;
  const double second = w.cross(v).dot(normal) / area, third = u.cross(w).dot(normal) / area;
  result.barycentric = Eigen::Vector3d(1 - second - third, second, third).cwiseMax(0.0);
  result.barycentric /= result.barycentric.sum();
  return result;
}

/// Builds the coarse handles.
class Coarsener {
 public:
  Coarsener(const LevelPair& levels, const Constraints& constraints)
      : levels_(levels), constraints_(constraints), is_taken_(levels.fine_vertex.size(), 0) {}

  HandleSet handles(const HandleSet& fine) {
    HandleSet result;
    add("held", held(fine), result);
    for (const auto& [name, handle] : fine.handles()) {
      if (!handle.points.empty())
        add(absl::StrCat("as ", name), on_faces(handle), result);
      else if (!handle.fixes_vertices())
        add(absl::StrCat("as ", name), on_vertices(handle), result);
    }
    return result;
  }

 private:
  static void add(const std::string& name, Handle handle, HandleSet& handles) {
    if (handle.size() > 0) (void)handles.set(name, std::move(handle));  // on an error it is left out
  }

  bool stays(std::int32_t v) const { return levels_.fine_vertex[levels_.coarse_vertex[v]] == v; }
  bool some_stay(const Handle& handle) const {
    return std::any_of(handle.vertices.begin(), handle.vertices.end(),
                       [&](std::int32_t v) { return stays(v); });
  }
  bool take(std::int32_t c) { return std::exchange(is_taken_[c], 1) == 0; }
  /// The offset at rest from v to its coarse vertex.
  Eigen::RowVector3d offset(std::int32_t v) const {
    return levels_.coarse.positions().row(levels_.coarse_vertex[v]) - levels_.fine.positions().row(v);
  }

  /// All held vertices, as one handle.
  Handle held(const HandleSet& fine) {
    std::vector<std::pair<std::int32_t, Eigen::RowVector3d>> targets;
    for (std::size_t c = 0; c < levels_.fine_vertex.size(); ++c) {
      const std::int32_t v = levels_.fine_vertex[c];
      if (constraints_.is_held[v] && take(static_cast<std::int32_t>(c)))
        targets.emplace_back(static_cast<std::int32_t>(c), constraints_.exact.of(v));
    }
    for (const auto& [name, handle] : fine.handles()) {
      if (!handle.fixes_vertices() || some_stay(handle)) continue;
      for (const std::int32_t v : handle.vertices) {
        const std::int32_t c = levels_.coarse_vertex[v];
        if (take(c)) targets.emplace_back(c, constraints_.exact.of(v) + offset(v));
      }
    }
    return with_targets({}, targets);
  }

  Handle on_vertices(const Handle& handle) {
    const Points fine_targets = target_positions(handle, levels_.fine.positions());
    const bool has_coarse = some_stay(handle);
    std::vector<std::pair<std::int32_t, Eigen::RowVector3d>> targets;
    for (std::size_t k = 0; k < handle.vertices.size(); ++k) {
      const std::int32_t v = handle.vertices[k], c = levels_.coarse_vertex[v];
      if ((has_coarse && !stays(v)) || !take(c)) continue;
      targets.emplace_back(c, fine_targets.row(static_cast<Eigen::Index>(k)) + offset(v));
    }
    if (targets.empty()) return {};
    Handle result = with_targets(hold_on_fewer(handle.hold, handle.vertices.size(), targets.size()), targets);
    if (!takes_positions(handle.hold)) result.motion = handle.motion;
    return result;
  }

  Handle on_faces(const Handle& handle) {
    const Points rest = rest_positions(handle, levels_.fine.positions(), levels_.fine.faces());
    const Points fine_targets = target_positions(handle, levels_.fine.positions(), levels_.fine.faces());
    Handle result;
    result.hold = handle.hold;
    for (Eigen::Index k = 0; k < rest.rows(); ++k)
      result.points.push_back(nearest(handle.points[k], rest.row(k)));
    const Points feet = rest_positions(result, levels_.coarse.positions(), levels_.coarse.faces());
    result.motion = TargetPositions{fine_targets + feet - rest};
    return result;
  }

  /// The coarse faces that use any of these vertices.
  std::vector<std::int32_t> faces_around(const std::array<std::int32_t, 3>& corners) {
    if (faces_of_.empty()) {
      faces_of_.resize(levels_.fine_vertex.size());
      for (std::int32_t face = 0; face < levels_.coarse.face_count(); ++face) {
        for (int c = 0; c < 3; ++c) faces_of_[levels_.coarse.faces()(face, c)].push_back(face);
      }
    }
    std::vector<std::int32_t> result;
    for (const std::int32_t corner : corners)
      result.insert(result.end(), faces_of_[corner].begin(), faces_of_[corner].end());
    return result;
  }

  /// The point nearest to `rest` on the coarse faces around the vertices that the corners of the fine face were
  /// collapsed into.
  SurfacePoint nearest(const SurfacePoint& point, const Eigen::RowVector3d& rest) {
    std::array<std::int32_t, 3> corners{};
    for (int c = 0; c < 3; ++c) corners[c] = levels_.coarse_vertex[levels_.fine.faces()(point.face, c)];
    SurfacePoint best;
    double shortest = std::numeric_limits<double>::infinity();
    for (const std::int32_t face : faces_around(corners)) {
      const auto row = levels_.coarse.faces().row(face);
      const SurfacePoint foot = foot_on(levels_.coarse, face, rest);
      Eigen::RowVector3d at = -rest;
      for (int c = 0; c < 3; ++c) at += foot.barycentric[c] * levels_.coarse.positions().row(row[c]);
      if (at.squaredNorm() < shortest) shortest = at.squaredNorm(), best = foot;
    }
    return best;
  }

  static Handle with_targets(const Hold& hold,
                             const std::vector<std::pair<std::int32_t, Eigen::RowVector3d>>& targets) {
    Handle result;
    result.hold = hold;
    TargetPositions positions{Points(static_cast<Eigen::Index>(targets.size()), 3)};
    for (std::size_t k = 0; k < targets.size(); ++k) {
      result.vertices.push_back(targets[k].first);
      positions.positions.row(static_cast<Eigen::Index>(k)) = targets[k].second;
    }
    result.motion = std::move(positions);
    return result;
  }

  const LevelPair& levels_;
  const Constraints& constraints_;
  std::vector<char> is_taken_;
  std::vector<std::vector<std::int32_t>> faces_of_;  // of each coarse vertex, made when first needed
};

}  // namespace

HandleSet coarse_handles(const LevelPair& levels, const HandleSet& handles, const Constraints& constraints) {
  return Coarsener(levels, constraints).handles(handles);
}

}  // namespace lpdeform
