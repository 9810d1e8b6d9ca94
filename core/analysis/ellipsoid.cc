#include "core/analysis/ellipsoid.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <optional>
#include <vector>

#include "core/analysis/face_geometry.h"

namespace lpdeform {
namespace {

// The smallest permitted ratio of the least pivot to the largest. An ellipsoid 1000 times as long as it is thick has
// about this ratio. Below it the result is rounding error: on flat shapes, and where several quadrics fit the vertices.
constexpr double kLeastPivot = 1e-12;
// The square of the smallest permitted ratio of the least axis to the largest. A longer shape is a tube, whose length
// no quadric determines.
constexpr double kLeastThickness = 1e-6;

using Quadric = Eigen::Matrix<double, 9, 1>;

struct Ellipsoid {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  // the ellipsoid's surface has radius_at() 1

  double radius_at(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d from_middle = x - middle;
    return std::sqrt(from_middle.dot(matrix * from_middle));
  }
};

/// The terms of a quadric sum_k q_k t_k(x) = 1.
Quadric terms_at(const Eigen::Vector3d& x) {
  Quadric terms;
  terms << x.cwiseProduct(x), 2 * x[0] * x[1], 2 * x[0] * x[2], 2 * x[1] * x[2], x;
  return terms;
}

/// Empty if the quadric is not an ellipsoid.
std::optional<Ellipsoid> ellipsoid_of(const Quadric& q) {
  Eigen::Matrix3d matrix;
  matrix << q[0], q[3], q[4],  //
      q[3], q[1], q[5],        //
      q[4], q[5], q[2];
  const Eigen::Vector3d axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
  if (!(axes[0] > kLeastThickness * axes[2])) return std::nullopt;
  const Eigen::Vector3d middle = -0.5 * matrix.ldlt().solve(q.tail<3>());
  return Ellipsoid{middle, matrix / (1 + middle.dot(matrix * middle))};
}

/// The fit of one component. Coordinates are relative to its centroid and divided by the root mean square distance from
/// it.
struct Fit {
  double area = 0, size = 0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  Quadric right = Quadric::Zero();
  std::optional<Ellipsoid> found = {};

  Eigen::Vector3d local(const Eigen::Vector3d& x) const { return (x - centroid) / size; }

  void solve() {
    const Eigen::LDLT<Eigen::Matrix<double, 9, 9>> factor(normal);
    const Quadric pivots = factor.vectorD();
    if (factor.info() != Eigen::Success || !(pivots.minCoeff() > kLeastPivot * pivots.maxCoeff())) return;
    found = ellipsoid_of(factor.solve(right));
  }
};

}  // namespace

Field distance_from_ellipsoid(const RestShape& shape) {
  const Points& x = shape.scaled_positions();
  const Field areas = vertex_areas(shape);
  std::vector<Fit> fits(static_cast<std::size_t>(shape.component_count()));
  const auto for_vertices = [&](const auto& visit) {
    for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
      if (shape.components()[i] >= 0) visit(i, fits[shape.components()[i]], x.row(i).transpose());
    }
  };
  for_vertices([&](std::int32_t i, Fit& fit, const Eigen::Vector3d& at) {
    fit.area += areas[i];
    fit.centroid += areas[i] * at;
  });
  for (Fit& fit : fits) fit.centroid /= fit.area;
  for_vertices([&](std::int32_t i, Fit& fit, const Eigen::Vector3d& at) {
    fit.size += areas[i] / fit.area * (at - fit.centroid).squaredNorm();
  });
  for (Fit& fit : fits) fit.size = std::sqrt(fit.size);
  for_vertices([&](std::int32_t i, Fit& fit, const Eigen::Vector3d& at) {
    const Quadric terms = terms_at(fit.local(at));
    fit.normal += areas[i] / fit.area * terms * terms.transpose();
    fit.right += areas[i] / fit.area * terms;
  });
  for (Fit& fit : fits) fit.solve();
  Field distance = Field::Ones(shape.vertex_count());
  for_vertices([&](std::int32_t i, const Fit& fit, const Eigen::Vector3d& at) {
    if (fit.found) distance[i] = std::abs(fit.found->radius_at(fit.local(at)) - 1);
  });
  return distance;
}

}  // namespace lpdeform
