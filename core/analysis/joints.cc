#include "core/analysis/joints.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/analysis/bending.h"
#include "core/analysis/component_lengths.h"
#include "core/analysis/enclosure.h"
#include "core/analysis/face_geometry.h"
#include "core/analysis/surface_smoother.h"
#include "core/analysis/thickness.h"

namespace lpdeform {
namespace {

constexpr double kAround = 4;  // times rho: the size of the surroundings that a place is compared with
constexpr double kHalfCrease = std::numbers::pi / 9, kHalfNarrowing = 0.25;

/// Integrals over the cells of 1/t, 1/t^2 and of 1 where t is known.
Points slenderness(const RestShape& shape, const std::vector<double>& thickness,
                   const std::vector<Enclosure>& components) {
  Points sums = Points::Zero(shape.vertex_count(), 3);
  for (Eigen::Index f = 0; f < shape.faces().rows(); ++f) {
    if (!std::isfinite(thickness[f])) continue;
    const Enclosure& component = components[shape.components()[shape.faces()(f, 0)]];
    // Without this limit, a few crumpled faces whose other side is very near would outweigh all others in 1 / t^2.
    const double thin = 1 / std::max(thickness[f], component.noise_length());
    const double share = face_geometry(shape, f).area / 3;
    for (int corner = 0; corner < 3; ++corner)
      sums.row(shape.faces()(f, corner)) += share * Eigen::RowVector3d(thin, thin * thin, 1);
  }
  return sums;
}

/// The mean of 1/t, weighted by 1/t; 0 where no thickness is known.
double mean_slenderness(const Points& smoothed, Eigen::Index i) {
  return smoothed(i, 0) > 0 ? std::max(smoothed(i, 1), 0.0) / smoothed(i, 0) : 0;
}

/// The largest concave curvature. For a surface that encloses nothing (open = 1), the largest curvature of either sign.
double sharpest_fold(const Eigen::Matrix3d& bending, double open) {
  const Eigen::Vector3d curvatures =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(bending, Eigen::EigenvaluesOnly).eigenvalues();
  return std::max({0.0, -curvatures[0], open * curvatures[2]});
}

std::vector<double> times(std::vector<double> lengths, double factor) {
  for (double& length : lengths) length *= factor;
  return lengths;
}

double half_at(double value, double half) {
  return 1 / (1 + value * value / (half * half));
}

Joints joints_of(const RestShape& shape, const std::vector<double>& thickness) {
  const Eigen::Index n = shape.vertex_count();
  Joints joints{Field::Zero(n), Field::Zero(n), Field::Zero(n)};
  SurfaceSmoother smoother(shape);
  const std::vector<double> lengths = component_lengths(shape);
  const std::vector<Enclosure> components = enclosures(shape, thickness);
  const Points thin = slenderness(shape, thickness, components);
  if (!smoother.set_lengths(times(lengths, kAround))) return joints;
  const Points far = smoother.spread(thin);
  if (!smoother.set_lengths(lengths)) return joints;
  const Points near = smoother.spread(thin);
  BendingMeasure bending = bending_measure(shape);
  bending = {smoother.spread(bending.diagonal), smoother.spread(bending.off_diagonal)};

  Points sharp = Points::Zero(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::int32_t c = shape.components()[i];
    if (c < 0) continue;
    const double open = std::max(0.0, 1 - 2 * components[c].share) * std::clamp(1 - near(i, 2), 0.0, 1.0);
    joints.crease_radians[i] = 2 * lengths[c] * sharpest_fold(bending.at(i), open);
    const double a = mean_slenderness(near, i), a_around = mean_slenderness(far, i);
    joints.narrowing[i] = a_around > 0 ? std::max(0.0, a / a_around - 1) : 0;
    sharp(i, 0) =
        1 - half_at(joints.crease_radians[i], kHalfCrease) * half_at(joints.narrowing[i], kHalfNarrowing);
  }
  sharp.col(0).array() *= smoother.areas().array();
  joints.joint = smoother.spread(sharp).col(0).cwiseMax(0).cwiseMin(1);
  return joints;
}

}  // namespace

Joints find_joints(const RestShape& shape, const Workers& workers) {
  std::vector<double> thickness = thickness_behind_faces(shape, workers);
  const auto smoothed = without_noise(shape, enclosures(shape, thickness));
  if (!smoothed) return joints_of(shape, thickness);
  return joints_of(*smoothed, thickness_behind_faces(*smoothed, workers));
}

}  // namespace lpdeform
