#include "core/methods/two_ring.h"

#include <algorithm>

namespace lpdeform {

LowerMatrix two_ring_pattern(const RestShape& shape, const std::vector<std::int32_t>& free) {
  LowerMatrix matrix;
  matrix.columns.push_back(0);
  std::vector<std::int32_t> ring;
  for (std::int32_t vertex = 0; vertex < shape.vertex_count(); ++vertex) {
    const std::int32_t column = free[vertex];
    if (column < 0) continue;
    ring.assign(1, column);
    // The cells that contain `vertex` are its own and those of its neighbours.
    for (std::int32_t k = shape.offsets()[vertex]; k < shape.offsets()[vertex + 1]; ++k) {
      const std::int32_t cell = shape.neighbours()[k];
      if (free[cell] > column) ring.push_back(free[cell]);
      for (std::int32_t m = shape.offsets()[cell]; m < shape.offsets()[cell + 1]; ++m) {
        const std::int32_t other = free[shape.neighbours()[m]];
        if (other > column) ring.push_back(other);
      }
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    for (int c = 0; c < 3; ++c) {
      for (int r = c; r < 3; ++r) matrix.rows.push_back(3 * column + r);
      for (std::size_t b = 1; b < ring.size(); ++b) {
        for (int r = 0; r < 3; ++r) matrix.rows.push_back(3 * ring[b] + r);
      }
      matrix.columns.push_back(static_cast<std::int32_t>(matrix.rows.size()));
    }
  }
  matrix.values.assign(matrix.rows.size(), 0.0);
  return matrix;
}

void add_block(LowerMatrix& matrix, std::int32_t row, std::int32_t column, const Eigen::Matrix3d& block) {
  for (int c = 0; c < 3; ++c) {
    const std::int32_t begin = matrix.columns[3 * column + c], end = matrix.columns[3 * column + c + 1];
    if (row == column) {
      for (int r = c; r < 3; ++r) matrix.values[begin + r - c] += block(r, c);
      continue;
    }
    const auto found = std::lower_bound(matrix.rows.begin() + begin, matrix.rows.begin() + end, 3 * row);
    const auto at = found - matrix.rows.begin();
    for (int r = 0; r < 3; ++r) matrix.values[at + r] += block(r, c);
  }
}

}  // namespace lpdeform
