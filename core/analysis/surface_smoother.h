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
/// M holds the cells' areas, and L is the cotangent Laplacian. Its weights are clamped to >= 0, so b >= 0 gives u >= 0.
/// A peak spreads to a distance of about rho. On each component, u and f have the same integral. Lengths are in scaled
/// units (RestShape::scaled_positions). Except for rounding, the result does not depend on the order of vertices.
class SurfaceSmoother {
 public:
  explicit SurfaceSmoother(const RestShape& shape);

  /// Factors the matrix for new lengths, one per component, > 0. False if that fails; then spread() must not be called.
  [[nodiscard]] bool set_lengths(const std::vector<double>& lengths);

  /// u for three quantities at once: b is n x 3, one quantity per column.
  Points spread(const Points& b) const;

  /// M: a third of the area of each vertex's faces, but at least 1e-9 of the mean.
  const Field& areas() const { return areas_; }

 private:
  const RestShape& shape_;
  EdgeWeights edges_;
  Field areas_;
  LowerMatrix matrix_;
  SparseCholesky factor_;
};

}  // namespace lpdeform
