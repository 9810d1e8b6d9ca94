#include "core/energy/turn_kernel.h"

// This file is compiled once for each instruction set. The first call decides which version runs.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#ifdef __aarch64__  // once: Arm's sets of fixed width do the same here, and vectors of SVE can be no members
#define HWY_COMPILE_ONLY_STATIC
#endif
#define HWY_TARGET_INCLUDE "core/energy/turn_kernel.cc"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <algorithm>
#include <vector>

#include "core/energy/rotation_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {

/// Added to the matrix of the least squares, as a share of its trace: edges that lie nearly along a line tell nothing about a turn
/// around it.
constexpr double kDamping = 1e-6;
/// Of half the angle. Where edges turn round, their means tend to zero, and the axis is lost in rounding.
constexpr double kMostTangent = 1;
constexpr std::size_t kTurningEdge = 6 * kLanes;  // numbers of a slot in the buffer of edges: e, then b

HWY_INLINE Vector sum(const Vector& a, const Vector& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}

/// Writes the edges of the lanes from `lane` on at both positions to `edges`, as [slot][position][axis][lane].
HWY_INLINE void gather_edges(const CellBlocks& blocks, std::size_t block, std::size_t lane, const double* one,
                             const double* other, double* edges) {
  std::int32_t cells[kLanes];
  for (std::size_t k = 0; k < hn::Lanes(D()); ++k)
    cells[k] = std::max(blocks.cells[block * kLanes + lane + k], 0);
  const Vector centre = gather_packed(one, cells), other_centre = gather_packed(other, cells);
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1];
       ++slot, edges += kTurningEdge) {
    const std::int32_t* const neighbours = blocks.neighbour.data() + slot * kLanes + lane;
    store(difference(centre, gather_packed(one, neighbours)), edges + lane);
    store(difference(other_centre, gather_packed(other, neighbours)), edges + 3 * kLanes + lane);
  }
}

/// v_i / 2 of the lanes from `lane` on.
HWY_INLINE Vector half_turns(const CellBlocks& blocks, std::size_t block, std::size_t lane,
                             const double* edges) {
  const D d;
  V xx = hn::Zero(d), xy = hn::Zero(d), xz = hn::Zero(d), yy = hn::Zero(d), yz = hn::Zero(d),
    zz = hn::Zero(d);                                    // 4 times the sum of w m m^T
  Vector moment{hn::Zero(d), hn::Zero(d), hn::Zero(d)};  // 2 times the sum of w m x d
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1];
       ++slot, edges += kTurningEdge) {
    const Vector e = load(edges + lane), b = load(edges + 3 * kLanes + lane);
    const V w = hn::LoadU(d, blocks.weight.data() + slot * kLanes + lane);
    const Vector m = sum(e, b), wm = scaled(w, m);
    xx = hn::MulAdd(wm.x, m.x, xx), xy = hn::MulAdd(wm.x, m.y, xy), xz = hn::MulAdd(wm.x, m.z, xz);
    yy = hn::MulAdd(wm.y, m.y, yy), yz = hn::MulAdd(wm.y, m.z, yz), zz = hn::MulAdd(wm.z, m.z, zz);
    moment = sum(moment, cross(wm, difference(e, b)));
  }
  // The matrix over its trace, damped: (1 + kDamping) I - sum of w m m^T / trace.
  const V trace = hn::Add(xx, hn::Add(yy, zz)), one = hn::Set(d, 1 + kDamping);
  const V over = hn::IfThenElseZero(hn::Gt(trace, hn::Zero(d)), hn::Div(hn::Set(d, 1.0), trace));
  const V a = hn::NegMulAdd(over, xx, one), b = hn::NegMulAdd(over, yy, one),
          c = hn::NegMulAdd(over, zz, one);
  const V xy_ = hn::Neg(hn::Mul(over, xy)), xz_ = hn::Neg(hn::Mul(over, xz)),
          yz_ = hn::Neg(hn::Mul(over, yz));
  // Cramer's rule.
  const Vector first{hn::NegMulAdd(yz_, yz_, hn::Mul(b, c)), hn::MulSub(xz_, yz_, hn::Mul(xy_, c)),
                     hn::MulSub(xy_, yz_, hn::Mul(xz_, b))};
  const V second_y = hn::NegMulAdd(xz_, xz_, hn::Mul(a, c)), second_z = hn::MulSub(xy_, xz_, hn::Mul(a, yz_)),
          third_z = hn::NegMulAdd(xy_, xy_, hn::Mul(a, b));
  const V determinant = dot({a, xy_, xz_}, first);
  const Vector half =
      scaled(hn::Div(over, determinant), {dot(first, moment), dot({first.y, second_y, second_z}, moment),
                                          dot({first.z, second_z, third_z}, moment)});
  const M is_known = hn::Le(dot(half, half), hn::Set(d, kMostTangent * kMostTangent));
  return {hn::IfThenElseZero(is_known, half.x), hn::IfThenElseZero(is_known, half.y),
          hn::IfThenElseZero(is_known, half.z)};
}

