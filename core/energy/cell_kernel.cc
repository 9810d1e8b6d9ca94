#include "core/energy/cell_kernel.h"

#include "core/energy/rotation_fit.h"

// Compiled once for each of these instruction sets; which runs is decided when it is first called.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#define HWY_TARGET_INCLUDE "core/energy/cell_kernel.cc"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, CellBlocks::kLanes>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

struct Vector {
  V x, y, z;
};
struct Matrix {
  V m[3][3];
};
struct Quaternion {
  V w, x, y, z;
};

HWY_INLINE V dot(const Vector& a, const Vector& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

HWY_INLINE Vector times(const Matrix& a, const Vector& v) {
  const auto row = [&](int r) {
    return hn::MulAdd(a.m[r][0], v.x, hn::MulAdd(a.m[r][1], v.y, hn::Mul(a.m[r][2], v.z)));
  };
  return {row(0), row(1), row(2)};
}

/// Three vectors of lanes that lie one after the other.
HWY_INLINE Vector load(const double* at) {
  const D d;
  return {hn::LoadU(d, at), hn::LoadU(d, at + CellBlocks::kLanes), hn::LoadU(d, at + 2 * CellBlocks::kLanes)};
}

HWY_INLINE void store(const Vector& v, double* at) {
  const D d;
  hn::StoreU(v.x, d, at);
  hn::StoreU(v.y, d, at + CellBlocks::kLanes);
  hn::StoreU(v.z, d, at + 2 * CellBlocks::kLanes);
}

/// Numbers `stride` apart from where the indices say.
HWY_INLINE Vector gather(const double* base, const std::int32_t* indices, std::size_t stride) {
  const D d;
  const hn::RebindToSigned<D> wide;
  const hn::Rebind<std::int32_t, D> narrow;
  const auto index = hn::PromoteTo(wide, hn::LoadU(narrow, indices));
  return {hn::GatherIndex(d, base, index), hn::GatherIndex(d, base + stride, index),
          hn::GatherIndex(d, base + 2 * stride, index)};
}

HWY_INLINE Matrix rotation_of(const Quaternion& q) {
  const D d;
  const V one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
  const V x2 = hn::Mul(two, q.x), y2 = hn::Mul(two, q.y), z2 = hn::Mul(two, q.z);
  const V xx = hn::Mul(q.x, x2), yy = hn::Mul(q.y, y2), zz = hn::Mul(q.z, z2);
  const V xy = hn::Mul(q.x, y2), xz = hn::Mul(q.x, z2), yz = hn::Mul(q.y, z2);
  const V wx = hn::Mul(q.w, x2), wy = hn::Mul(q.w, y2), wz = hn::Mul(q.w, z2);
  return {{{hn::Sub(one, hn::Add(yy, zz)), hn::Sub(xy, wz), hn::Add(xz, wy)},
           {hn::Add(xy, wz), hn::Sub(one, hn::Add(xx, zz)), hn::Sub(yz, wx)},
           {hn::Sub(xz, wy), hn::Add(yz, wx), hn::Sub(one, hn::Add(xx, yy))}}};
}

/// Hamilton's product: R(p q) = R(p) R(q).
HWY_INLINE Quaternion product(const Quaternion& p, const Quaternion& q) {
  const auto sum = [](V a, V b, V c, V d, V e, V f, V g, V h) {  // a b + c d + e f + g h
    return hn::MulAdd(a, b, hn::MulAdd(c, d, hn::MulAdd(e, f, hn::Mul(g, h))));
  };
  const V nx = hn::Neg(p.x), ny = hn::Neg(p.y), nz = hn::Neg(p.z);
  return {sum(p.w, q.w, nx, q.x, ny, q.y, nz, q.z), sum(p.w, q.x, p.x, q.w, p.y, q.z, nz, q.y),
          sum(p.w, q.y, nx, q.z, p.y, q.w, p.z, q.x), sum(p.w, q.z, p.x, q.y, ny, q.x, p.z, q.w)};
}

HWY_INLINE V determinant(const V (&m)[3][3]) {
  const auto minor = [&](int a, int b) { return hn::MulSub(m[1][a], m[2][b], hn::Mul(m[1][b], m[2][a])); };
  return hn::MulAdd(m[0][0], minor(1, 2), hn::NegMulAdd(m[0][1], minor(0, 2), hn::Mul(m[0][2], minor(0, 1))));
}

/// Davenport's symmetric 4x4 matrix of B (see rotation_fit.cc), upper triangle.
struct Davenport {
  V k00, k01, k02, k03, k11, k12, k13, k22, k23, k33;
};

HWY_INLINE Davenport davenport(const Matrix& b) {
  const auto& m = b.m;
  const V yz = hn::Add(m[1][1], m[2][2]), yz_difference = hn::Sub(m[1][1], m[2][2]);
  return {hn::Add(m[0][0], yz),      hn::Sub(m[2][1], m[1][2]),
          hn::Sub(m[0][2], m[2][0]), hn::Sub(m[1][0], m[0][1]),
          hn::Sub(m[0][0], yz),      hn::Add(m[0][1], m[1][0]),
          hn::Add(m[0][2], m[2][0]), hn::Sub(yz_difference, m[0][0]),
          hn::Add(m[1][2], m[2][1]), hn::Neg(hn::Add(yz_difference, m[0][0]))};
}

/// The 2x2 minors of the upper two rows and of the lower two rows of a symmetric 4x4 matrix.
struct Minors {
  V s0, s1, s2, s3, s4, s5, c0, c1, c2, c3, c4, c5;
};

HWY_INLINE Minors minors(const Davenport& k) {
  const auto minor = [](V a, V b, V c, V d) { return hn::MulSub(a, d, hn::Mul(b, c)); };
  return {minor(k.k00, k.k01, k.k01, k.k11), minor(k.k00, k.k02, k.k01, k.k12),
          minor(k.k00, k.k03, k.k01, k.k13), minor(k.k01, k.k02, k.k11, k.k12),
          minor(k.k01, k.k03, k.k11, k.k13), minor(k.k02, k.k03, k.k12, k.k13),
          minor(k.k02, k.k12, k.k03, k.k13), minor(k.k02, k.k22, k.k03, k.k23),
          minor(k.k02, k.k23, k.k03, k.k33), minor(k.k12, k.k22, k.k13, k.k23),
          minor(k.k12, k.k23, k.k13, k.k33), minor(k.k22, k.k23, k.k23, k.k33)};
}

HWY_INLINE V determinant(const Minors& m) {
  const V plus = hn::MulAdd(m.s0, m.c5, hn::MulAdd(m.s2, m.c3, hn::MulAdd(m.s3, m.c2, hn::Mul(m.s5, m.c0))));
  return hn::NegMulAdd(m.s1, m.c4, hn::NegMulAdd(m.s4, m.c1, plus));
}

/// Largest root of x^4 - 2 |B|^2 x^2 - 8 det(B) x + det(K), by Newton from an upper bound, from which it
/// descends monotonically.
HWY_INLINE V largest_eigenvalue(V upper_bound, V norm2, V det_b, V det_k) {
  const D d;
  const V c2 = hn::Mul(hn::Set(d, -2.0), norm2), c1 = hn::Mul(hn::Set(d, -8.0), det_b);
  const V twice_c2 = hn::Add(c2, c2), four = hn::Set(d, 4.0), enough = hn::Set(d, 1e-12);
  V x = upper_bound;
  M is_on = hn::Eq(x, x);
  for (int iteration = 0; iteration < 50; ++iteration) {
    const V x2 = hn::Mul(x, x);
    const V value = hn::MulAdd(hn::MulAdd(hn::Add(x2, c2), x, c1), x, det_k);
    const V slope = hn::MulAdd(hn::MulAdd(four, x2, twice_c2), x, c1);
    const V next = hn::Sub(x, hn::Div(value, slope));
    is_on = hn::And(is_on, hn::And(hn::Gt(slope, hn::Zero(d)), hn::Lt(next, x)));
    const V step = hn::Sub(x, next);
    const M is_far = hn::Ge(step, hn::Mul(enough, x));
    x = hn::IfThenElse(is_on, next, x);
    is_on = hn::And(is_on, is_far);
    if (hn::AllFalse(d, is_on)) break;
  }
  return x;
}

/// The null vector of the singular matrix k: the column of its adjugate with the largest diagonal entry, which
/// is its longest. Not normalised.
HWY_INLINE Quaternion null_vector(const Davenport& k) {
  const Minors m = minors(k);
  const auto sum = [](V a, V b, V c, V d4, V e, V f) {  // a b - c d + e f
    return hn::MulAdd(a, b, hn::NegMulAdd(c, d4, hn::Mul(e, f)));
  };
  const V a00 = sum(k.k11, m.c5, k.k12, m.c4, k.k13, m.c3);
  const V a01 = hn::Neg(sum(k.k01, m.c5, k.k02, m.c4, k.k03, m.c3));
  const V a02 = sum(k.k13, m.s5, k.k23, m.s4, k.k33, m.s3);
  const V a03 = hn::Neg(sum(k.k12, m.s5, k.k22, m.s4, k.k23, m.s3));
  const V a11 = sum(k.k00, m.c5, k.k02, m.c2, k.k03, m.c1);
  const V a12 = hn::Neg(sum(k.k03, m.s5, k.k23, m.s2, k.k33, m.s1));
  const V a13 = sum(k.k02, m.s5, k.k22, m.s2, k.k23, m.s1);
  const V a22 = sum(k.k03, m.s4, k.k13, m.s2, k.k33, m.s0);
  const V a23 = hn::Neg(sum(k.k02, m.s4, k.k12, m.s2, k.k23, m.s0));
  const V a33 = sum(k.k02, m.s3, k.k12, m.s1, k.k22, m.s0);
  Quaternion q{a00, a01, a02, a03};
  V longest = hn::Abs(a00);
  const auto take_if_longer = [&](V diagonal, const Quaternion& other) {
    const M is_longer = hn::Gt(hn::Abs(diagonal), longest);
    longest = hn::IfThenElse(is_longer, hn::Abs(diagonal), longest);
    q = {hn::IfThenElse(is_longer, other.w, q.w), hn::IfThenElse(is_longer, other.x, q.x),
         hn::IfThenElse(is_longer, other.y, q.y), hn::IfThenElse(is_longer, other.z, q.z)};
  };
  take_if_longer(a11, {a01, a11, a12, a13});
  take_if_longer(a22, {a02, a12, a22, a23});
  take_if_longer(a33, {a03, a13, a23, a33});
  return q;
}

/// One Newton step for <R exp([w]x), B> at R = R(q). False where R is not near the maximum.
HWY_INLINE M polish(const Matrix& b, Quaternion& q) {
  const D d;
  const Matrix r = rotation_of(q);
  Matrix m;  // R^T B
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      m.m[i][j] =
          hn::MulAdd(r.m[0][i], b.m[0][j], hn::MulAdd(r.m[1][i], b.m[1][j], hn::Mul(r.m[2][i], b.m[2][j])));
    }
  }
  const Vector slope{hn::Sub(m.m[2][1], m.m[1][2]), hn::Sub(m.m[0][2], m.m[2][0]),
                     hn::Sub(m.m[1][0], m.m[0][1])};
  const V minus_half = hn::Set(d, -0.5);
  const V trace = hn::Add(m.m[0][0], hn::Add(m.m[1][1], m.m[2][2]));
  const V xx = hn::Add(m.m[1][1], m.m[2][2]), yy = hn::Add(m.m[0][0], m.m[2][2]),
          zz = hn::Add(m.m[0][0], m.m[1][1]);
  const V xy = hn::Mul(minus_half, hn::Add(m.m[0][1], m.m[1][0]));
  const V xz = hn::Mul(minus_half, hn::Add(m.m[0][2], m.m[2][0]));
  const V yz = hn::Mul(minus_half, hn::Add(m.m[1][2], m.m[2][1]));
  const auto minor = [](V a, V b2, V c, V e) { return hn::MulSub(a, e, hn::Mul(b2, c)); };
  const V ixx = minor(yy, yz, yz, zz), iyy = minor(xx, xz, xz, zz), izz = minor(xx, xy, xy, yy);
  const V ixy = minor(xz, xy, zz, yz), ixz = minor(xy, xz, yy, yz), iyz = minor(xz, xx, yz, xy);
  const V det = hn::MulAdd(xx, ixx, hn::MulAdd(xy, ixy, hn::Mul(xz, ixz)));
  const V least = hn::Mul(hn::Set(d, 1e-8), hn::Mul(trace, hn::Mul(trace, trace)));
  M is_good = hn::And(hn::Gt(xx, hn::Zero(d)), hn::And(hn::Gt(izz, hn::Zero(d)), hn::Gt(det, least)));
  const V scale = hn::Div(hn::Set(d, 1.0), det);
  const auto row = [&](V a, V b2, V c) { return hn::Mul(scale, dot({a, b2, c}, slope)); };
  const Vector w{row(ixx, ixy, ixz), row(ixy, iyy, iyz), row(ixz, iyz, izz)};
  const V size = dot(w, w);
  is_good = hn::And(is_good, hn::Lt(size, hn::Set(d, 1e-4)));
  const V half = hn::Set(d, 0.5);
  q = product(q, {hn::Sqrt(hn::NegMulAdd(hn::Set(d, 0.25), size, hn::Set(d, 1.0))), hn::Mul(half, w.x),
                  hn::Mul(half, w.y), hn::Mul(half, w.z)});
  return is_good;
}

