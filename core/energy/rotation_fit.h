#pragma once

#include <Eigen/Core>

namespace lpdeform {

/// The rotation R, det R = +1, that maximises <R, B>, for B = sum_j w_j b_j a_j^T: the one that brings
/// vectors a_j nearest to vectors b_j, min_R sum_j w_j |b_j - R a_j|^2 (Sorkine & Alexa 2007, Eq. 6; B is the
/// transpose of the paper's S_i). Defined for every finite B: where several rotations are as good (rank 0 or
/// 1, a tie at det B < 0) it returns one of them, the identity for B = 0. Accurate to rounding wherever the
/// rotation is unique.
///
/// Closed form: largest root of the quartic of Davenport's 4x4 matrix, its eigenvector by the adjugate, one
/// Newton step on SO(3). fit_rotation_svd where that is not certain.
Eigen::Matrix3d fit_rotation(const Eigen::Matrix3d& b);

/// The same by Jacobi SVD: slower, for every B. The yardstick of the tests.
Eigen::Matrix3d fit_rotation_svd(const Eigen::Matrix3d& b);

}  // namespace lpdeform
