#pragma once

#include <cstdint>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

/// Points no farther apart than this share of the diagonal of all points' bounding box are in one place. Coordinates in single
/// precision are rounded by 6e-8 of their size, so two copies of a vertex may be apart by twice that, or by ten times as much where the
/// mesh lies some diagonals away from the origin.
inline constexpr double kSamePlace = 1e-6;

struct Coincident {
  /// One a point: the lowest point that it coincides with, over any number of steps, or itself.
  std::vector<std::int32_t> lowest;
  /// False where points lie so densely that the search ended early: some that coincide stand apart.
  bool is_complete = true;
};

/// The diagonal of the bounding box of the points that are finite; 0 of none.
double diagonal_of(const Points& points);

/// Which of the points `among` (ascending) coincide: a and b do where
///     |a - b| <= share * diagonal_of(points),   share in [0, 1e-3],
/// and so do those that a chain of such steps connects. Other points, and those with a NaN or an infinite
/// coordinate, stand alone. By a grid that is looked up on both sides of its cells' borders; O(n) expected, and
/// at most 1000 distances a point: then it ends early.
Coincident coincident(const Points& points, const std::vector<std::int32_t>& among, double share);

}  // namespace lpdeform