/// The best rotations for B = sum_j w_ij (x_i - x_j) (p_i - p_j)^T; `bound` >= <R, B> for every rotation.
/// False in lanes where it is not certain.
HWY_INLINE M fit(const Matrix& b_any_size, V bound, Matrix& rotation) {
  const D d;
  V size = hn::Zero(d);
  for (const auto& row : b_any_size.m) {
    for (const V& entry : row) size = hn::Max(size, hn::Abs(entry));
  }
  const V scale = hn::Div(hn::Set(d, 1.0), size);
  Matrix b;
  V norm2 = hn::Zero(d);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      b.m[i][j] = hn::Mul(scale, b_any_size.m[i][j]);
      norm2 = hn::MulAdd(b.m[i][j], b.m[i][j], norm2);
    }
  }
  Davenport k = davenport(b);
  const V upper = hn::Min(hn::Mul(scale, bound), hn::Sqrt(hn::Mul(hn::Set(d, 3.0), norm2)));
  const V x = largest_eigenvalue(upper, norm2, determinant(b.m), determinant(minors(k)));
  k.k00 = hn::Sub(k.k00, x);
  k.k11 = hn::Sub(k.k11, x);
  k.k22 = hn::Sub(k.k22, x);
  k.k33 = hn::Sub(k.k33, x);
  Quaternion q = null_vector(k);
  const V length2 = hn::MulAdd(q.w, q.w, dot({q.x, q.y, q.z}, {q.x, q.y, q.z}));
  const V shorten = hn::Div(hn::Set(d, 1.0), hn::Sqrt(length2));
  q = {hn::Mul(q.w, shorten), hn::Mul(q.x, shorten), hn::Mul(q.y, shorten), hn::Mul(q.z, shorten)};
  const M is_good = hn::And(hn::Gt(length2, hn::Set(d, 1e-12)), polish(b, q));
  rotation = rotation_of(q);
  return is_good;
}

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

