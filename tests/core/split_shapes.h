#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <utility>

#include "core/shapes/shapes.h"

namespace lpdeform {

/// Every corner of every face gets its own vertex, like a mesh that is drawn with flat faces.
inline TriangleMesh split_at_every_corner(const TriangleMesh& mesh) {
  TriangleMesh split{Points(3 * mesh.faces.rows(), 3), Faces(mesh.faces.rows(), 3)};
  for (Eigen::Index corner = 0; corner < 3 * mesh.faces.rows(); ++corner) {
    split.vertices.row(corner) = mesh.vertices.row(mesh.faces(corner / 3, corner % 3));
    split.faces(corner / 3, corner % 3) = static_cast<std::int32_t>(corner);
  }
  return split;
}

/// A texture seam: faces on the side y > 0 of the plane y = 0 get their own vertices along it. The copies come after all
/// vertices of `mesh`.
inline TriangleMesh split_along_seam(const TriangleMesh& mesh) {
  TriangleMesh split = mesh;
  std::map<std::int32_t, std::int32_t> copies;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    double y = 0;
    for (int k = 0; k < 3; ++k) y += mesh.vertices(mesh.faces(f, k), 1);
    for (int k = 0; k < 3 && y > 0; ++k) {
      const std::int32_t v = mesh.faces(f, k);
      if (std::abs(mesh.vertices(v, 1)) > 1e-9) continue;
      const auto next =
          static_cast<std::int32_t>(mesh.vertices.rows() + static_cast<Eigen::Index>(copies.size()));
      split.faces(f, k) = copies.try_emplace(v, next).first->second;
    }
  }
  split.vertices.conservativeResize(mesh.vertices.rows() + static_cast<Eigen::Index>(copies.size()), 3);
  for (const auto& [vertex, copy] : copies) split.vertices.row(copy) = mesh.vertices.row(vertex);
  return split;
}

/// A sphere of radius 1 as modelling programs make it for textures: (rings + 1) x (segments + 1) vertices in a grid of
/// latitudes and longitudes. The last column coincides with the first up to rounding. Each pole is segments + 1 vertices, and
/// every second face there is degenerate. Number: the precision of the computation.
template <typename Number = double>
TriangleMesh uv_sphere(int rings, int segments) {
  const int columns = segments + 1;
  TriangleMesh mesh{Points((rings + 1) * columns, 3), Faces(2 * rings * segments, 3)};
  Eigen::Index f = 0;
  for (int ring = 0; ring <= rings; ++ring) {
    const auto latitude = static_cast<Number>(M_PI * ring / rings);
    for (int column = 0; column < columns; ++column) {
      const auto longitude = static_cast<Number>(2 * M_PI * column / segments);
      const int v = ring * columns + column;
      mesh.vertices.row(v) << std::sin(latitude) * std::cos(longitude),
          std::sin(latitude) * std::sin(longitude), std::cos(latitude);
      if (ring == rings || column == segments) continue;
      mesh.faces.row(f++) << v, v + columns, v + 1;
      mesh.faces.row(f++) << v + 1, v + columns, v + columns + 1;
    }
  }
  return mesh;
}

/// The normal of each corner's face, for a mesh of split_at_every_corner.
inline Points flat_normals(const TriangleMesh& split) {
  Points normals(split.vertices.rows(), 3);
  for (Eigen::Index f = 0; f < split.faces.rows(); ++f) {
    const Eigen::RowVector3d a = split.vertices.row(split.faces(f, 0)),
                             b = split.vertices.row(split.faces(f, 1)),
                             c = split.vertices.row(split.faces(f, 2));
    for (int k = 0; k < 3; ++k) normals.row(split.faces(f, k)) = (b - a).cross(c - a).normalized();
  }
  return normals;
}

/// Bends space about the x axis, more with growing z.
inline Points bent_along_z(const Points& points, double radians_per_unit) {
  Points result = points;
  for (auto point : result.rowwise()) {
    const Eigen::AngleAxisd turn(radians_per_unit * point[2], Eigen::Vector3d::UnitX());
    const Eigen::Vector3d at(point[0], point[1], 0);
    const double radius = 1 / radians_per_unit;
    point = (turn * (at + Eigen::Vector3d(0, radius, 0)) - Eigen::Vector3d(0, radius, 0)).transpose();
  }
  return result;
}

}  // namespace lpdeform
