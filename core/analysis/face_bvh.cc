#include "core/analysis/face_bvh.h"

#include <numeric>

namespace lpdeform {

FaceBvh::FaceBvh(const Points& positions, const Faces& faces) : order_(faces.rows()) {
  if (order_.empty()) return;
  std::iota(order_.begin(), order_.end(), 0);
  Points centres(faces.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    centres.row(f) = positions.row(faces(f, 0)) + positions.row(faces(f, 1)) + positions.row(faces(f, 2));
  }
  nodes_.reserve(2 * order_.size() / kLeaf + 1);
  nodes_.emplace_back();
  fill(0, 0, static_cast<std::int32_t>(order_.size()), positions, faces, centres);
}

/// Fills the node of order_[begin, end) and the subtree below it.
void FaceBvh::fill(std::int32_t node, std::int32_t begin, std::int32_t end, const Points& positions,
                   const Faces& faces, const Points& centres) {
  Eigen::Array3d low = Eigen::Array3d::Constant(kInfinity), high = -low;
  Eigen::Array3d first_centre = low, last_centre = high;
  for (std::int32_t k = begin; k < end; ++k) {
    for (int corner = 0; corner < 3; ++corner) {
      const Eigen::Array3d point = positions.row(faces(order_[k], corner)).transpose();
      low = low.min(point), high = high.max(point);
    }
    const Eigen::Array3d centre = centres.row(order_[k]).transpose();
    first_centre = first_centre.min(centre), last_centre = last_centre.max(centre);
  }
  nodes_[node].low = low, nodes_[node].high = high;
  if (end - begin <= kLeaf) {
    nodes_[node].first = begin, nodes_[node].count = end - begin;
    return;
  }
  int axis = 0;
  (last_centre - first_centre).maxCoeff(&axis);
  const std::int32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::int32_t a, std::int32_t b) { return centres(a, axis) < centres(b, axis); });
  const auto children = static_cast<std::int32_t>(nodes_.size());
  nodes_[node].first = children;
  nodes_.resize(nodes_.size() + 2);
  fill(children, begin, middle, positions, faces, centres);
  fill(children + 1, middle, end, positions, faces, centres);
}

}  // namespace lpdeform
