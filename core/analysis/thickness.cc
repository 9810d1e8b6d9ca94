#include "core/analysis/thickness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "core/analysis/face_bvh.h"
#include "core/analysis/face_geometry.h"

namespace lpdeform {
namespace {

using Point = Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kThinnest = 0.5;        // scaled units
constexpr double kOpposite = 0.5;        // cosine of 60 degrees
constexpr double kEdgeTolerance = 1e-9;  // keeps rays from slipping through between two triangles
constexpr double kRounding = 1e-9;       // of the diagonal: a doubled face is at distance 0 up to rounding
constexpr std::size_t kFacesAChunk = 256;

/// A face that rays meet from behind.
struct Triangle {
  Point a, ab, ac;
  Point normal;      // its length is twice the area
  double sign = 1;   // outward sign of its component
  double least = 0;  // the least sign * <normal, direction> at which a ray meets it

  /// How far along the ray it meets the face; infinite if it does not.
  double distance(const Point& origin, const Point& direction, double rounding) const {
    const double facing = normal.dot(direction);
    if (!(sign * facing > least)) return kInfinity;
    const Point from_a = origin - a;
    const double t = -from_a.dot(normal) / facing;
    if (t < -rounding) return kInfinity;
    const Point across = from_a.cross(direction);
    const double v = -ac.dot(across) / facing, w = ab.dot(across) / facing;
    const bool is_inside = v >= -kEdgeTolerance && w >= -kEdgeTolerance && v + w <= 1 + kEdgeTolerance;
    return is_inside ? std::max(t, 0.0) : kInfinity;
  }
};

/// The faces as triangles, in the tree's order.
std::vector<Triangle> triangles_of(const RestShape& shape, const FaceBvh& tree,
                                   const std::vector<double>& signs) {
  std::vector<Triangle> triangles;
  triangles.reserve(tree.order().size());
  for (const std::int32_t face : tree.order()) {
    const auto corner = [&](int k) -> Point {
      return shape.scaled_positions().row(shape.faces()(face, k)).transpose();
    };
    Triangle triangle{.a = corner(0), .ab = corner(1) - corner(0), .ac = corner(2) - corner(0), .normal = {}};
    triangle.normal = triangle.ab.cross(triangle.ac);
    triangle.sign = signs[shape.components()[shape.faces()(face, 0)]];
    triangle.least = kOpposite * triangle.normal.norm();
    triangles.push_back(triangle);
  }
  return triangles;
}

}  // namespace

std::vector<double> outward_signs(const RestShape& shape) {
  std::vector<double> volumes(shape.component_count(), 0.0);
  std::vector<Point> moments(shape.component_count(), Point::Zero()), vector_areas = moments;
  std::vector<double> areas(shape.component_count(), 0.0);
  for (Eigen::Index f = 0; f < shape.faces().rows(); ++f) {
    const FaceGeometry face = face_geometry(shape, f);
    const std::int32_t c = shape.components()[shape.faces()(f, 0)];
    volumes[c] += face.area * face.normal.dot(face.centre) / 3;
    moments[c] += face.area * face.centre.transpose();
    vector_areas[c] += face.area * face.normal.transpose();
    areas[c] += face.area;
  }
  std::vector<double> signs(volumes.size(), 1.0);
  for (std::size_t c = 0; c < volumes.size(); ++c) {
    // The volume is taken about the component's own centre, so the position of the mesh does not matter, even if it has
    // holes.
    const double volume = areas[c] > 0 ? volumes[c] - moments[c].dot(vector_areas[c]) / areas[c] / 3 : 0;
    if (volume < 0) signs[c] = -1;
  }
  return signs;
}

std::vector<double> thickness_behind_faces(const RestShape& shape, const Workers& workers) {
  const FaceBvh tree(shape.scaled_positions(), shape.faces());
  const std::vector<double> signs = outward_signs(shape);
  const std::vector<Triangle> triangles = triangles_of(shape, tree, signs);
  const double rounding = kRounding * shape.diagonal() / shape.mean_edge_length();
  std::vector<double> thickness(shape.faces().rows(), kInfinity);
  workers.for_chunks(thickness.size(), kFacesAChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {  // in the tree's order: neighbouring rays are similar
      const Eigen::Index f = tree.order()[k];
      const FaceGeometry face = face_geometry(shape, f);
      if (face.area == 0) continue;
      const Point origin = face.centre.transpose(), inwards = -triangles[k].sign * face.normal.transpose();
      const double length = tree.nearest(origin, inwards, rounding, [&](std::int32_t other) {
        return triangles[other].distance(origin, inwards, rounding);
      });
      if (length < kInfinity) thickness[f] = std::max(length, kThinnest);
    }
  });
  return thickness;
}

}  // namespace lpdeform
