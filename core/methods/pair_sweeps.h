#pragma once

#include <cstddef>
#include <span>

namespace lpdeform {

/// The inputs and outputs for a new pair of L-BFGS; see LbfgsMemory::direction.
struct NewPair {
  const double *gradient, *gradient_before;  // y = gradient - gradient_before
  const float* h;
  const double* step;  // s = length * step
  double length;
  float* s;  // output
  float* z;  // before the sweep h_before, after it z = h - h_before
};

/// A stored pair.
struct KeptPair {
  const float *s, *z;
};

/// For the numbers [begin, end) of all vectors: writes s and z of the new pair, and adds to `sums` <step, step>, <y,
/// y>, <h, gradient>, then <s_i, g>, <z_i, g>, <s_i, y>, <z_i, y> for every stored pair and last for the new one. Uses
/// vector instructions, chosen at the first call.
void sweep_products(const NewPair& pair, std::span<const KeptPair> kept, std::size_t begin, std::size_t end,
                    double* sums);
inline constexpr std::size_t kSumsBefore = 3, kSumsOfPair = 4;

/// d = -gamma h - sum_i (s_factors[i] s_i + z_factors[i] z_i) for the numbers [begin, end).
void sweep_direction(double gamma, const float* h, std::span<const KeptPair> kept, const double* s_factors,
                     const double* z_factors, std::size_t begin, std::size_t end, double* d);

}  // namespace lpdeform
