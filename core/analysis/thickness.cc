#include "core/analysis/thickness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/BVH>

#include "core/analysis/face_geometry.h"

namespace lpdeform {
namespace {

using Point = Eigen::Vector3d;
using Box = Eigen::AlignedBox3d;
using Tree = Eigen::KdBVH<double, 3, std::int32_t>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kThinnest = 0.5;        // scaled units
constexpr double kOpposite = 0.5;        // cosine of 60 degrees
constexpr double kEdgeTolerance = 1e-9;  // so that no ray slips through between two triangles
constexpr double kRounding = 1e-9;       // of the diagonal: a doubled face lies at 0, to rounding
constexpr std::size_t kFacesAChunk = 256;

Point corner(const RestShape& shape, std::int32_t face, int k) {
  return shape.scaled_positions().row(shape.faces()(face, k)).transpose();
}

Tree tree_of(const RestShape& shape) {
  std::vector<std::int32_t> faces(shape.faces().rows());
  std::iota(faces.begin(), faces.end(), 0);
  std::vector<Box> boxes;
  boxes.reserve(faces.size());
  for (const std::int32_t face : faces) {
    Box box(corner(shape, face, 0));
    boxes.push_back(box.extend(corner(shape, face, 1)).extend(corner(shape, face, 2)));
  }
  return Tree(faces.begin(), faces.end(), boxes.begin(), boxes.end());
}

/// The query of Eigen's BVMinimize: the nearest face that the ray meets from behind.
class InwardRay {
 public:
  using Scalar = double;

  InwardRay(const RestShape& shape, const std::vector<double>& signs, Point origin, Point direction,
            double rounding)
      : shape_(shape), signs_(signs), origin_(origin), direction_(direction), rounding_(rounding) {}

  /// Where the ray enters the box; infinite where it does not.
  double minimumOnVolume(const Box& box) const {
    double enter = 0, leave = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = box.min()[axis] - rounding_ - origin_[axis];
      const double high = box.max()[axis] + rounding_ - origin_[axis];
      if (direction_[axis] == 0) {
        if (low > 0 || high < 0) return kInfinity;
        continue;
      }
      const double a = low / direction_[axis], b = high / direction_[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave ? enter : kInfinity;
  }

  double minimumOnObject(std::int32_t face) const {
    const Point a = corner(shape_, face, 0);
    const Point ab = corner(shape_, face, 1) - a, ac = corner(shape_, face, 2) - a;
    const Point normal = ab.cross(ac);  // twice the area long
    const double facing = normal.dot(direction_);
    const double sign = signs_[shape_.components()[shape_.faces()(face, 0)]];
    if (!(sign * facing > kOpposite * normal.norm())) return kInfinity;
    const Point from_a = origin_ - a;
    const double t = -from_a.dot(normal) / facing;
    if (t < -rounding_) return kInfinity;
    const Point across = from_a.cross(direction_);
    const double v = -ac.dot(across) / facing, w = ab.dot(across) / facing;
    const bool is_inside = v >= -kEdgeTolerance && w >= -kEdgeTolerance && v + w <= 1 + kEdgeTolerance;
    return is_inside ? std::max(t, 0.0) : kInfinity;
  }

 private:
  const RestShape& shape_;
  const std::vector<double>& signs_;
  Point origin_, direction_;
  double rounding_;
};

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
    // About the component's own centre, so that where the mesh lies does not count, even with holes in it.
    const double volume = areas[c] > 0 ? volumes[c] - moments[c].dot(vector_areas[c]) / areas[c] / 3 : 0;
    if (volume < 0) signs[c] = -1;
  }
  return signs;
}

std::vector<double> thickness_behind_faces(const RestShape& shape, const Workers& workers) {
  const Tree tree = tree_of(shape);
  const std::vector<double> signs = outward_signs(shape);
  const double diagonal = shape.diagonal() / shape.mean_edge_length();
  std::vector<double> thickness(shape.faces().rows(), kInfinity);
  workers.for_chunks(thickness.size(), kFacesAChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const FaceGeometry face = face_geometry(shape, static_cast<Eigen::Index>(f));
      if (face.area == 0) continue;
      const double sign = signs[shape.components()[shape.faces()(static_cast<Eigen::Index>(f), 0)]];
      InwardRay ray(shape, signs, face.centre.transpose(), -sign * face.normal.transpose(),
                    kRounding * diagonal);
      const double length = Eigen::BVMinimize(tree, ray);
      if (length < std::numeric_limits<double>::max()) thickness[f] = std::max(length, kThinnest);
    }
  });
  return thickness;
}

}  // namespace lpdeform
