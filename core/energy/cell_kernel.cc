#include "core/energy/cell_kernel.h"

#include "core/energy/rotation_fit.h"

// This file is compiled once for each instruction set. The first call decides which version runs.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#ifdef __aarch64__  // once: Arm's sets of fixed width do the same here, and vectors of SVE can be no members
#define HWY_COMPILE_ONLY_STATIC
#endif
#define HWY_TARGET_INCLUDE "core/energy/cell_kernel.cc"
#include <hwy/foreach_target.h>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>

#include "core/energy/rotation_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {

/// Fits a single lane by fit_rotation; reads and writes memory.
void fit_lane(const double* b, double* rotation, std::size_t lane) {
  Eigen::Matrix3d matrix;
  for (std::size_t e = 0; e < 9; ++e) matrix(e / 3, e % 3) = b[e * kLanes + lane];
  matrix = fit_rotation(matrix);
  for (std::size_t e = 0; e < 9; ++e) rotation[e * kLanes + lane] = matrix(e / 3, e % 3);
}

HWY_INLINE void store(const Matrix& m, double* at) {
  const D d;
  for (std::size_t e = 0; e < 9; ++e) hn::StoreU(m.m[e / 3][e % 3], d, at + e * kLanes);
}

HWY_INLINE Matrix load_matrix(const double* at) {
  const D d;
  Matrix m;
  for (std::size_t e = 0; e < 9; ++e) m.m[e / 3][e % 3] = hn::LoadU(d, at + e * kLanes);
  return m;
}

constexpr std::size_t kEdge =
    6 * kLanes;  // numbers of a slot in the buffer of edges: x_i - x_j, then p_i - p_j

/// Writes the edges of the lanes from `lane` on to `edges`, as [slot][axis][lane].
HWY_INLINE void gather_edges(const CellBlocks& blocks, std::size_t block, std::size_t lane,
                             const double* rows, double* edges) {
  std::int32_t cells[kLanes];
  for (std::size_t k = 0; k < hn::Lanes(D()); ++k)
    cells[k] = std::max(blocks.cells[block * kLanes + lane + k], 0);
  const Vector centre = gather(rows, cells), rest_centre = gather_packed(blocks.rest, cells);
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1];
       ++slot, edges += kEdge) {
    const std::int32_t* const neighbours = blocks.neighbour.data() + slot * kLanes + lane;
    store(difference(centre, gather(rows, neighbours)), edges + lane);
    store(difference(rest_centre, gather_packed(blocks.rest, neighbours)), edges + 3 * kLanes + lane);
  }
}

/// What the fit needs of the edges of the lanes from `lane` on: b = sum_j w_ij (x_i - x_j) (p_i - p_j)^T, and
/// moved_size = sum_j w_ij |x_i - x_j|^2.
HWY_INLINE void add_edges(const CellBlocks& blocks, std::size_t block, std::size_t lane, const double* edges,
                          Matrix& b, V& moved_size) {
  const D d;
  V xx = hn::Zero(d), xy = hn::Zero(d), xz = hn::Zero(d);
  V yx = hn::Zero(d), yy = hn::Zero(d), yz = hn::Zero(d);
  V zx = hn::Zero(d), zy = hn::Zero(d), zz = hn::Zero(d), size = hn::Zero(d);
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1];
       ++slot, edges += kEdge) {
    const Vector edge = load(edges + lane), rest = load(edges + 3 * kLanes + lane);
    const V w = hn::LoadU(d, blocks.weight.data() + slot * kLanes + lane);
    const Vector we{hn::Mul(w, edge.x), hn::Mul(w, edge.y), hn::Mul(w, edge.z)};
    size = hn::MulAdd(we.x, edge.x, hn::MulAdd(we.y, edge.y, hn::MulAdd(we.z, edge.z, size)));
    xx = hn::MulAdd(we.x, rest.x, xx), xy = hn::MulAdd(we.x, rest.y, xy), xz = hn::MulAdd(we.x, rest.z, xz);
    yx = hn::MulAdd(we.y, rest.x, yx), yy = hn::MulAdd(we.y, rest.y, yy), yz = hn::MulAdd(we.y, rest.z, yz);
    zx = hn::MulAdd(we.z, rest.x, zx), zy = hn::MulAdd(we.z, rest.y, zy), zz = hn::MulAdd(we.z, rest.z, zz);
  }
  b = {{{xx, xy, xz}, {yx, yy, yz}, {zx, zy, zz}}};
  moved_size = size;
}

/// Computes the residuals, and E_i^2 as a sum of squares, which has no cancellation where it is small.
HWY_INLINE void subtract_rotated(const CellBlocks& blocks, std::size_t block, std::size_t lane,
                                 const double* edges, const double* rotations, double* squares,
                                 BlockState& state) {
  const D d;
  const Matrix rotation = load_matrix(rotations + lane);
  V squared = hn::Zero(d);
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1];
       ++slot, edges += kEdge) {
    const V w = hn::LoadU(d, blocks.weight.data() + slot * kLanes + lane);
    const Vector turned = times(rotation, load(edges + 3 * kLanes + lane));
    const Vector r = difference(load(edges + lane), turned);
    const Vector wr{hn::Mul(w, r.x), hn::Mul(w, r.y), hn::Mul(w, r.z)};
    squared = hn::Add(squared, dot(wr, r));
    store_packed(wr, state.residuals.data() + (slot * kLanes + lane) * 3);
  }
  hn::StoreU(squared, d, squares + lane);
}

