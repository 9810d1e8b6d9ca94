#pragma once

#include <Eigen/Core>

namespace lpdeform::reproduce {

/// The appendix's problem: find x with the least |u|_1 for u = A x + b, with A of size m x n.
struct LeastAbsolute {
  Eigen::VectorXd u;
  Eigen::Index rank = 0;   // r_s, the rank of A
  double lower_bound = 0;  // no x has a smaller |u|_1: the dual value <y, b> with A^T y = 0 and |y_i| <= 1
};

/// Uses Newton's method on the smoothed sum_i sqrt(u_i^2 + eps^2), with eps falling to 1e-12 of the largest
/// |b_i|, in an orthonormal basis of the image of A. Unlike linear programming it does not go from vertex to
/// vertex, so the zeros of u are found and not built in. A and b must be finite, and A not empty.
LeastAbsolute least_absolute(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// The number of entries larger than 1e-6 of the largest.
Eigen::Index non_zeros(const Eigen::VectorXd& u);

}  // namespace lpdeform::reproduce
