#pragma once

#include <memory>
#include <numbers>
#include <random>

#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"
#include "core/shapes/shapes.h"
#include "core/solve/deformer.h"

namespace lpdeform {

/// Shapes and handles that several tests deform.

inline std::shared_ptr<const RestShape> rest_shape(const TriangleMesh& mesh,
                                                   WeightKind kind = WeightKind::kCotangent) {
  return RestShape::create(mesh, kind).value();
}

/// Vertices of `mesh` between two heights along an axis.
inline std::vector<std::int32_t> slice(const TriangleMesh& mesh, int axis, double low, double high) {
  std::vector<std::int32_t> result;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    if (mesh.vertices(i, axis) >= low && mesh.vertices(i, axis) <= high)
      result.push_back(static_cast<std::int32_t>(i));
  }
  return result;
}

/// Rows of `points`, in the order of `rows`.
inline Points rows_of(const Points& points, const std::vector<std::int32_t>& rows) {
  Points result(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t k = 0; k < rows.size(); ++k)
    result.row(static_cast<Eigen::Index>(k)) = points.row(rows[k]);
  return result;
}

inline RigidMotion turn(const Eigen::Vector3d& axis, double degrees, const Eigen::Vector3d& center,
                        const Eigen::Vector3d& translation = Eigen::Vector3d::Zero()) {
  return {axis, degrees * std::numbers::pi / 180, center, translation};
}

/// Fig. 4: both ends of the bar are fixed, its middle is twisted.
inline HandleSet bar_twist(const TriangleMesh& bar, double degrees = 90, double scale = 1,
                           const Eigen::Vector3d& offset = Eigen::Vector3d::Zero()) {
  const double low = bar.vertices.col(2).minCoeff(), length = bar.vertices.col(2).maxCoeff() - low;
  const auto at = [&](double share) { return low + share * length; };
  HandleSet handles;
  (void)handles.set("bottom", {slice(bar, 2, at(0), at(0.01)), Fixed{}});
  (void)handles.set("top", {slice(bar, 2, at(0.99), at(1)), Fixed{}});
  (void)handles.set("middle",
                    {slice(bar, 2, at(0.47), at(0.53)),
                     turn(Eigen::Vector3d::UnitZ(), degrees, scale * Eigen::Vector3d(2, 2, 10.5) + offset)});
  return handles;
}

/// One end is fixed, the other is bent over.
inline HandleSet bar_bend(const TriangleMesh& bar, double degrees = 60) {
  HandleSet handles;
  (void)handles.set("bottom", {slice(bar, 2, 0, 0), Fixed{}});
  (void)handles.set("top", {slice(bar, 2, 21, 21), turn(Eigen::Vector3d::UnitX(), degrees, {2, 2, 10.5})});
  return handles;
}

inline std::unique_ptr<Deformer> deformer(std::shared_ptr<const RestShape> shape, const HandleSet& handles,
                                          const Material& material, DeformerOptions options = {}) {
  auto result = Deformer::create(std::move(shape), options).value();
  if (!result->set_handles(handles).ok() || !result->set_material(material).ok()) return nullptr;
  return result;
}

/// The vertices of grid(side, side) triangulated by slivers: between two rows, each edge of one row makes a triangle with the
/// vertex `shift` places further on in the other row. shift < side.
inline TriangleMesh slanted_plate(int side, int shift) {
  TriangleMesh mesh = grid(side, side);
  Eigen::Index face = 0;
  for (int y = 0; y < side; ++y) {
    const int low = y * (side + 1), high = low + side + 1;
    int a = 0, b = 0;  // how far each row is done
    const auto advance_low = [&] {
      mesh.faces.row(face++) << low + a, low + a + 1, high + b;
      ++a;
    };
    const auto advance_high = [&] {
      mesh.faces.row(face++) << low + a, high + b + 1, high + b;
      ++b;
    };
    while (b < shift) advance_high();
    while (b < side) advance_low(), advance_high();
    while (a < side) advance_low();
  }
  return mesh;
}

/// The mesh with every vertex moved by up to `amount`; deterministic.
inline Points shaken(const Points& points, double amount) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> move(-amount, amount);
  Points result = points;
  for (double& coordinate : result.reshaped()) coordinate += move(random);
  return result;
}

}  // namespace lpdeform
