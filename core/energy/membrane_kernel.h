#pragma once

#include <cstddef>
#include <vector>

#include "core/base/geometry.h"
#include "core/energy/cell_blocks.h"
#include "core/energy/cell_kernel.h"

namespace lpdeform {

/// The faces of a Membrane (membrane.h) and what the last evaluation found.
struct MembraneFaces {
  static constexpr std::size_t kLanes = CellBlocks::kLanes;  // faces that are computed together

  /// `count` faces without area.
  explicit MembraneFaces(std::size_t count);
  std::size_t memory_bytes() const;

  // Padded to whole groups of kLanes faces.
  std::vector<double> inverse[3];  // of the rest edges in the face's plane, upper triangular: 00, 01, 11
  std::vector<double> area;
  std::vector<double> squared;  // E_T^2
  std::vector<float>
      derivatives;  // dE_T^2: [face / kLanes][second or third corner][face % kLanes][axis, filler]

  /// The row of `derivatives`, of kRow numbers, that the second (`corner` 0) or third corner (1) of face t has.
  static std::size_t row_of_derivative(std::size_t t, std::size_t corner) {
    return (t / kLanes * 2 + corner) * kLanes + t % kLanes;
  }
};

/// Computes faces begin to end - 1, which are `corners`, where their vertices are at `rows`: x, y, z and a filler for each vertex, in
/// scaled units. `begin` is a multiple of kLanes, and `end` too or the number of faces. Uses the widest vector instructions that the
/// processor has. Different faces may be computed at the same time.
void evaluate_faces(const Faces& corners, std::size_t begin, std::size_t end, const double* rows,
                    MembraneFaces& faces);

}  // namespace lpdeform
