#pragma once

#include <Eigen/Core>

namespace lpdeform {

/// The rotation R, det R = +1, that maximises <R, B>. For B = sum_j w_j b_j a_j^T it brings the vectors a_j nearest to
/// the vectors b_j: min_R sum_j w_j |b_j - R a_j|^2 (Sorkine & Alexa 2007, Eq. 6; B is the transpose of the paper's
/// S_i). Defined for every finite B. If several rotations are equally good (rank 0 or 1, or a tie at det B < 0), it
/// returns one of them; for B = 0 the identity. Accurate to rounding wherever the rotation is unique.
///
/// Method: the largest eigenvalue of Davenport's 4x4 matrix as a root of its quartic, its eigenvector from the
/// adjugate, then one Newton step on SO(3). Falls back to fit_rotation_svd if the result is uncertain.
Eigen::Matrix3d fit_rotation(const Eigen::Matrix3d& b);

/// The same by Jacobi SVD: slower, but valid for every B. The reference in tests.
Eigen::Matrix3d fit_rotation_svd(const Eigen::Matrix3d& b);

}  // namespace lpdeform
