#include "core/resize/resize.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/analysis/girth.h"
#include "core/analysis/salience.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/resize/resize_extents.h"
#include "core/resize/sparing.h"

namespace lpdeform {
namespace {

constexpr double kStiffening = 100;
constexpr double kNarrow = 0.75;         // relative to the mean girth
constexpr double kLeastGirth = 1.0 / 6;  // relative to kNarrow
constexpr double kNarrowing = 4;
constexpr double kMostlySpared = 0.5;  // sparing from which on a component counts as spared

/// For spared components the ends along the stretched axes, for all others all vertices; ascending.
std::vector<std::int32_t> held_vertices(const RestShape& shape, const Eigen::Matrix3d& axes,
                                        const Eigen::Vector3d& shares, const std::vector<char>& is_spared) {
  std::vector<char> is_held(static_cast<std::size_t>(shape.vertex_count()), 0);
  for (const std::int32_t end : ends_along(shape, axes, shares.array() > 0)) is_held[end] = 1;
  std::vector<std::int32_t> held;
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component >= 0 && (is_spared[component] == 0 || is_held[i] != 0)) held.push_back(i);
  }
  return held;
}

/// The stiffness factor that makes narrow slices across stretched axes no cheaper to stretch than others.
Field narrowness(const RestShape& shape, const Eigen::Matrix3d& axes, const Eigen::Vector3d& shares) {
  Field result = Field::Ones(shape.vertex_count());
  for (int k = 0; k < 3; ++k) {
    if (shares[k] == 0) continue;
    const Field girth = girth_along(shape, axes.row(k));
    result.array() *= (girth.array() / kNarrow).max(kLeastGirth).min(1).pow(-kNarrowing * shares[k]);
  }
  return result.array().min(std::pow(kLeastGirth, -kNarrowing));  // several narrow axes count as one
}

}  // namespace

absl::StatusOr<ResizeInputs> resize_inputs(const ShapeFeatures& features, const Scaling& scaling) {
  if (absl::Status status = check_scaling(scaling); !status.ok()) return status;
  std::vector<char> is_spared;
  for (const double share : sparing(features, scaling)) is_spared.push_back(share >= kMostlySpared ? 1 : 0);
  return resize_inputs(features, scaling, is_spared);
}

absl::StatusOr<ResizeInputs> resize_inputs(const ShapeFeatures& features, const Scaling& scaling,
                                           const std::vector<char>& is_spared) {
  if (absl::Status status = check_scaling(scaling); !status.ok()) return status;
  const RestShape& shape = features.shape();
  const Eigen::Vector3d shares = stretch_shares(scaling.scale);
  ResizeInputs inputs;
  inputs.handle.vertices = held_vertices(shape, scaling.axes, shares, is_spared);
  const Points scaled = scaling(shape.positions());
  Points targets(inputs.handle.vertices.size(), 3);
  for (std::size_t k = 0; k < inputs.handle.vertices.size(); ++k)
    targets.row(k) = scaled.row(inputs.handle.vertices[k]);
  inputs.handle.motion = TargetPositions{std::move(targets)};
  if (std::ranges::count(is_spared, 1) == 0) return inputs;
  inputs.material = Material::uniform(1);
  const Field stiff = salience(shape, features.bending(), scaling.axes, shares);
  inputs.material.stiffness =
      (std::log(kStiffening) * stiff.array()).exp() * narrowness(shape, scaling.axes, shares).array();
  return inputs;
}

double shared_factor(const Eigen::Vector3d& scale) {
  return scale.minCoeff();
}

Eigen::Vector3d box_middle(const RestShape& shape) {
  Eigen::AlignedBox3d box;
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    if (shape.components()[i] >= 0) box.extend(shape.positions().row(i).transpose());
  }
  return box.min() + 0.5 * (box.max() - box.min());
}

}  // namespace lpdeform
