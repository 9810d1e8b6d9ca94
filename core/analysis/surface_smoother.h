#pragma once

#include <vector>

#include "core/energy/rest_shape.h"
#include "core/linalg/cholesky.h"

namespace lpdeform {

/// Spreads quantities over a surface: one implicit step of the heat equation. For f given by its integral
/// b_i over the cell of each vertex,
///
///   u - rho^2 Laplace(u) = f :    (M + rho^2 L) u = b
///
/// with M the cells' areas and L the cotangent Laplacian (weights clamped to >= 0, so where b >= 0, u >= 0).
/// A peak spreads to a distance of about rho, and the integral of u is that of f, on each component by
/// itself. Lengths are in scaled units (RestShape::scaled_positions). Does not depend on the order of
/// vertices but for rounding.
class SurfaceSmoother {
 public:
  explicit SurfaceSmoother(const RestShape& shape);

  /// Factors for other lengths: one a component, > 0. False where that fails; then spread() must not be
  /// called.
  [[nodiscard]] bool set_lengths(const std::vector<double>& lengths);

  /// u for three quantities at once: b is n x 3, one quantity a column.
  Points spread(const Points& b) const;

  /// M: a third of the area of each vertex's faces, at least 1e-9 of the mean.
  const Field& areas() const { return areas_; }

 private:
  const RestShape& shape_;
  EdgeWeights edges_;
  Field areas_;
  LowerMatrix matrix_;
  SparseCholesky factor_;
};

}  // namespace lpdeform
