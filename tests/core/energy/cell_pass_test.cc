#include "core/energy/cell_pass.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// p and stiffness that differ from vertex to vertex.
Material mixed_material(std::int32_t n) {
  Material material;
  material.p.resize(n);
  material.stiffness.resize(n);
  const double ps[] = {1, 1.2, 1.5, 2, 3, 6};
  for (std::int32_t i = 0; i < n; ++i) material.p[i] = ps[i % 6], material.stiffness[i] = 0.5 + i % 4;
  return material;
}

class Gradient : public testing::TestWithParam<double> {};

TEST_P(Gradient, AgreesWithCentralDifferences) {
  const auto shape = rest_shape(box_surface(2, 2, 3));
  const std::int32_t n = shape->vertex_count();
  const Material material = GetParam() > 0 ? Material::uniform(GetParam()) : mixed_material(n);
  const LpNorm norm(material, n, shape->mean_edge_length(), 1.0);
  CellPass cells(shape, Workers(1));
  const Points x = shaken(shape->scaled_positions(), 0.3);
  cells.evaluate(x, norm);
  Points gradient;
  cells.gradient(gradient);

  // Truncation is of order step^2, rounding of order 1e-16 / step: 1e-6 balances them near 1e-9.
  const double step = 1e-5;
  const double size = gradient.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < n; i += 3) {
    for (int c = 0; c < 3; ++c) {
      Points forward = x, backward = x;
      forward(i, c) += step, backward(i, c) -= step;
      const double difference = (cells.evaluate(forward, norm) - cells.evaluate(backward, norm)) / (2 * step);
      EXPECT_NEAR(gradient(i, c), difference, 1e-7 * size) << "vertex " << i << " coordinate " << c;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfEveryP, Gradient, testing::Values(1, 1.2, 1.5, 2, 3, 6, -1), [](const auto& info) {
  return info.param < 0 ? std::string("Mixed") : testing::PrintToString(static_cast<int>(10 * info.param));
});

TEST(CellPass, SeesNoEnergyInARigidMotion) {
  const auto shape = rest_shape(creature(24));
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix();
  Points moved = shape->scaled_positions() * turn.transpose();
  moved.rowwise() += Eigen::RowVector3d(3, 1, -2);
  CellPass cells(shape, Workers(1));
  const LpNorm norm(Material::uniform(1), shape->vertex_count(), shape->mean_edge_length(), 1.0);
  // E_i is a root of a sum of squares of rounding errors, about 1e-14 each in units of the edge.
  EXPECT_LT(cells.evaluate(moved, norm) / shape->vertex_count(), 1e-12);
}

TEST(CellPass, ComputesEquation3InTheCallersUnits) {
  // A single equilateral triangle stretched to twice its size: every cell's best rotation is the identity, so
  // that E_i^2 = sum_j w_ij |p_i - p_j|^2 = 2 * (cot 60 / 2) * side^2.
  const double side = 3, h = side * std::sqrt(3.0) / 2;
  TriangleMesh mesh{Points(3, 3), Faces(1, 3)};
  mesh.vertices << 0, 0, 0, side, 0, 0, side / 2, h, 0;
  mesh.faces << 0, 1, 2;
  const auto shape = rest_shape(mesh);
  CellPass cells(shape, Workers(1));
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    const LpNorm norm(Material::uniform(p), 3, shape->mean_edge_length(), 0.7);
    const double sum = cells.evaluate(2 * shape->scaled_positions(), norm);
    const double energy = std::sqrt(side * side / std::sqrt(3.0));
    EXPECT_NEAR(norm.true_energy(sum), 3 * std::pow(energy, p), 1e-12 * std::pow(energy, p));
  }
}

TEST(CellPass, WeighsMixedNormsWithTheLengthUnit) {
  TriangleMesh mesh{Points(3, 3), Faces(1, 3)};
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0.5, std::sqrt(0.75), 0;
  mesh.faces << 0, 1, 2;
  const auto shape = rest_shape(mesh);
  Material material;
  material.p = Eigen::Vector3d(1, 2, 6);
  material.stiffness = Eigen::Vector3d(2, 3, 4);
  material.length_unit = 0.25;
  const LpNorm norm(material, 3, shape->mean_edge_length(), 0.3);
  CellPass cells(shape, Workers(1));
  const double sum = cells.evaluate(2 * shape->scaled_positions(), norm);
  const double energy = std::sqrt(1 / std::sqrt(3.0)), l = 0.25;
  const double expected =
      l * l * (2 * energy / l + 3 * std::pow(energy / l, 2) + 4 * std::pow(energy / l, 6));
  EXPECT_NEAR(norm.true_energy(sum), expected, 1e-12 * expected);
}

TEST(CellPass, GivesTheSameBitsOnOneTwoAndFourThreads) {
  const auto shape = rest_shape(sphere(4));
  const Points x = shaken(shape->scaled_positions(), 0.4);
  const LpNorm norm(Material::uniform(1.3), shape->vertex_count(), shape->mean_edge_length(), 1.0);
  CellPass one(shape, Workers(1));
  ASSERT_GT(shape->vertex_count(), 4 * static_cast<std::int32_t>(CellPass::kChunk));
  Points expected;
  const double value = one.evaluate(x, norm);
  one.gradient(expected);
  for (const int threads : {2, 4}) {
    CellPass several(shape, Workers(threads));
    Points gradient;
    EXPECT_EQ(several.evaluate(x, norm), value);
    several.gradient(gradient);
    EXPECT_EQ(gradient, expected);
  }
}

TEST(CellPass, HasNoGradientWhereACellIsAtZero) {
  const auto shape = rest_shape(box_surface(1, 1, 2));
  CellPass cells(shape, Workers(1));
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    const LpNorm norm(Material::uniform(p), shape->vertex_count(), shape->mean_edge_length(), 1.0);
    Points gradient;
    cells.evaluate(shape->scaled_positions(), norm);
    cells.gradient(gradient);
    EXPECT_TRUE(gradient.allFinite());
    EXPECT_LT(gradient.cwiseAbs().maxCoeff(),
              4.0 * 6);  // a subgradient: at most the sum of a cell's root weights
  }
}

}  // namespace
}  // namespace lpdeform
