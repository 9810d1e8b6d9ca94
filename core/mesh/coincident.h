#pragma once

#include <cstdint>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

/// Points count as coincident if their distance is at most this share of the diagonal of all points' bounding box.
/// Coordinates in single precision are rounded by 6e-8 of their magnitude, so two copies of a vertex may differ by
/// twice that, or by ten times as much if the mesh lies several diagonals away from the origin.
inline constexpr double kSamePlace = 1e-6;

struct Coincident {
  /// One per point: the lowest point that it coincides with, over any number of steps, or itself.
  std::vector<std::int32_t> lowest;
  /// False if points are so dense that the search ended early; some coincident points are then not found.
  bool is_complete = true;
};

/// The diagonal of the bounding box of the finite points; 0 if there is none.
double diagonal_of(const Points& points);

/// Finds which of the points `among` (ascending) coincide. Points a and b coincide if
///     |a - b| <= share * diagonal_of(points),   share in [0, 1e-3],
/// or if a chain of such steps connects them. Other points, and points with a NaN or an infinite coordinate, coincide
/// with none. Uses a grid in which all cells within reach of a point are looked up. O(n) expected. Ends early at more
/// than 1000 distances per point.
Coincident coincident(const Points& points, const std::vector<std::int32_t>& among, double share);

}  // namespace lpdeform
