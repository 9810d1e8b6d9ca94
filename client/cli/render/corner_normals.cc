#include "client/cli/render/corner_normals.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>
#include <vector>

namespace lpdeform {
namespace {

constexpr double kCosineOfCrease = 0.766;
// At a vertex of more faces than this, each face keeps its own normal: comparing all pairs would take too
// long.
constexpr std::int32_t kMostFacesCompared = 64;

/// Twice the area times the unit normal.
Points area_normals(const Points& positions, const Faces& faces) {
  Points normals(faces.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3d a = positions.row(faces(f, 0)), b = positions.row(faces(f, 1)),
                             c = positions.row(faces(f, 2));
    normals.row(f) = (b - a).cross(c - a);
  }
  return normals;
}

/// The faces at each vertex: those of vertex v are at start[v] to start[v + 1] - 1.
struct FacesAtVertices {
  std::vector<std::int32_t> start, faces;
};

FacesAtVertices faces_at_vertices(Eigen::Index vertices, const Faces& faces) {
  FacesAtVertices result{std::vector<std::int32_t>(vertices + 1, 0), std::vector<std::int32_t>(faces.size())};
  for (const std::int32_t v : faces.reshaped()) ++result.start[v + 1];
  std::partial_sum(result.start.begin(), result.start.end(), result.start.begin());
  std::vector<std::int32_t> next(result.start.begin(), result.start.end() - 1);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) result.faces[next[faces(f, k)]++] = static_cast<std::int32_t>(f);
  }
  return result;
}

}  // namespace

Points corner_normals(const Points& positions, const Faces& faces) {
  const Points weighted = area_normals(positions, faces);
  Points units = weighted;
  for (auto unit : units.rowwise()) unit.normalize();
  const FacesAtVertices at = faces_at_vertices(positions.rows(), faces);
  Points normals(3 * faces.rows(), 3);
  for (Eigen::Index corner = 0; corner < normals.rows(); ++corner) {
    const Eigen::Index f = corner / 3;
    const std::int32_t begin = at.start[faces(f, corner % 3)], end = at.start[faces(f, corner % 3) + 1];
    normals.row(corner) = weighted.row(f);
    for (std::int32_t k = begin; k < end && end - begin <= kMostFacesCompared; ++k) {
      const std::int32_t other = at.faces[k];
      const double cosine = units.row(f).dot(units.row(other));
      if (other == f || std::abs(cosine) < kCosineOfCrease) continue;
      normals.row(corner) += (cosine > 0 ? 1 : -1) * weighted.row(other);
    }
  }
  for (auto normal : normals.rowwise()) normal.normalize();
  return normals;
}

}  // namespace lpdeform
