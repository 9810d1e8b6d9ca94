#include "core/energy/lp_norm.h"

#include <algorithm>
#include <limits>

#include "core/base/check.h"

namespace lpdeform {

LpNorm::LpNorm(const Material& material, std::int32_t vertex_count, double scaled_unit, double reference) {
  LPDEFORM_CHECK(scaled_unit > 0 && reference > 0);
  is_uniform_ = material.p.size() == 1 && material.stiffness.size() == 1;
  const std::int32_t count = is_uniform_ ? 1 : vertex_count;
  const auto entry = [](const Field& field, std::int32_t i) {
    return field.size() == 1 ? field[0] : field[i];
  };

  // If p is uniform, the energy is sum E_i^p in the caller's units. If p is mixed, lengths are in units of l.
  const bool is_mixed = !material.has_uniform_p();
  const double length = !is_mixed ? 1.0 : material.length_unit > 0 ? material.length_unit : scaled_unit;
  const double log_ratio = std::log(reference) + std::log(scaled_unit) - std::log(length);

  half_p_.resize(count);
  scale_.resize(count);
  lowest_p_ = material.p.minCoeff();
  highest_p_ = material.p.maxCoeff();
  const double log_largest = std::max(lowest_p_ * log_ratio, highest_p_ * log_ratio);
  for (std::int32_t i = 0; i < count; ++i) {
    const double p = entry(material.p, i);
    half_p_[i] = p / 2;
    scale_[i] = entry(material.stiffness, i) * std::exp(p * log_ratio - log_largest);
  }
  r2_ = reference * reference;
  log_unit_ = log_largest + (is_mixed ? 2 * std::log(length) : 0.0);
}

LpNorm LpNorm::smoothed(double eps2) const {
  LpNorm copy = *this;
  copy.eps2_ = eps2;
  return copy;
}

LpNorm LpNorm::nearer_two(double share) const {
  LpNorm copy = *this;
  for (double& half_p : copy.half_p_) half_p = 1 + (half_p - 1) * share;
  copy.lowest_p_ = 2 + (lowest_p_ - 2) * share;
  copy.highest_p_ = 2 + (highest_p_ - 2) * share;
  return copy;
}

double LpNorm::true_energy(double sum) const {
  if (!(sum > 0)) return 0;
  const double energy = std::exp(log_unit_ + std::log(sum));
  return std::min(energy, std::numeric_limits<double>::max());
}

}  // namespace lpdeform
