#pragma once

#include <cstdint>
#include <string_view>

#include "absl/status/status.h"
#include "core/base/geometry.h"

namespace lpdeform {

/// How distortion is spread (p, Eq. 3) and how much it costs (stiffness).
struct Material {
  /// 1 <= p_i <= 64. One value for the whole surface, or one per vertex.
  Field p = Field::Constant(1, 2.0);
  /// 1e-6 <= s_i <= 1e6. One value for the whole surface, or one per vertex.
  Field stiffness = Field::Ones(1);
  /// The length unit l of mixed norms, E = sum_i s_i l^2 (E_i / l)^{p_i}, in the caller's units; 0 means the mean rest
  /// edge length. If p is uniform, l only scales E, except for p < 2 with soft or orientation handles, whose terms have
  /// p = 2.
  double length_unit = 0;

  static constexpr double kLowestP = 1.0, kHighestP = 64.0;
  static constexpr double kLowestStiffness = 1e-6, kHighestStiffness = 1e6;

  static Material uniform(double p);

  bool has_uniform_p() const;
  bool operator==(const Material&) const;
};

/// Checks sizes and ranges. INVALID_ARGUMENT (FIELD_SIZE, P_OUT_OF_RANGE, STIFFNESS_OUT_OF_RANGE,
/// LENGTH_UNIT_OUT_OF_RANGE); names the vertex.
absl::Status check_material(const Material& material, std::int32_t vertex_count);

/// FIELD_SIZE, for callers who find it before they have a field. `name`: "p" or "stiffness".
absl::Status wrong_field_size(std::string_view name, std::int64_t values, std::int64_t vertex_count);

}  // namespace lpdeform
