#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "core/energy/cell_kernel.h"

namespace lpdeform {

/// A linear map of directions: a row vector d becomes d T.
using Turn = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;

/// A motion of a surface that goes on. Positions have three numbers for each vertex.
struct OngoingMotion {
  const double* before;  // where the last move began
  const double* now;     // where it ended
  double share;          // of the last move that the next one makes
};

/// A motion from one state to another, in which the surface around each vertex turns.
struct TurnedMotion {
  const double* from;
  const double* to;
  const Turn* turns;  // of each vertex
};

/// How the turned edges of a motion differ from those where it ends, for the cells of blocks first to last - 1. `state` gets them as
/// residuals; its other numbers stay as they are:
///
///   r_ij = w_ij (e_ij T_i - y_ij)
///
/// where e_ij and y_ij are the edges from i to its neighbours where the motion begins and where it ends, and T_i is the turn at vertex i.
/// Different blocks may be computed at the same time.
void turn_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const TurnedMotion& motion,
                 BlockState& state);

/// The same where the motion goes on: y_ij = e_ij + share (e_ij - b_ij), where b_ij and e_ij are the edges before and now. T_i is the
/// rotation by which the surface around vertex i has turned in the last move, times `share`: the vector v_i minimises
///
///   sum over j of w_ij |d_j - v_i x m_j|^2,    d_j = e_ij - b_ij,  m_j = (b_ij + e_ij) / 2
///
/// v_i is 2 tan(angle / 2) times the axis if the edges turn rigidly (Cayley). share v_i belongs to share times the angle but for terms
/// of third order. A vertex that has turned by more than 90 degrees counts as one that has not turned, like one whose edges all have
/// length or weight zero; near 180 degrees it may get any turn of less than 90 degrees. Edges along one line do not turn about it.
void turn_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const OngoingMotion& motion,
                 BlockState& state);

}  // namespace lpdeform
