#include "core/energy/membrane_kernel.h"

// This file is compiled once for each instruction set. The first call decides which version runs.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#ifdef __aarch64__  // once: Arm's sets of fixed width do the same here, and vectors of SVE can be no members
#define HWY_COMPILE_ONLY_STATIC
#endif
#define HWY_TARGET_INCLUDE "core/energy/membrane_kernel.cc"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <algorithm>

#include "core/energy/cell_kernel.h"
#include "core/energy/rotation_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE Vector sum_of(V a_factor, const Vector& a, V b_factor, const Vector& b) {
  return {hn::MulAdd(a_factor, a.x, hn::Mul(b_factor, b.x)),
          hn::MulAdd(a_factor, a.y, hn::Mul(b_factor, b.y)),
          hn::MulAdd(a_factor, a.z, hn::Mul(b_factor, b.z))};
}

/// One row of kRow numbers for each lane, one after another.
HWY_INLINE void store_rows(const Vector& v, float* to) {
  const hn::Rebind<float, D> d;
  hn::StoreInterleaved4(hn::DemoteTo(d, v.x), hn::DemoteTo(d, v.y), hn::DemoteTo(d, v.z), hn::Zero(d), d, to);
}

/// The faces from `first` on, one for each lane. `corner` has the vertices of each corner.
HWY_INLINE void evaluate_lanes(const std::int32_t (&corner)[3][kLanes], std::size_t lane, std::size_t first,
                               const double* rows, MembraneFaces& faces) {
  const D d;
  const V zero = hn::Zero(d), two = hn::Set(d, 2.0);
  const Vector a = gather(rows, corner[0] + lane);
  const Vector u = difference(gather(rows, corner[1] + lane), a),
               v = difference(gather(rows, corner[2] + lane), a);
  const V i00 = hn::LoadU(d, faces.inverse[0].data() + first),
          i01 = hn::LoadU(d, faces.inverse[1].data() + first),
          i11 = hn::LoadU(d, faces.inverse[2].data() + first), area = hn::LoadU(d, faces.area.data() + first);
  const Vector f = scaled(i00, u), g = sum_of(i01, u, i11, v);
  const Vector n = cross(f, g);
  const V j = hn::Sqrt(dot(n, n)), norm2 = hn::Add(dot(f, f), dot(g, g));
  const V sum = hn::Sqrt(hn::MulAdd(two, j, norm2));  // of the singular values
  const V over_two_areas = hn::Add(hn::Sub(norm2, hn::Add(sum, sum)), two);
  hn::StoreU(hn::Max(zero, hn::Mul(hn::Mul(two, area), over_two_areas)), d, faces.squared.data() + first);
  const V one = hn::Set(d, 1.0);
  const V over = hn::IfThenElseZero(hn::Gt(sum, zero), hn::Div(one, sum));
  const V k = hn::IfThenElseZero(hn::Gt(j, zero), hn::Div(over, j));
  const V size = hn::Mul(hn::Set(d, 4.0), area), along = hn::Mul(size, hn::Sub(one, over)),
          across = hn::Neg(hn::Mul(size, k));
  const Vector by_f = sum_of(along, f, across, cross(g, n)), by_g = sum_of(along, g, across, cross(n, f));
  float* const derivatives = faces.derivatives.data() + MembraneFaces::row_of_derivative(first, 0) * kRow;
  store_rows(sum_of(i00, by_f, i01, by_g), derivatives);
  store_rows(scaled(i11, by_g), derivatives + kLanes * kRow);
}

void EvaluateFaces(const Faces& corners, std::size_t begin, std::size_t end, const double* rows,
                   MembraneFaces& faces) {
  for (std::size_t first = begin; first < end; first += kLanes) {
    const std::size_t count = std::min(kLanes, end - first);
    std::int32_t corner[3][kLanes] = {};
    const std::int32_t* from = corners.data() + 3 * first;
    for (std::size_t lane = 0; lane < count; ++lane, from += 3) {
      for (std::size_t c = 0; c < 3; ++c) corner[c][lane] = from[c];
    }
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(D()))
      evaluate_lanes(corner, lane, first + lane, rows, faces);
  }
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lpdeform {

HWY_EXPORT(EvaluateFaces);

MembraneFaces::MembraneFaces(std::size_t count) {
  const std::size_t padded = (count + kLanes - 1) / kLanes * kLanes;
  for (std::vector<double>& entry : inverse) entry.resize(padded);
  area.resize(padded);
  squared.resize(padded);
  derivatives.resize(padded * 2 * kRow);
}

std::size_t MembraneFaces::memory_bytes() const {
  return 5 * area.capacity() * sizeof(double) + derivatives.capacity() * sizeof(float);
}

void evaluate_faces(const Faces& corners, std::size_t begin, std::size_t end, const double* rows,
                    MembraneFaces& faces) {
  HWY_DYNAMIC_DISPATCH(EvaluateFaces)(corners, begin, end, rows, faces);
}

}  // namespace lpdeform
#endif
