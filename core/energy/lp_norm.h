#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/energy/material.h"

namespace lpdeform {

/// A cell's term of the objective, as a function of its squared energy e2 = E_i^2 in scaled units (see
/// RestShape::scaled_positions):
///
///   term_i(e2) = s_i ((e2 + eps2) / r^2)^{p_i / 2} f_i ,     weight_i(e2) = d term_i / d e2
///
/// eps2 smooths the kink that p < 2 has at 0. The reference r and the factors
///
///   f_i = (r / l)^{p_i} / max_j (r / l)^{p_j}
///
/// keep the sum near the magnitude of s, whatever p is. The true energy of Eq. 3 is a constant times the sum
/// (true_energy).
class LpNorm {
 public:
  /// `reference` > 0: a typical E_i, in scaled units. `scaled_unit`: the length of one scaled unit, in the caller's
  /// units.
  LpNorm(const Material& material, std::int32_t vertex_count, double scaled_unit, double reference);

  /// The same norm with another smoothing, eps2 >= 0 in scaled units.
  LpNorm smoothed(double eps2) const;
  /// The same norm with p_i moved towards 2: p_i' = 2 + (p_i - 2) * share, share in [0, 1]. For continuation.
  LpNorm nearer_two(double share) const;

  struct Term {
    double value;
    double weight;
  };
  Term term(std::int32_t i, double e2) const {
    const double v = e2 + eps2_;
    const double half_p = half_p_[at(i)];
    if (half_p == 1) return {scale_[at(i)] / r2_ * v, scale_[at(i)] / r2_};
    if (!(v > 0)) return {0, 0};
    const double value = scale_[at(i)] * power(v / r2_, half_p);
    return {value, value * half_p / v};
  }

  /// Whether all cells have the same p and stiffness.
  bool is_uniform() const { return is_uniform_; }
  double p(std::int32_t i) const { return 2 * half_p_[at(i)]; }
  /// s_i f_i / r^{p_i}: the term of an unsmoothed cell is coefficient(i) E_i^{p_i}.
  double coefficient(std::int32_t i) const { return scale_[at(i)] / power(r2_, half_p_[at(i)]); }
  double eps2() const { return eps2_; }
  double lowest_p() const { return lowest_p_; }
  double highest_p() const { return highest_p_; }

  /// Eq. 3 in the caller's units, for a sum of unsmoothed terms. If p is mixed, this uses the length unit l. On
  /// overflow, the largest double.
  double true_energy(double sum) const;

 private:
  std::int32_t at(std::int32_t i) const { return is_uniform_ ? 0 : i; }

  static double power(double base, double exponent) {
    if (exponent == 1) return base;
    if (exponent == 0.5) return std::sqrt(base);
    if (exponent == 0.75) return std::sqrt(base) * std::sqrt(std::sqrt(base));
    if (exponent == 3) return base * base * base;
    return std::pow(base, exponent);
  }

  std::vector<double> half_p_, scale_;
  bool is_uniform_ = true;  // one p and one stiffness for all: the arrays have one entry
  double r2_ = 1, eps2_ = 0, lowest_p_ = 2, highest_p_ = 2;
  double log_unit_ = 0;  // true energy = exp(log_unit_) * sum
};

}  // namespace lpdeform