/// Stores w_ij residual(e, other edge) of all edges of the lanes from `lane` on.
template <typename Residual>
HWY_INLINE void store_residuals(const CellBlocks& blocks, std::size_t block, std::size_t lane,
                                const double* edges, const Residual& residual, BlockState& state) {
  for (std::size_t slot = blocks.first_slot[block]; slot < blocks.first_slot[block + 1];
       ++slot, edges += kTurningEdge) {
    const V w = hn::LoadU(D(), blocks.weight.data() + slot * kLanes + lane);
    const Vector r = scaled(w, residual(load(edges + lane), load(edges + 3 * kLanes + lane)));
    store_packed(r, state.residuals.data() + (slot * kLanes + lane) * 3);
  }
}

void TurnOn(const CellBlocks& blocks, std::size_t first, std::size_t last, const OngoingMotion& motion,
            BlockState& state) {
  const D d;
  const V share = hn::Set(d, motion.share), one = hn::Set(d, 1.0);
  std::vector<double> edges(blocks.most_slots * kTurningEdge);
  for (std::size_t block = first; block < last; ++block) {
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
      gather_edges(blocks, block, lane, motion.now, motion.before, edges.data());
      const Vector t = scaled(share, half_turns(blocks, block, lane, edges.data()));
      const V a = hn::Div(hn::Set(d, 2.0), hn::Add(one, dot(t, t)));
      const auto residual = [&](const Vector& e, const Vector& b) -> Vector {
        const Vector across = cross(t, e), turn = sum(across, cross(t, across));  // T e = e + a turn
        return difference(scaled(a, turn), scaled(share, difference(e, b)));
      };
      store_residuals(blocks, block, lane, edges.data(), residual, state);
    }
  }
}

void TurnTo(const CellBlocks& blocks, std::size_t first, std::size_t last, const TurnedMotion& motion,
            BlockState& state) {
  std::vector<double> edges(blocks.most_slots * kTurningEdge);
  double turns[9 * kLanes];
  for (std::size_t block = first; block < last; ++block) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      const auto cell = static_cast<std::size_t>(std::max(blocks.cells[block * kLanes + k], 0));
      for (std::size_t e = 0; e < 9; ++e) turns[e * kLanes + k] = motion.turns[cell](e % 3, e / 3);
    }
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(D())) {
      gather_edges(blocks, block, lane, motion.from, motion.to, edges.data());
      Matrix turn;
      for (std::size_t e = 0; e < 9; ++e) turn.m[e / 3][e % 3] = hn::LoadU(D(), turns + e * kLanes + lane);
      const auto residual = [&](const Vector& e, const Vector& y) { return difference(times(turn, e), y); };
      store_residuals(blocks, block, lane, edges.data(), residual, state);
    }
  }
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lpdeform {

HWY_EXPORT(TurnOn);
HWY_EXPORT(TurnTo);

void turn_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const OngoingMotion& motion,
                 BlockState& state) {
  HWY_DYNAMIC_DISPATCH(TurnOn)(blocks, first, last, motion, state);
}

void turn_blocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const TurnedMotion& motion,
                 BlockState& state) {
  HWY_DYNAMIC_DISPATCH(TurnTo)(blocks, first, last, motion, state);
}

}  // namespace lpdeform
#endif
