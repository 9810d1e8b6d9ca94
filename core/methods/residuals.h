#pragma once

#include <vector>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// One vector for each entry k = (i, j) of RestShape's rows. The stacked residuals z_i of a cell are the rows
/// offsets[i] to offsets[i + 1] - 1.
using EdgeVectors = Points;

/// The affine map of the convex step, with rotations held fixed, in scaled units:
///
///   z = A x - b,   z_k = sqrt(w_ij) ((x_i - x_j) - R_i (p_i - p_j)),   so that E_i = |z_i|.
void residuals(const RestShape& shape, const Points& x, const std::vector<Eigen::Matrix3d>& rotations,
               EdgeVectors& z);

/// A u.
void apply_edges(const RestShape& shape, const Points& u, EdgeVectors& result);

/// A^T y, with zero rows for held vertices.
void apply_edges_transposed(const RestShape& shape, const EdgeVectors& y, const std::vector<char>& is_held,
                            Points& result);

/// |y_i| over the rows of cell i.
double cell_norm(const RestShape& shape, const EdgeVectors& y, std::int32_t i);

}  // namespace lpdeform
