// Fits the rotations of many cells at a time, one per lane: the method of rotation_fit.cc in vector instructions. Rotations
// are found in single precision. Newton steps in double precision make them exact.
// cell_kernel.cc, membrane_kernel.cc and turn_kernel.cc include this file once for each instruction set, as Highway requires; hence this include guard.
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

// The same in single precision, in which rotations are first found.
using SingleD = hn::CappedTag<float, kLanes>;
using S = hn::Vec<SingleD>;
constexpr std::size_t kSingleVectors = kLanes / hn::MaxLanes(SingleD());
constexpr double kNear = 2e-6;  // radians; a Newton step that is no longer is the last

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

HWY_INLINE Vector scaled(V factor, const Vector& a) {
  return {hn::Mul(factor, a.x), hn::Mul(factor, a.y), hn::Mul(factor, a.z)};
}

HWY_INLINE Vector cross(const Vector& a, const Vector& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
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
/// The rows of these vertices, `stride` numbers apart. Loads of two numbers leave only shuffles within halves of a vector.
template <std::size_t stride>
HWY_INLINE Vector gather_rows(const double* rows, const std::int32_t* indices) {
  const D d;
  const hn::FixedTag<double, 2> pair;
  const auto pairs = [&](int low, int high, std::size_t from) {
    const auto at = [&](int k) {
      return hn::LoadU(pair, rows + stride * static_cast<std::size_t>(indices[k]) + from);
    };
    return hn::Combine(d, at(high), at(low));
  };
  const V xy02 = pairs(0, 2, 0), xy13 = pairs(1, 3, 0), yz02 = pairs(0, 2, 1), yz13 = pairs(1, 3, 1);
  return {hn::InterleaveLower(d, xy02, xy13), hn::InterleaveUpper(d, xy02, xy13),
          hn::InterleaveUpper(d, yz02, yz13)};
}
#else
template <std::size_t stride>
HWY_INLINE Vector gather_rows(const double* rows, const std::int32_t* indices) {
  const D d;
  const hn::RebindToSigned<D> wide;
  const hn::Rebind<std::int32_t, D> narrow;
  static_assert(stride == kRow || stride == 3);
  const auto vertex = hn::PromoteTo(wide, hn::LoadU(narrow, indices));
  const auto index = stride == kRow ? hn::ShiftLeft<2>(vertex) : hn::Add(vertex, hn::ShiftLeft<1>(vertex));
  return {hn::GatherIndex(d, rows, index), hn::GatherIndex(d, rows + 1, index),
          hn::GatherIndex(d, rows + 2, index)};
}
#endif

/// Gathers the rows of these vertices, kRow numbers each.
HWY_INLINE Vector gather(const double* rows, const std::int32_t* indices) {
  return gather_rows<kRow>(rows, indices);
}

/// Gathers the rows of these vertices, three numbers each.
HWY_INLINE Vector gather_packed(const double* rows, const std::int32_t* indices) {
  return gather_rows<3>(rows, indices);
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

HWY_INLINE S determinant(const S (&m)[3][3]) {
  const auto minor = [&](int a, int b) { return hn::MulSub(m[1][a], m[2][b], hn::Mul(m[1][b], m[2][a])); };
  return hn::MulAdd(m[0][0], minor(1, 2), hn::NegMulAdd(m[0][1], minor(0, 2), hn::Mul(m[0][2], minor(0, 1))));
}

/// Davenport's symmetric 4x4 matrix of B (see rotation_fit.cc), upper triangle.
struct Davenport {
  S k00, k01, k02, k03, k11, k12, k13, k22, k23, k33;
};

HWY_INLINE Davenport davenport(const S (&m)[3][3]) {
  const S yz = hn::Add(m[1][1], m[2][2]), yz_difference = hn::Sub(m[1][1], m[2][2]);
  return {hn::Add(m[0][0], yz),      hn::Sub(m[2][1], m[1][2]),
          hn::Sub(m[0][2], m[2][0]), hn::Sub(m[1][0], m[0][1]),
          hn::Sub(m[0][0], yz),      hn::Add(m[0][1], m[1][0]),
          hn::Add(m[0][2], m[2][0]), hn::Sub(yz_difference, m[0][0]),
          hn::Add(m[1][2], m[2][1]), hn::Neg(hn::Add(yz_difference, m[0][0]))};
}

/// The 2x2 minors of the upper two rows and of the lower two rows of a symmetric 4x4 matrix.
struct Minors {
  S s0, s1, s2, s3, s4, s5, c0, c1, c2, c3, c4, c5;
};

HWY_INLINE Minors minors(const Davenport& k) {
  const auto minor = [](S a, S b, S c, S d) { return hn::MulSub(a, d, hn::Mul(b, c)); };
  return {minor(k.k00, k.k01, k.k01, k.k11), minor(k.k00, k.k02, k.k01, k.k12),
          minor(k.k00, k.k03, k.k01, k.k13), minor(k.k01, k.k02, k.k11, k.k12),
          minor(k.k01, k.k03, k.k11, k.k13), minor(k.k02, k.k03, k.k12, k.k13),
          minor(k.k02, k.k12, k.k03, k.k13), minor(k.k02, k.k22, k.k03, k.k23),
          minor(k.k02, k.k23, k.k03, k.k33), minor(k.k12, k.k22, k.k13, k.k23),
          minor(k.k12, k.k23, k.k13, k.k33), minor(k.k22, k.k23, k.k23, k.k33)};
}

HWY_INLINE S determinant(const Minors& m) {
  const S plus = hn::MulAdd(m.s0, m.c5, hn::MulAdd(m.s2, m.c3, hn::MulAdd(m.s3, m.c2, hn::Mul(m.s5, m.c0))));
  return hn::NegMulAdd(m.s1, m.c4, hn::NegMulAdd(m.s4, m.c1, plus));
}

/// x^4 - 2 |B|^2 x^2 - 8 det(B) x + det(K), and an upper bound of its largest root.
struct Quartic {
  S c2, c1, c0, bound;
};

/// The largest roots, by Newton's method from above, which descends monotonically. All vectors are iterated together,
/// because each one waits for its own divisions.
HWY_INLINE void largest_roots(const Quartic (&q)[kSingleVectors], S (&x)[kSingleVectors]) {
  const SingleD d;
  const S four = hn::Set(d, 4.0F), enough = hn::Set(d, 1e-4F);
  hn::Mask<SingleD> is_on[kSingleVectors];
  for (std::size_t v = 0; v < kSingleVectors; ++v) {
    x[v] = q[v].bound;
    is_on[v] = hn::Eq(x[v], x[v]);
  }
  for (int iteration = 0; iteration < 50; ++iteration) {
    bool is_done = true;
    for (std::size_t v = 0; v < kSingleVectors; ++v) {
      const S x2 = hn::Mul(x[v], x[v]);
      const S value = hn::MulAdd(hn::MulAdd(hn::Add(x2, q[v].c2), x[v], q[v].c1), x[v], q[v].c0);
      const S slope = hn::MulAdd(hn::MulAdd(four, x2, hn::Add(q[v].c2, q[v].c2)), x[v], q[v].c1);
      const S next = hn::Sub(x[v], hn::Div(value, slope));
      is_on[v] = hn::And(is_on[v], hn::And(hn::Gt(slope, hn::Zero(d)), hn::Lt(next, x[v])));
      const auto is_far = hn::Ge(hn::Sub(x[v], next), hn::Mul(enough, x[v]));
      x[v] = hn::IfThenElse(is_on[v], next, x[v]);
      is_on[v] = hn::And(is_on[v], is_far);
      is_done = is_done && hn::AllFalse(d, is_on[v]);
    }
    if (is_done) break;
  }
}

struct SingleQuaternion {
  S w, x, y, z;
};

/// The null vector of the singular matrix k, normalised: the column of its adjugate with the largest diagonal entry, which
/// is its longest. Not finite if all columns are 0, and not of length 1 if they are so short that their squares underflow.
HWY_INLINE SingleQuaternion null_vector(const Davenport& k) {
  const Minors m = minors(k);
  const auto sum = [](S a, S b, S c, S d4, S e, S f) {  // a b - c d + e f
    return hn::MulAdd(a, b, hn::NegMulAdd(c, d4, hn::Mul(e, f)));
  };
  const S a00 = sum(k.k11, m.c5, k.k12, m.c4, k.k13, m.c3);
  const S a01 = hn::Neg(sum(k.k01, m.c5, k.k02, m.c4, k.k03, m.c3));
  const S a02 = sum(k.k13, m.s5, k.k23, m.s4, k.k33, m.s3);
  const S a03 = hn::Neg(sum(k.k12, m.s5, k.k22, m.s4, k.k23, m.s3));
  const S a11 = sum(k.k00, m.c5, k.k02, m.c2, k.k03, m.c1);
  const S a12 = hn::Neg(sum(k.k03, m.s5, k.k23, m.s2, k.k33, m.s1));
  const S a13 = sum(k.k02, m.s5, k.k22, m.s2, k.k23, m.s1);
  const S a22 = sum(k.k03, m.s4, k.k13, m.s2, k.k33, m.s0);
  const S a23 = hn::Neg(sum(k.k02, m.s4, k.k12, m.s2, k.k23, m.s0));
  const S a33 = sum(k.k02, m.s3, k.k12, m.s1, k.k22, m.s0);
  SingleQuaternion q{a00, a01, a02, a03};
  S longest = hn::Abs(a00);
  const auto take_if_longer = [&](S diagonal, const SingleQuaternion& other) {
    const auto is_longer = hn::Gt(hn::Abs(diagonal), longest);
    longest = hn::IfThenElse(is_longer, hn::Abs(diagonal), longest);
    q = {hn::IfThenElse(is_longer, other.w, q.w), hn::IfThenElse(is_longer, other.x, q.x),
         hn::IfThenElse(is_longer, other.y, q.y), hn::IfThenElse(is_longer, other.z, q.z)};
  };
  take_if_longer(a11, {a01, a11, a12, a13});
  take_if_longer(a22, {a02, a12, a22, a23});
  take_if_longer(a33, {a03, a13, a23, a33});
  const S length2 = hn::MulAdd(q.w, q.w, hn::MulAdd(q.x, q.x, hn::MulAdd(q.y, q.y, hn::Mul(q.z, q.z))));
  const S shorten = hn::Div(hn::Set(SingleD(), 1.0F), hn::Sqrt(length2));
  return {hn::Mul(q.w, shorten), hn::Mul(q.x, shorten), hn::Mul(q.y, shorten), hn::Mul(q.z, shorten)};
}

/// One Newton step for <R exp([w]x), B> at R = R(q), which changes q in any case. The error falls with its third power. False if the
/// step was longer than kNear, or if R is not near the maximum.
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
  is_good = hn::And(is_good, hn::Lt(size, hn::Set(d, kNear * kNear)));
  const V half = hn::Set(d, 0.5);
  q = product(q, {hn::Sqrt(hn::NegMulAdd(hn::Set(d, 0.25), size, hn::Set(d, 1.0))), hn::Mul(half, w.x),
                  hn::Mul(half, w.y), hn::Mul(half, w.z)});
  return is_good;
}

/// Divides B and an upper bound of <R, B> by the largest entry of B, unless that is almost 0.
HWY_INLINE void scale(Matrix& b, V& bound) {
  const D d;
  V size = hn::Zero(d);
  for (const auto& row : b.m) {
    for (const V& entry : row) size = hn::Max(size, hn::Abs(entry));
  }
  const V one = hn::Set(d, 1.0);
  const V over = hn::IfThenElse(hn::Gt(size, hn::Set(d, 1e-300)), hn::Div(one, size), one);
  for (auto& row : b.m) {
    for (V& entry : row) entry = hn::Mul(over, entry);
  }
  bound = hn::Mul(over, bound);
}

#if HWY_MAX_BYTES >= 8 * 8 || HWY_TARGET == HWY_SCALAR  // kLanes doubles, or one
/// Vector s of a block in single precision. `entry` returns vector v of the block in double precision.
template <typename Entry>
HWY_INLINE S single(std::size_t s, const Entry& entry) {
  return hn::DemoteTo(SingleD(), entry(s));
}

/// Vector v of a block in double precision. `entry` returns vector s of the block in single precision.
template <typename Entry>
HWY_INLINE V widened(std::size_t v, const Entry& entry) {
  return hn::PromoteTo(D(), entry(v));
}
#else
template <typename Entry>
HWY_INLINE S single(std::size_t s, const Entry& entry) {
  const hn::Rebind<float, D> half;
  return hn::Combine(SingleD(), hn::DemoteTo(half, entry(2 * s + 1)), hn::DemoteTo(half, entry(2 * s)));
}

template <typename Entry>
HWY_INLINE V widened(std::size_t v, const Entry& entry) {
  const hn::Rebind<float, D> half;
  const S from = entry(v / 2);
  return hn::PromoteTo(D(), v % 2 == 0 ? hn::LowerHalf(half, from) : hn::UpperHalf(half, from));
}
#endif

/// The rotations of a block, as quaternions, to single precision. B and the bounds are scaled.
HWY_INLINE void fit_roughly(const Matrix (&matrices)[kVectors], const V (&bounds)[kVectors],
                            SingleQuaternion (&q)[kSingleVectors]) {
  const SingleD d;
  Davenport k[kSingleVectors];
  Quartic quartic[kSingleVectors];
  S x[kSingleVectors];
  for (std::size_t s = 0; s < kSingleVectors; ++s) {
    S b[3][3], norm2 = hn::Zero(d);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        b[i][j] = single(s, [&](std::size_t v) { return matrices[v].m[i][j]; });
        norm2 = hn::MulAdd(b[i][j], b[i][j], norm2);
      }
    }
    const S bound = single(s, [&](std::size_t v) { return bounds[v]; });
    k[s] = davenport(b);
    quartic[s] = {hn::Mul(hn::Set(d, -2.0F), norm2), hn::Mul(hn::Set(d, -8.0F), determinant(b)),
                  determinant(minors(k[s])), hn::Min(bound, hn::Sqrt(hn::Mul(hn::Set(d, 3.0F), norm2)))};
  }
  largest_roots(quartic, x);
  for (std::size_t s = 0; s < kSingleVectors; ++s) {
    k[s].k00 = hn::Sub(k[s].k00, x[s]);
    k[s].k11 = hn::Sub(k[s].k11, x[s]);
    k[s].k22 = hn::Sub(k[s].k22, x[s]);
    k[s].k33 = hn::Sub(k[s].k33, x[s]);
    q[s] = null_vector(k[s]);
  }
}

