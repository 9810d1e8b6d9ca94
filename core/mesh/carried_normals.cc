#include "core/mesh/carried_normals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace lpdeform {
namespace {

constexpr double kSameNormal = 0.99984769515639;  // cosine of 1 degree
// The most groups per vertex that a copy is compared with. No real surface has more.
constexpr std::size_t kMostCompared = 32;

/// The vector scaled to length 1, or 0 if it has no direction.
Eigen::RowVector3d unit(const Eigen::RowVector3d& vector) {
  const double length = vector.stableNorm();
  return length > 0 && std::isfinite(length) ? Eigen::RowVector3d(vector / length)
                                             : Eigen::RowVector3d(Eigen::RowVector3d::Zero());
}

bool is_same_normal(const Eigen::RowVector3d& a, const Eigen::RowVector3d& b) {
  return (a.isZero(0) && b.isZero(0)) || a.dot(b) >= kSameNormal;
}

}  // namespace

CarriedNormals::CarriedNormals(Faces faces, const Points& rest, const Weld& weld, const Points& rest_normals)
    : faces_(std::move(faces)) {
  if (rest_normals.rows() == 0) {
    group_of_ = weld.to_welded;
    group_count_ = weld.welded_count();
    return;
  }
  kept_ = rest_normals;
  for (auto normal : kept_.rowwise()) normal = unit(normal);
  find_groups(weld, kept_);
  const Points normals = group_normals(rest);
  find_references(rest, normals);
  local_.resize(kept_.rows(), 3);
  for (Eigen::Index v = 0; v < kept_.rows(); ++v) {
    const std::int32_t group = group_of_[v];
    if (kept_.row(v).isZero(0)) kept_.row(v) = normals.row(group);
    local_.row(v) = kept_.row(v) * frame(group, normals.row(group), rest);
  }
}

void CarriedNormals::find_groups(const Weld& weld, const Points& rest_normals) {
  std::vector<std::vector<std::int32_t>> groups_at(weld.welded_count());  // groups by their first members
  group_of_.resize(weld.to_welded.size());
  for (std::int32_t v = 0; v < weld.split_count(); ++v) {
    std::vector<std::int32_t>& here = groups_at[weld.to_welded[v]];
    const auto end = here.begin() + static_cast<std::ptrdiff_t>(std::min(here.size(), kMostCompared));
    const auto same = std::find_if(here.begin(), end, [&](std::int32_t other) {
      return is_same_normal(rest_normals.row(v), rest_normals.row(other));
    });
    if (same == end) here.push_back(v);
    group_of_[v] = same == end ? group_count_++ : group_of_[*same];
  }
}

/// Finds for each group the edge that is longest when projected across its normal.
void CarriedNormals::find_references(const Points& rest, const Points& normals) {
  from_.assign(group_count_, -1);
  to_.assign(group_count_, -1);
  std::vector<double> longest(group_count_, 0.0);
  for (Eigen::Index f = 0; f < faces_.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::int32_t vertex = faces_(f, corner), group = group_of_[vertex];
      for (const int other : {(corner + 1) % 3, (corner + 2) % 3}) {
        const Eigen::RowVector3d edge = rest.row(faces_(f, other)) - rest.row(vertex);
        const double across = edge.cross(normals.row(group)).norm();
        if (!(across > longest[group])) continue;
        longest[group] = across;
        from_[group] = vertex;
        to_[group] = faces_(f, other);
      }
    }
  }
}

Points CarriedNormals::group_normals(const Points& positions) const {
  Points sums = Points::Zero(group_count_, 3);
  for (Eigen::Index f = 0; f < faces_.rows(); ++f) {
    const Eigen::RowVector3d a = positions.row(faces_(f, 0)), b = positions.row(faces_(f, 1)),
                             c = positions.row(faces_(f, 2));
    const Eigen::RowVector3d ab = b - a, bc = c - b, ca = a - c, area = ab.cross(-ca);
    const Eigen::RowVector3d normal = unit(area);
    if (normal.isZero(0)) continue;
    const double twice_area = area.norm();
    const std::array<double, 3> angles{std::atan2(twice_area, -ab.dot(ca)),
                                       std::atan2(twice_area, -bc.dot(ab)),
                                       std::atan2(twice_area, -ca.dot(bc))};
    for (int corner = 0; corner < 3; ++corner)
      sums.row(group_of_[faces_(f, corner)]) += angles[corner] * normal;
  }
  for (auto sum : sums.rowwise()) sum = unit(sum);
  return sums;
}

/// Columns: the direction along the group's edge, the direction across it, and the normal. The identity if there is no
/// such frame.
Eigen::Matrix3d CarriedNormals::frame(std::int32_t group, const Eigen::RowVector3d& normal,
                                      const Points& positions) const {
  if (to_[group] < 0 || normal.isZero(0)) return Eigen::Matrix3d::Identity();
  const Eigen::RowVector3d edge = positions.row(to_[group]) - positions.row(from_[group]);
  const Eigen::RowVector3d across = unit(normal.cross(edge));
  Eigen::Matrix3d frame;
  frame.col(2) = normal.transpose();
  frame.col(1) = across.isZero(0) ? normal.transpose().unitOrthogonal() : across.transpose();
  frame.col(0) = frame.col(1).cross(frame.col(2));
  return frame;
}

Points CarriedNormals::at(const Points& positions) const {
  const Points normals = group_normals(positions);
  const bool is_smooth = kept_.rows() == 0;
  Points result(static_cast<Eigen::Index>(group_of_.size()), 3);
  for (Eigen::Index v = 0; v < result.rows(); ++v) {
    const std::int32_t group = group_of_[v];
    const bool is_flat = normals.row(group).isZero(0) || (!is_smooth && to_[group] < 0);
    if (is_smooth)
      result.row(v) = normals.row(group);
    else if (is_flat)
      result.row(v) = kept_.row(v);
    else
      result.row(v) = unit(local_.row(v) * frame(group, normals.row(group), positions).transpose());
  }
  return result;
}

std::size_t CarriedNormals::memory_bytes() const {
  return sizeof(*this) + faces_.size() * sizeof(std::int32_t) +
         (group_of_.size() + from_.size() + to_.size()) * sizeof(std::int32_t) +
         (local_.size() + kept_.size()) * sizeof(double);
}

}  // namespace lpdeform
