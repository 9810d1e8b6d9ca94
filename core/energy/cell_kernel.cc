#include "core/energy/cell_kernel.h"

#include "core/energy/rotation_fit.h"

// Compiled once for each of these instruction sets; which runs is decided when it is first called.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#define HWY_TARGET_INCLUDE "core/energy/cell_kernel.cc"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "core/energy/rotation_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {

/// The fit of one lane by itself, from and to memory.
void fit_lane(const double* b, double* rotation, std::size_t lane) {
  constexpr std::size_t kLanes = CellBlocks::kLanes;
  Eigen::Matrix3d matrix;
  for (std::size_t e = 0; e < 9; ++e) matrix(e / 3, e % 3) = b[e * kLanes + lane];
  matrix = fit_rotation(matrix);
  for (std::size_t e = 0; e < 9; ++e) rotation[e * kLanes + lane] = matrix(e / 3, e % 3);
}

HWY_INLINE void store(const Matrix& m, double* at) {
  const D d;
  for (std::size_t e = 0; e < 9; ++e) hn::StoreU(m.m[e / 3][e % 3], d, at + e * CellBlocks::kLanes);
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
  for (std::size_t e = 0; e < 9; ++e) m.m[e / 3][e % 3] = hn::LoadU(d, at + e * CellBlocks::kLanes);
  return m;
}

/// Fits the lanes from `lane` on, whose edges lie in `edges`; `moved_size` is sum_j w_ij |x_i - x_j|^2.
HWY_INLINE void fit_lanes(const Matrix& b, V moved_size, const double* rest_size, double* rotations,
                          std::size_t lane) {
  const D d;
  const V bound = hn::Sqrt(hn::Mul(moved_size, hn::LoadU(d, rest_size + lane)));
  Matrix rotation;
  const M is_good = fit(b, bound, rotation);
  store(rotation, rotations + lane);
  if (hn::AllTrue(d, is_good)) return;
  double buffer[9 * CellBlocks::kLanes];
  store(b, buffer + lane);
  double good[CellBlocks::kLanes];
  hn::StoreU(hn::IfThenElseZero(is_good, hn::Set(d, 1.0)), d, good + lane);
  for (std::size_t k = lane; k < lane + hn::Lanes(d); ++k) {
    if (good[k] == 0) fit_lane(buffer, rotations, k);
  }
}

/// What the fit needs of a cell's edges.
struct FitSums {
  Matrix b;      // sum_j w_ij (x_i - x_j) (p_i - p_j)^T
  V moved_size;  // sum_j w_ij |x_i - x_j|^2
};

/// Edges x_i - x_j of the lanes from `lane` on, left where their residuals will be; adds to `sums` unless null.

HWY_INLINE void gather_edges(const CellBlocks& blocks, std::size_t block, std::size_t lane, const double* x,
                             double* edges, FitSums* sums) {
  constexpr std::size_t kLanes = CellBlocks::kLanes;
  const D d;
  const Vector centre = gather(x, blocks.row.data() + block * kLanes + lane);
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1]; ++slot) {
    const Vector neighbour = gather(x, blocks.neighbour_row.data() + slot * kLanes + lane);
    const Vector edge{hn::Sub(centre.x, neighbour.x), hn::Sub(centre.y, neighbour.y),
                      hn::Sub(centre.z, neighbour.z)};
    store(edge, edges + slot * 3 * kLanes + lane);
    if (sums == nullptr) continue;
    const V w = hn::LoadU(d, blocks.weight.data() + slot * kLanes + lane);
    const Vector rest = load(blocks.rest_edge.data() + slot * 3 * kLanes + lane);
    const Vector we{hn::Mul(w, edge.x), hn::Mul(w, edge.y), hn::Mul(w, edge.z)};
    sums->moved_size = hn::Add(sums->moved_size, dot(we, edge));
    const auto add = [&](int r, V scale) {
      sums->b.m[r][0] = hn::MulAdd(scale, rest.x, sums->b.m[r][0]);
      sums->b.m[r][1] = hn::MulAdd(scale, rest.y, sums->b.m[r][1]);
      sums->b.m[r][2] = hn::MulAdd(scale, rest.z, sums->b.m[r][2]);
    };
    add(0, we.x);
    add(1, we.y);
    add(2, we.z);
  }
}

