#include "core/energy/cell_kernel.h"

#include "core/energy/rotation_fit.h"

// This file is compiled once for each instruction set. The first call decides which version runs.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#ifdef __aarch64__  // once: Arm's sets of fixed width do the same here, and vectors of SVE can be no members
#define HWY_COMPILE_ONLY_STATIC
#endif
#define HWY_TARGET_INCLUDE "core/energy/cell_kernel.cc"
#include <hwy/foreach_target.h>

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

HWY_INLINE Matrix zero_matrix() {
  Matrix m;
  for (auto& row : m.m) {
    for (V& entry : row) entry = hn::Zero(D());
  }
  return m;
}

HWY_INLINE Matrix load_matrix(const double* at) {
  const D d;
  Matrix m;
  for (std::size_t e = 0; e < 9; ++e) m.m[e / 3][e % 3] = hn::LoadU(d, at + e * kLanes);
  return m;
}

/// What the fit needs of a cell's edges.
struct FitSums {
  Matrix b;      // sum_j w_ij (x_i - x_j) (p_i - p_j)^T
  V moved_size;  // sum_j w_ij |x_i - x_j|^2
};

constexpr std::size_t kEdge =
    6 * kLanes;  // numbers of a slot in the buffer of edges: x_i - x_j, then p_i - p_j

/// Writes the edges of the lanes from `lane` on to `edges`, as [slot][axis][lane], and returns the sums that the fit
/// needs.
HWY_INLINE FitSums gather_edges(const CellBlocks& blocks, std::size_t block, std::size_t lane,
                                const double* rows, double* edges) {
  const D d;
  FitSums sums{zero_matrix(), hn::Zero(d)};
  std::int32_t cells[kLanes];
  for (std::size_t k = 0; k < hn::Lanes(d); ++k)
    cells[k] = std::max(blocks.cells[block * kLanes + lane + k], 0);
  const Vector centre = gather(rows, cells), rest_centre = gather_packed(blocks.rest, cells);
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1];
       ++slot, edges += kEdge) {
    const std::int32_t* const neighbours = blocks.neighbour.data() + slot * kLanes + lane;
    const Vector edge = difference(centre, gather(rows, neighbours));
    const Vector rest = difference(rest_centre, gather_packed(blocks.rest, neighbours));
    store(edge, edges + lane);
    store(rest, edges + 3 * kLanes + lane);
    const V w = hn::LoadU(d, blocks.weight.data() + slot * kLanes + lane);
    const Vector we{hn::Mul(w, edge.x), hn::Mul(w, edge.y), hn::Mul(w, edge.z)};
    sums.moved_size = hn::Add(sums.moved_size, dot(we, edge));
    const auto add = [&](int r, V scale) {
      sums.b.m[r][0] = hn::MulAdd(scale, rest.x, sums.b.m[r][0]);
      sums.b.m[r][1] = hn::MulAdd(scale, rest.y, sums.b.m[r][1]);
      sums.b.m[r][2] = hn::MulAdd(scale, rest.z, sums.b.m[r][2]);
    };
    add(0, we.x);
    add(1, we.y);
    add(2, we.z);
  }
  return sums;
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
HWY_INLINE void fit_block(const FitSums (&sums)[kVectors], const double* rest_size, double* rotations) {
  const D d;
  Matrix b[kVectors], rotation[kVectors];
  V bound[kVectors];
  M is_good[kVectors];
  for (std::size_t v = 0; v < kVectors; ++v) {
    b[v] = sums[v].b;
    bound[v] = hn::Sqrt(hn::Mul(sums[v].moved_size, hn::LoadU(d, rest_size + v * hn::Lanes(d))));
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
    FitSums sums[kVectors];
    for (std::size_t v = 0; v < kVectors; ++v)
      sums[v] = gather_edges(blocks, block, v * lanes, rows, edges.data());
    double* const rotations = state.rotations.empty() ? fitted : state.rotations.data() + block * 9 * kLanes;
    if (is_fit) fit_block(sums, blocks.rest_size.data() + block * kLanes, rotations);
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