void EvaluateBlocks(const CellBlocks& blocks, std::size_t first, std::size_t last, const double* x,
                    bool is_fit, BlockState& state) {
  constexpr std::size_t kLanes = CellBlocks::kLanes;
  const D d;
  for (std::size_t block = first; block < last; ++block) {
    const std::size_t begin = blocks.first_slot[block], end = blocks.first_slot[block + 1];
    double* const rotations = state.rotations.data() + block * 9 * kLanes;
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
      const Vector centre = gather(x, blocks.row.data() + block * kLanes + lane, 1);
      V moved_size = hn::Zero(d);
      Matrix b;
      for (auto& row : b.m) {
        for (V& entry : row) entry = hn::Zero(d);
      }
      for (std::size_t slot = begin; slot < end; ++slot) {
        const Vector neighbour = gather(x, blocks.neighbour_row.data() + slot * kLanes + lane, 1);
        const Vector edge{hn::Sub(centre.x, neighbour.x), hn::Sub(centre.y, neighbour.y),
                          hn::Sub(centre.z, neighbour.z)};
        store(edge, state.residuals.data() + slot * 3 * kLanes + lane);
        if (!is_fit) continue;
        const V w = hn::LoadU(d, blocks.weight.data() + slot * kLanes + lane);
        const Vector rest = load(blocks.rest_edge.data() + slot * 3 * kLanes + lane);
        const Vector we{hn::Mul(w, edge.x), hn::Mul(w, edge.y), hn::Mul(w, edge.z)};
        moved_size = hn::Add(moved_size, dot(we, edge));
        const auto add = [&](int r, V scale) {
          b.m[r][0] = hn::MulAdd(scale, rest.x, b.m[r][0]);
          b.m[r][1] = hn::MulAdd(scale, rest.y, b.m[r][1]);
          b.m[r][2] = hn::MulAdd(scale, rest.z, b.m[r][2]);
        };
        add(0, we.x);
        add(1, we.y);
        add(2, we.z);
      }
      if (is_fit) fit_lanes(b, moved_size, blocks.rest_size.data() + block * kLanes, rotations, lane);

      const Matrix rotation = load_matrix(rotations + lane);
      V squared = hn::Zero(d);
      Vector sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
      for (std::size_t slot = begin; slot < end; ++slot) {
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
