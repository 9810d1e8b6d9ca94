#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace lpdeform {

/// n points, one a row, in the caller's unit of length.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// m triangles, one a row, as 0-based vertex indices in counter-clockwise order seen from outside.
using Faces = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// One number a vertex.
using Field = Eigen::VectorXd;

}  // namespace lpdeform
