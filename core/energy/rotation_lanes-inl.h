// Fits the rotations of many cells at a time, one per lane: the method of rotation_fit.cc in vector instructions.
// cell_kernel.cc and membrane_kernel.cc include this file once for each instruction set, as Highway requires; hence this include guard.
#if defined(LPDEFORM_ROTATION_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LPDEFORM_ROTATION_LANES_INL_H
#undef LPDEFORM_ROTATION_LANES_INL_H
#else
#define LPDEFORM_ROTATION_LANES_INL_H
#endif

#include <hwy/highway.h>

#include "core/energy/cell_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kLanes = CellBlocks::kLanes;

using D = hn::CappedTag<double, kLanes>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

constexpr std::size_t kVectors = kLanes / hn::MaxLanes(D());  // vectors per block

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

HWY_INLINE Vector difference(const Vector& a, const Vector& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

HWY_INLINE Vector times(const Matrix& a, const Vector& v) {
  const auto row = [&](int r) {
    return hn::MulAdd(a.m[r][0], v.x, hn::MulAdd(a.m[r][1], v.y, hn::Mul(a.m[r][2], v.z)));
  };
  return {row(0), row(1), row(2)};
}

/// Loads three vectors of lanes that are consecutive in memory.
HWY_INLINE Vector load(const double* at) {
  const D d;
  return {hn::LoadU(d, at), hn::LoadU(d, at + kLanes), hn::LoadU(d, at + 2 * kLanes)};
}

HWY_INLINE void store(const Vector& v, double* at) {
  const D d;
  hn::StoreU(v.x, d, at);
  hn::StoreU(v.y, d, at + kLanes);
  hn::StoreU(v.z, d, at + 2 * kLanes);
}

#if HWY_TARGET == HWY_AVX2
/// The columns of four rows.
HWY_INLINE Vector transposed(V r0, V r1, V r2, V r3) {
  const D d;
  const V xz01 = hn::InterleaveLower(d, r0, r1), y01 = hn::InterleaveUpper(d, r0, r1);
  const V xz23 = hn::InterleaveLower(d, r2, r3), y23 = hn::InterleaveUpper(d, r2, r3);
  return {hn::ConcatLowerLower(d, xz23, xz01), hn::ConcatLowerLower(d, y23, y01),
          hn::ConcatUpperUpper(d, xz23, xz01)};
}
#endif

/// Gathers the rows of these vertices, kRow numbers each.
HWY_INLINE Vector gather(const double* rows, const std::int32_t* indices) {
  const D d;
#if HWY_TARGET == HWY_AVX2
  const hn::FixedTag<double, 4> quad;
  const auto row = [&](int k) { return hn::LoadU(quad, rows + kRow * static_cast<std::size_t>(indices[k])); };
  return transposed(row(0), row(1), row(2), row(3));
#else
  const hn::RebindToSigned<D> wide;
  const hn::Rebind<std::int32_t, D> narrow;
  const auto index = hn::ShiftLeft<2>(hn::PromoteTo(wide, hn::LoadU(narrow, indices)));
  return {hn::GatherIndex(d, rows, index), hn::GatherIndex(d, rows + 1, index),
          hn::GatherIndex(d, rows + 2, index)};
#endif
}

/// Gathers the rows of these vertices, three numbers each.
HWY_INLINE Vector gather_packed(const double* rows, const std::int32_t* indices) {
  const D d;
#if HWY_TARGET == HWY_AVX2
  const hn::FixedTag<double, 4> quad;
  const auto three = hn::FirstN(quad, 3);
  const auto row = [&](int k) {
    return hn::MaskedLoad(three, quad, rows + 3 * static_cast<std::size_t>(indices[k]));
  };
  return transposed(row(0), row(1), row(2), row(3));
#else
  const hn::RebindToSigned<D> wide;
  const hn::Rebind<std::int32_t, D> narrow;
  const auto vertex = hn::PromoteTo(wide, hn::LoadU(narrow, indices));
  const auto index = hn::Add(vertex, hn::ShiftLeft<1>(vertex));
  return {hn::GatherIndex(d, rows, index), hn::GatherIndex(d, rows + 1, index),
          hn::GatherIndex(d, rows + 2, index)};
#endif
}

/// Stores consecutive rows of three numbers in single precision, one row per lane.
HWY_INLINE void store_packed(const Vector& v, float* at) {
  const hn::Rebind<float, D> d;
  hn::StoreInterleaved3(hn::DemoteTo(d, v.x), hn::DemoteTo(d, v.y), hn::DemoteTo(d, v.z), d, at);
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

/// x^4 - 2 |B|^2 x^2 - 8 det(B) x + det(K), and an upper bound of its largest root.
struct Quartic {
  V c2, c1, c0, bound;
};

/// The largest roots, by Newton's method from above, which descends monotonically. All vectors are iterated together,
/// because each one waits for its own divisions.
HWY_INLINE void largest_roots(const Quartic (&q)[kVectors], V (&x)[kVectors]) {
  const D d;
  const V four = hn::Set(d, 4.0), enough = hn::Set(d, 1e-6);
  M is_on[kVectors];
  for (std::size_t v = 0; v < kVectors; ++v) {
    x[v] = q[v].bound;
    is_on[v] = hn::Eq(x[v], x[v]);
  }
  for (int iteration = 0; iteration < 50; ++iteration) {
    bool is_done = true;
    for (std::size_t v = 0; v < kVectors; ++v) {
      const V x2 = hn::Mul(x[v], x[v]);
      const V value = hn::MulAdd(hn::MulAdd(hn::Add(x2, q[v].c2), x[v], q[v].c1), x[v], q[v].c0);
      const V slope = hn::MulAdd(hn::MulAdd(four, x2, hn::Add(q[v].c2, q[v].c2)), x[v], q[v].c1);
      const V next = hn::Sub(x[v], hn::Div(value, slope));
      is_on[v] = hn::And(is_on[v], hn::And(hn::Gt(slope, hn::Zero(d)), hn::Lt(next, x[v])));
      const M is_far = hn::Ge(hn::Sub(x[v], next), hn::Mul(enough, x[v]));
      x[v] = hn::IfThenElse(is_on[v], next, x[v]);
      is_on[v] = hn::And(is_on[v], is_far);
      is_done = is_done && hn::AllFalse(d, is_on[v]);
    }
    if (is_done) break;
  }
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

/// One Newton step for <R exp([w]x), B> at R = R(q). False if R is not near the maximum.
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
  is_good = hn::And(is_good, hn::Lt(size, hn::Set(d, 1e-12)));
  const V half = hn::Set(d, 0.5);
  q = product(q, {hn::Sqrt(hn::NegMulAdd(hn::Set(d, 0.25), size, hn::Set(d, 1.0))), hn::Mul(half, w.x),
                  hn::Mul(half, w.y), hn::Mul(half, w.z)});
  return is_good;
}

/// B divided by its largest entry, its Davenport matrix, and the quartic of the eigenvalues. `bound` >= <R, B> for
/// every rotation.
struct Scaled {
  Matrix b;
  Davenport k;
};

HWY_INLINE Scaled scaled(const Matrix& b, V bound, Quartic& quartic) {
  const D d;
  V size = hn::Zero(d);
  for (const auto& row : b.m) {
    for (const V& entry : row) size = hn::Max(size, hn::Abs(entry));
  }
  const V scale = hn::Div(hn::Set(d, 1.0), size);
  Scaled result;
  V norm2 = hn::Zero(d);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      result.b.m[i][j] = hn::Mul(scale, b.m[i][j]);
      norm2 = hn::MulAdd(result.b.m[i][j], result.b.m[i][j], norm2);
    }
  }
  result.k = davenport(result.b);
  quartic = {hn::Mul(hn::Set(d, -2.0), norm2), hn::Mul(hn::Set(d, -8.0), determinant(result.b.m)),
             determinant(minors(result.k)),
             hn::Min(hn::Mul(scale, bound), hn::Sqrt(hn::Mul(hn::Set(d, 3.0), norm2)))};
  return result;
}

