#pragma once

#include <cstddef>
#include <span>

namespace lpdeform {

/// A new pair of L-BFGS at numbers [begin, end) of all vectors: what PairMemory::direction is given.
struct NewPair {
  const double *gradient, *gradient_before;  // y = gradient - gradient_before
  const double *h, *h_before;                // z = h - h_before
  const double* step;                        // s = length * step
  double length;
  float *s, *z;  // where they are kept
};

/// A pair as kept.
struct KeptPair {
  const float *s, *z;
};

/// Writes s and z of the new pair and adds to `sums`: <step, step>, <y, y>, <h, gradient>, then for every kept pair and
/// at last the new one <s_i, g>, <z_i, g>, <s_i, y>, <z_i, y>. Vector instructions, chosen when first called.
void sweep_products(const NewPair& pair, std::span<const KeptPair> kept, std::size_t begin, std::size_t end,
                    double* sums);
inline constexpr std::size_t kSumsBefore = 3, kSumsOfPair = 4;

/// d = -gamma h - sum_i (s_factors[i] s_i + z_factors[i] z_i) at numbers [begin, end).
void sweep_direction(double gamma, const double* h, std::span<const KeptPair> kept, const double* s_factors,
                     const double* z_factors, std::size_t begin, std::size_t end, double* d);

}  // namespace lpdeform
