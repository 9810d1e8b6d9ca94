#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace lpdeform {

/// n points, one per row, in the caller's unit of length.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// n points in single precision.
using SinglePoints = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// m triangles, one per row, as 0-based vertex indices in counter-clockwise order seen from outside.
using Faces = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// One number per vertex.
using Field = Eigen::VectorXd;

/// The rows with these indices, in their order.
template <typename Matrix, typename Indices>
Matrix rows_of(const Matrix& matrix, const Indices& indices) {
  Matrix rows(static_cast<Eigen::Index>(indices.size()), matrix.cols());
  Eigen::Index row = 0;
  for (const auto index : indices) rows.row(row++) = matrix.row(static_cast<Eigen::Index>(index));
  return rows;
}

}  // namespace lpdeform
