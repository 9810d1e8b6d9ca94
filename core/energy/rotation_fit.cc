#include "core/energy/rotation_fit.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace lpdeform {
namespace {

/// The symmetric 4x4 matrix K with q^T K q = <R(q), B> for unit quaternions q = (w, x, y, z) (Davenport).
Eigen::Matrix4d davenport(const Eigen::Matrix3d& b) {
  Eigen::Matrix4d k;
  k(0, 0) = b(0, 0) + b(1, 1) + b(2, 2);
  k(0, 1) = b(2, 1) - b(1, 2);
  k(0, 2) = b(0, 2) - b(2, 0);
  k(0, 3) = b(1, 0) - b(0, 1);
  k(1, 1) = b(0, 0) - b(1, 1) - b(2, 2);
  k(2, 2) = b(1, 1) - b(0, 0) - b(2, 2);
  k(3, 3) = b(2, 2) - b(0, 0) - b(1, 1);
  k(1, 2) = b(0, 1) + b(1, 0);
  k(1, 3) = b(0, 2) + b(2, 0);
  k(2, 3) = b(1, 2) + b(2, 1);
  for (int row = 1; row < 4; ++row) {
    for (int column = 0; column < row; ++column) k(row, column) = k(column, row);
  }
  return k;
}

double determinant(const Eigen::Matrix3d& m) {
  return m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)) -
         m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0)) +
         m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0));
}

/// The largest root of x^4 - 2 |B|^2 x^2 - 8 det(B) x + det(K), by Newton's method from the upper bound sqrt(3) |B|,
/// from which it descends monotonically.
double largest_eigenvalue(const Eigen::Matrix3d& b, const Eigen::Matrix4d& k) {
  const double c2 = -2 * b.squaredNorm(), c1 = -8 * determinant(b), c0 = k.determinant();
  double x = std::sqrt(3.0) * b.norm();
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double value = ((x * x + c2) * x + c1) * x + c0;
    const double slope = (4 * x * x + 2 * c2) * x + c1;
    if (!(slope > 0)) break;
    const double next = x - value / slope;
    if (!(next < x)) break;
    const bool is_done = x - next < 1e-12 * x;
    x = next;
    if (is_done) break;
  }
  return x;
}

/// The longest column of the adjugate of the singular symmetric matrix m: its null vector, not normalised.
Eigen::Vector4d null_vector(const Eigen::Matrix4d& m) {
  Eigen::Vector4d best = Eigen::Vector4d::Zero();
  double longest = -1;
  for (int skip = 0; skip < 4; ++skip) {
    Eigen::Vector4d column;
    for (int row = 0; row < 4; ++row) {
      Eigen::Matrix3d minor;
      for (int r = 0, i = 0; r < 4; ++r) {
        if (r == skip) continue;
        for (int c = 0, j = 0; c < 4; ++c) {
          if (c != row) minor(i, j++) = m(r, c);
        }
        ++i;
      }
      column[row] = ((row + skip) % 2 == 0 ? 1 : -1) * determinant(minor);
    }
    const double length = column.squaredNorm();
    if (length > longest) longest = length, best = column;
  }
  return best;
}

/// One Newton step for <R exp([w]x), B> at R. False if R is not near the maximum; then the SVD must decide.
bool polish(const Eigen::Matrix3d& b, Eigen::Matrix3d& r) {
  const Eigen::Matrix3d m = r.transpose() * b;
  const Eigen::Vector3d slope(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1));
  Eigen::Matrix3d curvature = -0.5 * (m + m.transpose());
  curvature.diagonal().array() += m.trace();
  // At the maximum, each eigenvalue is the sum of two (signed) singular values. All are positive if the rotation is
  // unique.
  const double a = curvature(0, 0), minor = a * curvature(1, 1) - curvature(0, 1) * curvature(0, 1);
  const double det = determinant(curvature), scale = m.trace();
  if (!(a > 0 && minor > 0 && det > 1e-8 * scale * scale * scale)) return false;
  const Eigen::Vector3d w = curvature.inverse() * slope;
  if (!(w.squaredNorm() < 1e-4)) return false;
  const Eigen::Quaterniond turn(std::sqrt(1 - 0.25 * w.squaredNorm()), 0.5 * w.x(), 0.5 * w.y(), 0.5 * w.z());
  r = r * turn.toRotationMatrix();
  return true;
}

}  // namespace

Eigen::Matrix3d fit_rotation(const Eigen::Matrix3d& b_any_size) {
  const double size = b_any_size.cwiseAbs().maxCoeff();
  if (!(size > 0)) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d b = b_any_size / size;
  Eigen::Matrix4d k = davenport(b);
  k.diagonal().array() -= largest_eigenvalue(b, k);
  const Eigen::Vector4d q = null_vector(k);
  const double length = q.norm();
  if (!(length > 1e-6)) return fit_rotation_svd(b);
  Eigen::Matrix3d r =
      Eigen::Quaterniond(q[0] / length, q[1] / length, q[2] / length, q[3] / length).toRotationMatrix();
  return polish(b, r) ? r : fit_rotation_svd(b);
}

Eigen::Matrix3d fit_rotation_svd(const Eigen::Matrix3d& b) {
  if (!(b.cwiseAbs().maxCoeff() > 0)) return Eigen::Matrix3d::Identity();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(b, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0)
    u.col(2) *= -1;  // the column of the smallest singular value: they are sorted
  return u * svd.matrixV().transpose();
}

}  // namespace lpdeform
