#pragma once

#include <cstdint>
#include <vector>

#include "core/energy/rest_shape.h"
#include "core/linalg/cholesky.h"

namespace lpdeform {

/// The lower triangle of a 3n x 3n matrix of 3 x 3 blocks, with one block for each pair of vertices that share a cell.
/// Free vertices only, numbered by `free` (-1 if held).
LowerMatrix two_ring_pattern(const RestShape& shape, const std::vector<std::int32_t>& free);

/// Adds a 3 x 3 block at block row `row`, block column `column` (free indices, row >= column) to such a matrix. A
/// diagonal block must be symmetric; only its lower triangle is added.
void add_block(LowerMatrix& matrix, std::int32_t row, std::int32_t column, const Eigen::Matrix3d& block);

}  // namespace lpdeform
