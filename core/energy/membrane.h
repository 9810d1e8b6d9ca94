#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/workers.h"
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
  Membrane(std::shared_ptr<const RestShape> shape, const Workers& workers);

  /// All E_T^2 and their derivatives at x.
  void evaluate(const Points& x, const Workers& workers);
  /// A third of the sum of E_T^2 over the faces at vertex i.
  double share(std::int32_t i) const;
  /// Adds factor * sum_T (c_a + c_b + c_c) / 3 dE_T^2/dx to rows begin to end - 1 of `result`, (a, b, c) = T.
  void add_gradient(double factor, const std::vector<double>& c, std::size_t begin, std::size_t end,
                    Points& result) const;

  std::size_t memory_bytes() const;

 private:
  struct Face {
    double inverse[3];  // of the rest edges in the face's plane, upper triangular: 00, 01, 11
    double area;
  };
  struct Derivative {
    double of[2][3];  // dE_T^2 by the second and third corner
  };
  void evaluate(const Points& x, std::size_t face);

  std::shared_ptr<const RestShape> shape_;
  std::vector<Face> faces_;
  std::vector<double> squared_;
  std::vector<Derivative> derivatives_;
  std::vector<std::int32_t> offsets_, corners_;  // of each vertex: 3 * face + corner
};

}  // namespace lpdeform