/// The rotation near q. False in lanes with an uncertain result. q is of length 1 to single precision, or else a null vector of which
/// the square underflowed. A second step is for lanes in which B is nearly of rank 1, so that q is less precise.
HWY_INLINE M polished(const Matrix& b, Quaternion q, Matrix& rotation) {
  const D d;
  const V one = hn::Set(d, 1.0);
  const V excess = hn::Sub(hn::MulAdd(q.w, q.w, dot({q.x, q.y, q.z}, {q.x, q.y, q.z})), one);
  const V lengthen =
      hn::MulAdd(hn::MulAdd(hn::Set(d, 0.375), excess, hn::Set(d, -0.5)), excess, one);  // 1 / |q|
  q = {hn::Mul(q.w, lengthen), hn::Mul(q.x, lengthen), hn::Mul(q.y, lengthen), hn::Mul(q.z, lengthen)};
  const M is_unit = hn::Lt(hn::Abs(excess), hn::Set(d, 1e-5));
  const M is_near = hn::And(is_unit, polish(b, q));
  rotation = rotation_of(q);
  if (HWY_LIKELY(hn::AllTrue(d, is_near))) return is_near;
  const M is_good = polish(b, q);
  const Matrix again = rotation_of(q);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation.m[i][j] = hn::IfThenElse(is_near, rotation.m[i][j], again.m[i][j]);
  }
  return hn::Or(is_near, hn::And(is_unit, is_good));
}

/// The best rotations for B = sum_j w_ij (x_i - x_j) (p_i - p_j)^T; `bound` >= <R, B> for every rotation. Scales both.
/// `is_good` is false in lanes with an uncertain result.
HWY_INLINE void fit(Matrix (&b)[kVectors], V (&bound)[kVectors], Matrix (&rotation)[kVectors],
                    M (&is_good)[kVectors]) {
  SingleQuaternion q[kSingleVectors];
  for (std::size_t v = 0; v < kVectors; ++v) scale(b[v], bound[v]);
  fit_roughly(b, bound, q);
  for (std::size_t v = 0; v < kVectors; ++v) {
    const Quaternion rough{
        widened(v, [&](std::size_t k) { return q[k].w; }), widened(v, [&](std::size_t k) { return q[k].x; }),
        widened(v, [&](std::size_t k) { return q[k].y; }), widened(v, [&](std::size_t k) { return q[k].z; })};
    is_good[v] = polished(b[v], rough, rotation[v]);
  }
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
