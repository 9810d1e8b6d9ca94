#include "core/methods/pair_sweeps.h"

// This file is compiled once for each instruction set. The first call decides which version runs.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#define HWY_TARGET_INCLUDE "core/methods/pair_sweeps.cc"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<double>;
using V = hn::Vec<D>;

constexpr std::size_t kStretch = 512;  // numbers; few enough to stay in the first-level cache for all pairs

HWY_INLINE V load_floats(const float* at) {
  return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<float, D>(), at));
}

HWY_INLINE double product(const double* a, const double* b, std::size_t count) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  V sum0 = hn::Zero(d), sum1 = sum0;
  std::size_t k = 0;
  for (; k + 2 * lanes <= count; k += 2 * lanes) {
    sum0 = hn::MulAdd(hn::LoadU(d, a + k), hn::LoadU(d, b + k), sum0);
    sum1 = hn::MulAdd(hn::LoadU(d, a + k + lanes), hn::LoadU(d, b + k + lanes), sum1);
  }
  double rest = 0;
  for (; k < count; ++k) rest += a[k] * b[k];
  return hn::GetLane(hn::SumOfLanes(d, hn::Add(sum0, sum1))) + rest;
}

/// Adds <a, b> and <a, c> of a stretch.
HWY_INLINE void two_products(const float* a, const double* b, const double* c, std::size_t count,
                             double* sum_b, double* sum_c) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  V b0 = hn::Zero(d), b1 = b0, c0 = b0, c1 = b0;
  std::size_t k = 0;
  for (; k + 2 * lanes <= count; k += 2 * lanes) {
    const V a0 = load_floats(a + k), a1 = load_floats(a + k + lanes);
    b0 = hn::MulAdd(a0, hn::LoadU(d, b + k), b0);
    b1 = hn::MulAdd(a1, hn::LoadU(d, b + k + lanes), b1);
    c0 = hn::MulAdd(a0, hn::LoadU(d, c + k), c0);
    c1 = hn::MulAdd(a1, hn::LoadU(d, c + k + lanes), c1);
  }
  double rest_b = 0, rest_c = 0;
  for (; k < count; ++k) {
    rest_b += static_cast<double>(a[k]) * b[k];
    rest_c += static_cast<double>(a[k]) * c[k];
  }
  *sum_b += hn::GetLane(hn::SumOfLanes(d, hn::Add(b0, b1))) + rest_b;
  *sum_c += hn::GetLane(hn::SumOfLanes(d, hn::Add(c0, c1))) + rest_c;
}

void SweepProducts(const NewPair& pair, std::span<const KeptPair> kept, std::size_t begin, std::size_t end,
                   double* sums) {
  double y[kStretch], h[kStretch];
  for (std::size_t at = begin; at < end; at += kStretch) {
    const std::size_t count = std::min(kStretch, end - at);
    const double* const g = pair.gradient + at;
    for (std::size_t k = 0; k < count; ++k) {
      y[k] = g[k] - pair.gradient_before[at + k];
      h[k] = static_cast<double>(pair.h[at + k]);
      pair.s[at + k] = static_cast<float>(pair.length * pair.step[at + k]);
      pair.z[at + k] = pair.h[at + k] - pair.z[at + k];
    }
    sums[0] += product(pair.step + at, pair.step + at, count);
    sums[1] += product(y, y, count);
    sums[2] += product(h, g, count);
    double* to = sums + kSumsBefore;
    const auto add = [&](const float* s, const float* z) {
      two_products(s + at, g, y, count, to, to + 2);
      two_products(z + at, g, y, count, to + 1, to + 3);
      to += kSumsOfPair;
    };
    for (const KeptPair& one : kept) add(one.s, one.z);
    add(pair.s, pair.z);
  }
}

void SweepDirection(double gamma, const float* h, std::span<const KeptPair> kept, const double* s_factors,
                    const double* z_factors, std::size_t begin, std::size_t end, double* d) {
  const D tag;
  const std::size_t lanes = hn::Lanes(tag);
  for (std::size_t at = begin; at < end; at += kStretch) {
    const std::size_t last = std::min(at + kStretch, end);
    for (std::size_t k = at; k < last; ++k) d[k] = -gamma * static_cast<double>(h[k]);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const float *const s = kept[i].s, *const z = kept[i].z;
      const V a = hn::Set(tag, s_factors[i]), b = hn::Set(tag, z_factors[i]);
      std::size_t k = at;
      for (; k + lanes <= last; k += lanes) {
        const V sum = hn::MulAdd(a, load_floats(s + k), hn::Mul(b, load_floats(z + k)));
        hn::StoreU(hn::Sub(hn::LoadU(tag, d + k), sum), tag, d + k);
      }
      for (; k < last; ++k) {
        d[k] -= s_factors[i] * static_cast<double>(s[k]) + z_factors[i] * static_cast<double>(z[k]);
      }
    }
  }
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lpdeform {

HWY_EXPORT(SweepProducts);
HWY_EXPORT(SweepDirection);

void sweep_products(const NewPair& pair, std::span<const KeptPair> kept, std::size_t begin, std::size_t end,
                    double* sums) {
  HWY_DYNAMIC_DISPATCH(SweepProducts)(pair, kept, begin, end, sums);
}

void sweep_direction(double gamma, const float* h, std::span<const KeptPair> kept, const double* s_factors,
                     const double* z_factors, std::size_t begin, std::size_t end, double* d) {
  HWY_DYNAMIC_DISPATCH(SweepDirection)(gamma, h, kept, s_factors, z_factors, begin, end, d);
}

}  // namespace lpdeform
#endif
