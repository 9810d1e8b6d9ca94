#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/workers.h"
#include "core/energy/membrane_kernel.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// The energy of a shape's faces, which resist stretching and shearing but no bending (as-rigid-as-possible for triangles):
///
///   E_T^2 = min over rotations R of sum over the edges k of T of cot_k |d_k - R r_k|^2
///         = 2 A_T (|F|^2 + 2 - 2 sqrt(|F|^2 + 2 J)),    F the 3 x 2 gradient of x in T, J = |f_1 x f_2|
///
/// r_k and d_k are the rest and deformed edges, cot_k the cotangent opposite of k, A_T the rest area. Scaled units. One
/// caller at a time.
class Membrane {
 public:
  /// Has the faces at vertices that are marked in `cells`, which has one mark for each vertex; all faces if it has none.
  Membrane(std::shared_ptr<const RestShape> shape, const Workers& workers,
           const std::vector<char>& cells = {});

  /// All E_T^2 and their derivatives where the vertices are at `rows`: x, y, z and a filler for each.
  void evaluate(const double* rows, const Workers& workers);
  /// A third of the sum of E_T^2 over the faces at vertex i. Of a vertex that is not marked, some faces may be missing.
  double share(std::int32_t i) const;
  /// Adds sum_T (c_a + c_b + c_c) / 3 dE_T^2/dx to `result`, (a, b, c) = T.
  void add_gradient(const std::vector<double>& c, const Workers& workers, Points& result) const;

  std::size_t memory_bytes() const;

 private:
  const Faces& corners() const { return some_ ? *some_ : shape_->faces(); }

  std::shared_ptr<const RestShape> shape_;
  std::optional<Faces> some_;  // the faces, unless it has all
  MembraneFaces faces_;
  mutable std::vector<double> weights_;  // of each face, in add_gradient()
  // From rows_[offsets_[2 i]] on: the row of derivatives of the second corner of each face whose first corner is vertex i. From
  // rows_[offsets_[2 i + 1]] on: that of vertex i itself in each of its other faces.
  std::vector<std::int32_t> offsets_, rows_;
};

}  // namespace lpdeform