/// Makes the edges residuals, as a sum of squares: no cancellation where E_i^2 is small.
HWY_INLINE void subtract_rotated(const CellBlocks& blocks, std::size_t block, std::size_t lane,
                                 BlockState& state) {
  constexpr std::size_t kLanes = CellBlocks::kLanes;
  const D d;
  const Matrix rotation = load_matrix(state.rotations.data() + block * 9 * kLanes + lane);
  V squared = hn::Zero(d);
  Vector sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1]; ++slot) {
    double* const residual = state.residuals.data() + slot * 3 * kLanes + lane;
    const V w = hn::LoadU(d, blocks.weight.data() + slot * kLanes + lane);
    const Vector edge = load(residual);
    const Vector turned = times(rotation, load(blocks.rest_edge.data() + slot * 3 * kLanes + lane));
    const Vector r{hn::Sub(edge.x, turned.x), hn::Sub(edge.y, turned.y), hn::Sub(edge.z, turned.z)};
    const Vector wr{hn::Mul(w, r.x), hn::Mul(w, r.y), hn::Mul(w, r.z)};
    squared = hn::Add(squared, dot(wr, r));
    sum = {hn::Add(sum.x, wr.x), hn::Add(sum.y, wr.y), hn::Add(sum.z, wr.z)};
    store(wr, residual);
  }
  hn::StoreU(squared, d, state.squared.data() + block * kLanes + lane);
  store(sum, state.residual_sums.data() + block * 3 * kLanes + lane);
}

void EvaluateBlocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const double* x,
                    bool is_fit, BlockState& state) {
  constexpr std::size_t kLanes = CellBlocks::kLanes;
  const D d;
  for (std::size_t block = first; block < last; ++block) {
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
      FitSums sums{zero_matrix(), hn::Zero(d)};
      gather_edges(blocks, block, lane, x, state.residuals.data(), is_fit ? &sums : nullptr);
      if (is_fit) {
        fit_lanes(sums.b, sums.moved_size, blocks.rest_size.data() + block * kLanes,
                  state.rotations.data() + block * 9 * kLanes, lane);
      }
      subtract_rotated(blocks, block, lane, state);
    }
  }
}

void GradientOfBlocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const BlockState& state,
                      const double* c, double* gradient) {
  constexpr std::size_t kLanes = CellBlocks::kLanes;
  for (std::size_t block = first; block < last; ++block) {
    const std::size_t begin = blocks.first_slot[block], end = blocks.first_slot[block + 1];
    const std::int32_t* const cells = blocks.cells.data() + block * kLanes;
    for (std::size_t lane = 0; lane < kLanes && cells[lane] >= 0; ++lane) {
      const std::int32_t i = cells[lane];
      const double* const own = state.residual_sums.data() + block * 3 * kLanes + lane;
      double gx = c[i] * own[0], gy = c[i] * own[kLanes], gz = c[i] * own[2 * kLanes];
      for (std::size_t slot = begin; slot < end; ++slot) {
        const std::size_t at = slot * kLanes + lane;
        const double cj = c[blocks.neighbour_row[at] / 3];
        const double* const r = state.residuals.data() + blocks.opposite[at];
        gx -= cj * r[0], gy -= cj * r[kLanes], gz -= cj * r[2 * kLanes];
      }
      double* const row = gradient + 3 * i;
      row[0] = 2 * gx, row[1] = 2 * gy, row[2] = 2 * gz;
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
    : rotations(blocks.cells.size() * 9),
      squared(blocks.cells.size()),
      residuals(blocks.slot_count() * 3 * CellBlocks::kLanes),
      residual_sums(blocks.cells.size() * 3) {
  constexpr std::size_t kLanes = CellBlocks::kLanes;
  for (std::size_t block = 0; block < blocks.block_count(); ++block) {
    for (std::size_t entry = 0; entry < 9; entry += 4) {
      std::fill_n(rotations.begin() + static_cast<std::ptrdiff_t>((block * 9 + entry) * kLanes), kLanes, 1.0);
    }
  }
}

std::size_t BlockState::memory_bytes() const {
  return (rotations.capacity() + squared.capacity() + residuals.capacity() + residual_sums.capacity()) *
         sizeof(double);
}

void evaluate_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const double* x, bool fit,
                     BlockState& state) {
  HWY_DYNAMIC_DISPATCH(EvaluateBlocks)(blocks, first, last, x, fit, state);
}

void gradient_of_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last,
                        const BlockState& state, const double* c, double* gradient) {
  HWY_DYNAMIC_DISPATCH(GradientOfBlocks)(blocks, first, last, state, c, gradient);
}

}  // namespace lpdeform
#endif
