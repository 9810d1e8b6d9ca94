#include "client/cli/reproduce/statistics.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/solve/summary.h"

namespace lpdeform::reproduce {
namespace {

Points centred(const Points& points, std::span<const std::int32_t> rows) {
  Points result(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t k = 0; k < rows.size(); ++k)
    result.row(static_cast<Eigen::Index>(k)) = points.row(rows[k]);
  const Eigen::RowVector3d mean = result.colwise().mean();
  result.rowwise() -= mean;
  return result;
}

}  // namespace

double axis_ratio(const Points& rest, const Points& deformed, std::span<const std::int32_t> rim) {
  LPDEFORM_CHECK(rim.size() >= 3);
  const Eigen::MatrixXd from = centred(rest, rim), to = centred(deformed, rim);
  const Eigen::JacobiSVD<Eigen::MatrixXd> axes(from, Eigen::ComputeThinV);
  const Eigen::MatrixXd in_plane = from * axes.matrixV().leftCols<2>();
  const Eigen::MatrixXd map = in_plane.colPivHouseholderQr().solve(to);  // 2 x 3
  const Eigen::VectorXd stretch = Eigen::JacobiSVD<Eigen::MatrixXd>(map).singularValues();
  return stretch[1] > 0 ? stretch[0] / stretch[1] : std::numeric_limits<double>::infinity();
}

double displacement_far_from(const Points& rest, const Points& deformed, std::span<const std::int32_t> from,
                             double distance) {
  double sum = 0, count = 0;
  for (Eigen::Index i = 0; i < rest.rows(); ++i) {
    const bool is_far = std::ranges::all_of(
        from, [&](std::int32_t j) { return (rest.row(i) - rest.row(j)).norm() > distance; });
    if (!is_far) continue;
    sum += (deformed.row(i) - rest.row(i)).squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

double share_up_to(const Field& values, double limit) {
  return values.size() > 0 ? double((values.array() <= limit).count()) / double(values.size()) : 0;
}

double top_share(const Field& values) {
  return distortion_statistics(values, 1).top_5_percent_share;
}

std::vector<std::int64_t> histogram(const Field& values, double highest, int bins) {
  LPDEFORM_CHECK(highest > 0 && bins >= 1);
  std::vector<std::int64_t> counts(bins, 0);
  for (const double value : values) {
    ++counts[static_cast<std::size_t>(std::min(std::floor(value / highest * bins), bins - 1.0))];
  }
  return counts;
}

Field at(const Field& values, std::span<const std::int32_t> indices) {
  Field result(static_cast<Eigen::Index>(indices.size()));
  for (Eigen::Index k = 0; k < result.size(); ++k) result[k] = values[indices[static_cast<std::size_t>(k)]];
  return result;
}

double diagonal(const Points& points) {
  return (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
}

}  // namespace lpdeform::reproduce
