#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

/// A tree of bounding boxes around triangles, to find the first triangle along a ray. Each node is split at the median
/// of the centres along its longest side until at most kLeaf triangles are left. Immutable; thread-safe.
class FaceBvh {
 public:
  static constexpr std::int32_t kLeaf = 4;

  FaceBvh(const Points& positions, const Faces& faces);

  /// The faces in the tree's order: faces that are close in space are close in this order.
  const std::vector<std::int32_t>& order() const { return order_; }

  /// The least of distance(k) over all faces order()[k] whose box, grown by `margin` > 0, the ray meets; infinite if
  /// there is none. `distance` returns how far along the ray the face is, >= 0 and within the grown box, or infinity.
  /// Boxes that begin farther away than the least distance so far are skipped.
  template <typename Distance>
  double nearest(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double margin,
                 Distance distance) const {
    const Eigen::Array3d inverse = direction.array().inverse();
    double least = kInfinity;
    Waiting stack[kDeepest];
    int waiting = 0;
    if (!nodes_.empty()) stack[waiting++] = {0, entry(nodes_[0], origin, inverse, margin)};
    while (waiting > 0) {
      const Waiting next = stack[--waiting];
      if (!(next.entry < least)) continue;
      const Node& node = nodes_[next.node];
      if (node.count > 0) {
        for (std::int32_t k = node.first; k < node.first + node.count; ++k)
          least = std::min(least, distance(k));
        continue;
      }
      Waiting near{node.first, entry(nodes_[node.first], origin, inverse, margin)};
      Waiting far{node.first + 1, entry(nodes_[node.first + 1], origin, inverse, margin)};
      if (far.entry < near.entry) std::swap(near, far);
      if (far.entry < least) stack[waiting++] = far;
      if (near.entry < least) stack[waiting++] = near;
    }
    return least;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  static constexpr int kDeepest =
      64;  // enough for a tree of at most 2^31 faces: every split is even, and leaves one node waiting

  struct Node {
    Eigen::Array3d low, high;
    std::int32_t first = 0;  // the first of its faces in order_, or of its two children
    std::int32_t count = 0;  // the number of its faces; 0 if it has children
  };
  struct Waiting {
    std::int32_t node;
    double entry;
  };

  /// How far along the ray it enters the grown box; infinite if it does not.
  static double entry(const Node& node, const Eigen::Vector3d& origin, const Eigen::Array3d& inverse,
                      double margin) {
    double enter = 0, leave = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      // Along an axis perpendicular to the ray both are infinite: of the same sign if the ray passes the box by, else
      // of opposite signs.
      const double a = (node.low[axis] - margin - origin[axis]) * inverse[axis];
      const double b = (node.high[axis] + margin - origin[axis]) * inverse[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave ? enter : kInfinity;
  }

  void fill(std::int32_t node, std::int32_t begin, std::int32_t end, const Points& positions,
            const Faces& faces, const Points& centres);

  std::vector<Node> nodes_;
  std::vector<std::int32_t> order_;  // face indices
};

}  // namespace lpdeform
