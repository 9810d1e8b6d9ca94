#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/mesh/shapes.h"
#include "core/solve/deformer.h"
#include "server/update.h"

namespace lpdeform {

// A bar of 370 vertices along z, held at both ends: what most tests of the server deform.

inline TriangleMesh bar_mesh() {
  return box_surface(4, 4, 21);
}

/// Two bars that do not touch.
inline TriangleMesh two_bars_mesh() {
  const TriangleMesh bar = box_surface(1, 1, 4);
  const Eigen::Index n = bar.vertices.rows(), m = bar.faces.rows();
  TriangleMesh both;
  both.vertices.resize(2 * n, 3);
  both.vertices << bar.vertices, bar.vertices.rowwise() + Eigen::RowVector3d(10, 0, 0);
  both.faces.resize(2 * m, 3);
  both.faces << bar.faces, bar.faces.array() + static_cast<int>(n);
  return both;
}

inline std::shared_ptr<const RestShape> shape_of(const TriangleMesh& mesh) {
  auto shape = RestShape::create(mesh);
  LPDEFORM_CHECK(shape.ok());
  return *shape;
}

inline std::unique_ptr<Deformer> deformer_of(const std::shared_ptr<const RestShape>& shape,
                                             FreeComponents free_components = FreeComponents::kError) {
  auto deformer = Deformer::create(shape, {free_components, 1});
  LPDEFORM_CHECK(deformer.ok());
  return *std::move(deformer);
}

/// The vertices whose z is `z`.
inline std::vector<std::int32_t> vertices_at(const Points& points, double z) {
  std::vector<std::int32_t> result;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (std::abs(points(i, 2) - z) < 1e-9) result.push_back(static_cast<std::int32_t>(i));
  }
  return result;
}

inline double highest_z(const Points& points) {
  return points.col(2).maxCoeff();
}

inline HandleMotion shifted(double x, double y, double z) {
  RigidMotion motion;
  motion.translation = {x, y, z};
  return motion;
}

/// Holds the bottom where it is and shifts the top by x.
inline Update hold_ends(const Points& points, std::uint64_t input_seq, double x) {
  Update update;
  update.input_seq = input_seq;
  update.handles.push_back({"base", Handle{vertices_at(points, 0), Fixed{}}});
  update.handles.push_back({"tip", Handle{vertices_at(points, highest_z(points)), shifted(x, 0, 0)}});
  return update;
}

inline Update move_tip(std::uint64_t input_seq, double x) {
  Update update;
  update.input_seq = input_seq;
  update.handles.push_back({"tip", shifted(x, 0, 0)});
  return update;
}

}  // namespace lpdeform
