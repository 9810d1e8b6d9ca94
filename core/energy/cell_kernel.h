#pragma once

#include <cstddef>
#include <vector>

#include "core/energy/cell_blocks.h"

namespace lpdeform {

inline constexpr std::size_t kRow = 4;  // numbers stored per vector: x, y, z and a filler, one load

/// The results of the kernels for each block, lane by lane.
struct BlockState {
  explicit BlockState(const CellBlocks& blocks);
  std::size_t memory_bytes() const;

  /// Makes room for rotations, so that evaluations store them.
  void keep_rotations(const CellBlocks& blocks);

  std::vector<double> rotations;  // [block][entry, row-major][lane]: R_i; empty if they are not kept
  std::vector<double> squared;    // of each vertex: E_i^2
  std::vector<float>
      residuals;  // [slot][lane][axis], then a filler: r_ij = w_ij ((x_i - x_j) - R_i (p_i - p_j));
  // turn_blocks() stores others. Single precision: a small relative error is harmless, and memory bandwidth is the bottleneck
};

/// Computes rotations (Eq. 2, as fit_rotation does), squared energies and residuals of blocks first to last - 1 at
/// positions x, in scaled units. `rows` has x, y, z and a filler for each vertex. If `fit` is false, the rotations kept in
/// `state` are used. Uses the widest vector instructions that the processor has; lanes whose fit is uncertain go
/// through fit_rotation. Different blocks may be computed at the same time.
void evaluate_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const double* rows,
                     bool fit, BlockState& state);

/// Computes the gradient rows of the cells of these blocks from the state of all blocks and the weights c_i of the
/// vertices:
///
///   df/dx_i = 2 sum_j (c_i r_ij - c_j r_ji)
void gradient_of_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last,
                        const BlockState& state, const double* c, double* gradient);

}  // namespace lpdeform