/// The rotation for the largest eigenvalue x. False in lanes with an uncertain result.
HWY_INLINE M rotation_at(const Scaled& s, V x, Matrix& rotation) {
  const D d;
  Davenport k = s.k;
  k.k00 = hn::Sub(k.k00, x);
  k.k11 = hn::Sub(k.k11, x);
  k.k22 = hn::Sub(k.k22, x);
  k.k33 = hn::Sub(k.k33, x);
  Quaternion q = null_vector(k);
  const V length2 = hn::MulAdd(q.w, q.w, dot({q.x, q.y, q.z}, {q.x, q.y, q.z}));
  const V shorten = hn::Div(hn::Set(d, 1.0), hn::Sqrt(length2));
  q = {hn::Mul(q.w, shorten), hn::Mul(q.x, shorten), hn::Mul(q.y, shorten), hn::Mul(q.z, shorten)};
  const M is_good = hn::And(hn::Gt(length2, hn::Set(d, 1e-12)), polish(s.b, q));
  rotation = rotation_of(q);
  return is_good;
}

/// The best rotations for B = sum_j w_ij (x_i - x_j) (p_i - p_j)^T; `bound` >= <R, B> for every rotation.
/// False in lanes with an uncertain result.
HWY_INLINE void fit(const Matrix (&b)[kVectors], const V (&bound)[kVectors], Matrix (&rotation)[kVectors],
                    M (&is_good)[kVectors]) {
  Scaled s[kVectors];
  Quartic quartic[kVectors];
  V x[kVectors];
  for (std::size_t v = 0; v < kVectors; ++v) s[v] = scaled(b[v], bound[v], quartic[v]);
  largest_roots(quartic, x);
  for (std::size_t v = 0; v < kVectors; ++v) is_good[v] = rotation_at(s[v], x[v], rotation[v]);
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