/// Fits all lanes of a block.
HWY_INLINE void fit_block(const CellBlocks& blocks, std::size_t block, const double* edges,
                          double* rotations) {
  const D d;
  Matrix b[kVectors], rotation[kVectors];
  V bound[kVectors];
  M is_good[kVectors];
  const double* const rest_size = blocks.rest_size.data() + block * kLanes;
  for (std::size_t v = 0; v < kVectors; ++v) {
    const std::size_t lane = v * hn::Lanes(d);
    add_edges(blocks, block, lane, edges, b[v], bound[v]);
    bound[v] = hn::Sqrt(hn::Mul(bound[v], hn::LoadU(d, rest_size + lane)));
  }
  fit(b, bound, rotation, is_good);
  for (std::size_t v = 0; v < kVectors; ++v) {
    const std::size_t lane = v * hn::Lanes(d);
    store(rotation[v], rotations + lane);
    if (hn::AllTrue(d, is_good[v])) continue;
    double buffer[9 * kLanes], good[kLanes];
    store(b[v], buffer + lane);
    hn::StoreU(hn::IfThenElseZero(is_good[v], hn::Set(d, 1.0)), d, good + lane);
    for (std::size_t k = lane; k < lane + hn::Lanes(d); ++k) {
      if (good[k] == 0) fit_lane(buffer, rotations, k);
    }
  }
}

void EvaluateBlocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const double* rows,
                    bool is_fit, BlockState& state) {
  const std::size_t lanes = hn::Lanes(D());
  std::vector<double> edges(blocks.most_slots * kEdge);
  double fitted[9 * kLanes], squares[kLanes];
  for (std::size_t block = first; block < last; ++block) {
    for (std::size_t v = 0; v < kVectors; ++v) gather_edges(blocks, block, v * lanes, rows, edges.data());
    double* const rotations = state.rotations.empty() ? fitted : state.rotations.data() + block * 9 * kLanes;
    if (is_fit) fit_block(blocks, block, edges.data(), rotations);
    for (std::size_t v = 0; v < kVectors; ++v)
      subtract_rotated(blocks, block, v * lanes, edges.data(), rotations, squares, state);
    const std::int32_t* const cells = blocks.cells.data() + block * kLanes;
    for (std::size_t lane = 0; lane < kLanes && cells[lane] >= 0; ++lane)
      state.squared[static_cast<std::size_t>(cells[lane])] = squares[lane];
  }
}

void GradientOfBlocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const BlockState& state,
                      const double* c, double* gradient) {
  using Row = double __attribute__((vector_size(kRow * sizeof(double)), aligned(sizeof(double))));
  using SingleRow = float __attribute__((vector_size(kRow * sizeof(float)), aligned(sizeof(float))));
  const auto residual = [&](std::size_t at) -> const SingleRow& {
    return *reinterpret_cast<const SingleRow*>(state.residuals.data() + at * 3);  // the fourth is not used
  };
  for (std::size_t block = first; block < last; ++block) {
    const std::size_t begin = blocks.first_slot[block], end = blocks.first_slot[block + 1];
    if (block + 1 < last) {  // residuals of other cells are anywhere, and of a large mesh in no cache
      for (std::size_t at = end * kLanes; at < blocks.first_slot[block + 2] * kLanes; ++at)
        hwy::Prefetch(&residual(blocks.opposite[at]));
    }
    const std::int32_t* const cells = blocks.cells.data() + block * kLanes;
    for (std::size_t lane = 0; lane < kLanes && cells[lane] >= 0; ++lane) {
      const std::int32_t i = cells[lane];
      Row own{}, others{};
      for (std::size_t at = begin * kLanes + lane; at < end * kLanes; at += kLanes) {
        own += __builtin_convertvector(residual(at), Row);
        others += c[blocks.neighbour[at]] * __builtin_convertvector(residual(blocks.opposite[at]), Row);
      }
      const Row sum = c[i] * own - others;
      for (std::size_t axis = 0; axis < 3; ++axis)
        gradient[3 * static_cast<std::size_t>(i) + axis] = 2 * sum[axis];
    }
  }
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lpdeform {

HWY_EXPORT(EvaluateBlocks);
HWY_EXPORT(GradientOfBlocks);

BlockState::BlockState(const CellBlocks& blocks)
    : squared(static_cast<std::size_t>(std::find(blocks.cells.begin(), blocks.cells.end(), -1) -
                                       blocks.cells.begin())),
      residuals(blocks.slot_count() * CellBlocks::kLanes * 3 + 1) {}

void BlockState::keep_rotations(const CellBlocks& blocks) {
  constexpr std::size_t kLanes = CellBlocks::kLanes;
  rotations.assign(blocks.cells.size() * 9, 0.0);
  for (std::size_t block = 0; block < blocks.block_count(); ++block) {
    for (std::size_t entry = 0; entry < 9; entry += 4) {
      std::fill_n(rotations.begin() + static_cast<std::ptrdiff_t>((block * 9 + entry) * kLanes), kLanes, 1.0);
    }
  }
}

std::size_t BlockState::memory_bytes() const {
  return (rotations.capacity() + squared.capacity()) * sizeof(double) + residuals.capacity() * sizeof(float);
}

void evaluate_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const double* rows,
                     bool fit, BlockState& state) {
  HWY_DYNAMIC_DISPATCH(EvaluateBlocks)(blocks, first, last, rows, fit, state);
}

void gradient_of_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last,
                        const BlockState& state, const double* c, double* gradient) {
  HWY_DYNAMIC_DISPATCH(GradientOfBlocks)(blocks, first, last, state, c, gradient);
}

}  // namespace lpdeform
#endif
