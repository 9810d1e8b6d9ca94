#include "core/energy/weights.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

using testing::ElementsAre;

TriangleMesh mesh_of(std::initializer_list<std::array<double, 3>> vertices,
                     std::initializer_list<std::array<int, 3>> faces) {
  TriangleMesh mesh{Points(vertices.size(), 3), Faces(faces.size(), 3)};
  Eigen::Index row = 0;
  for (const auto& v : vertices) mesh.vertices.row(row++) << v[0], v[1], v[2];
  row = 0;
  for (const auto& f : faces) mesh.faces.row(row++) << f[0], f[1], f[2];
  return mesh;
}

double weight_of(const EdgeWeights& weights, std::int32_t u, std::int32_t v) {
  for (std::size_t e = 0; e < weights.edges.size(); ++e) {
    if (weights.edges[e] == std::array{u, v}) return weights.weights[e];
  }
  return std::nan("");
}

TEST(Weights, AreHalfTheSumOfTheOppositeCotangents) {
  // Two equilateral triangles: the shared edge sees 60 degrees twice, the others once.
  const double h = std::sqrt(3.0) / 2;
  const EdgeWeights weights =
      edge_weights(mesh_of({{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}, {0.5, -h, 0}}, {{0, 1, 2}, {1, 0, 3}}),
                   WeightKind::kCotangent);
  const double cotangent = 1 / std::sqrt(3.0);
  EXPECT_NEAR(weight_of(weights, 0, 1), cotangent, 1e-15);
  EXPECT_NEAR(weight_of(weights, 0, 2), cotangent / 2, 1e-15);
  EXPECT_EQ(weights.edges.size(), 5u);
  EXPECT_TRUE(weights.clamped_edges.empty());
}

TEST(Weights, OfObtuseAnglesAreClampedAndCounted) {
  const TriangleMesh mesh = mesh_of({{0, 0, 0}, {4, 0, 0}, {2, 0.5, 0}}, {{0, 1, 2}});
  const EdgeWeights weights = edge_weights(mesh, WeightKind::kCotangent);
  EXPECT_EQ(weight_of(weights, 0, 1), 0);
  ASSERT_EQ(weights.clamped_edges.size(), 1u);
  MeshReport report;
  count_weight_defects(weights, report);
  EXPECT_EQ(report.clamped_edges.count, 1);
  EXPECT_THAT(report.clamped_edges.first, ElementsAre(0, 1));
}

TEST(Weights, OfANonManifoldEdgeSumOverAllItsFaces) {
  const double h = std::sqrt(3.0) / 2;
  const EdgeWeights weights =
      edge_weights(mesh_of({{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}, {0.5, -h, 0}, {0.5, 0, h}},
                           {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}),
                   WeightKind::kCotangent);
  EXPECT_NEAR(weight_of(weights, 0, 1), 1.5 / std::sqrt(3.0), 1e-15);
}

TEST(Weights, OfZeroAreaFacesAreNothing) {
  const EdgeWeights weights =
      edge_weights(mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0, 0}}, {{0, 1, 2}, {0, 3, 1}}),
                   WeightKind::kCotangent);
  for (const double weight : weights.weights) EXPECT_TRUE(std::isfinite(weight));
  EXPECT_NEAR(weight_of(weights, 0, 1), 0.5, 1e-15);
  // Vertex 3 hangs on the zero-area face alone: the floor keeps it attached.
  EXPECT_THAT(weights.floored_vertices, ElementsAre(3));
  EXPECT_GT(weight_of(weights, 0, 3), 0);
  EXPECT_LT(weight_of(weights, 0, 3), 1e-5);
}

TEST(Weights, OfAVertexThatClampingCutsOffAreFloored) {
  // Vertex 4 is the hub of a flat fan of triangles so thin that every spoke sees two obtuse angles.
  TriangleMesh mesh =
      mesh_of({{0, 0, 0}, {10, 0, 0}, {5, 0.2, 0}, {5, 3, 0}}, {{0, 1, 2}, {1, 3, 2}, {3, 0, 2}});
  mesh.vertices.row(2) << 5, 0.001, 0;
  const EdgeWeights weights = edge_weights(mesh, WeightKind::kCotangent);
  double total = 0;
  for (const double weight : weights.weights) total += weight;
  for (const std::int32_t vertex : weights.floored_vertices) {
    for (std::size_t e = 0; e < weights.edges.size(); ++e) {
      if (weights.edges[e][0] != vertex && weights.edges[e][1] != vertex) continue;
      EXPECT_GT(weights.weights[e], 0);
    }
  }
  EXPECT_GT(total, 0);
}

TEST(Weights, UniformAreOneOnEveryEdge) {
  const EdgeWeights weights = edge_weights(box_surface(2, 2, 2), WeightKind::kUniform);
  for (const double weight : weights.weights) EXPECT_EQ(weight, 1);
  EXPECT_TRUE(weights.clamped_edges.empty());
}

TEST(Weights, OfHealthyEdgesAreUntouchedByASliver) {
  TriangleMesh mesh = box_surface(2, 2, 4);
  const EdgeWeights before = edge_weights(mesh, WeightKind::kCotangent);
  const Eigen::Index n = mesh.vertices.rows(), m = mesh.faces.rows();
  mesh.vertices.conservativeResize(n + 1, 3);
  mesh.faces.conservativeResize(m + 1, 3);
  const std::int32_t u = mesh.faces(0, 0), v = mesh.faces(0, 1);
  mesh.vertices.row(n) =
      0.5 * (mesh.vertices.row(u) + mesh.vertices.row(v)) + 1e-10 * Eigen::RowVector3d(1, 1, 1);
  mesh.faces.row(m) << v, u, static_cast<std::int32_t>(n);
  const EdgeWeights after = edge_weights(mesh, WeightKind::kCotangent);
  EXPECT_LE(after.floored_vertices.size(), 1u);
  for (std::size_t e = 0; e < before.edges.size(); ++e) {
    const auto [a, b] = before.edges[e];
    if (a == std::min(u, v) && b == std::max(u, v)) continue;
    EXPECT_EQ(weight_of(after, a, b), before.weights[e]);
  }
}

TEST(Weights, DoNotDependOnScale) {
  TriangleMesh mesh = creature(24);
  const EdgeWeights at_one = edge_weights(mesh, WeightKind::kCotangent);
  for (const double scale : {1e-4, 1e4}) {
    TriangleMesh scaled = mesh;
    scaled.vertices *= scale;
    const EdgeWeights weights = edge_weights(scaled, WeightKind::kCotangent);
    ASSERT_EQ(weights.weights.size(), at_one.weights.size());
    for (std::size_t e = 0; e < weights.weights.size(); ++e)
      EXPECT_NEAR(weights.weights[e], at_one.weights[e], 1e-9);
  }
}

}  // namespace
}  // namespace lpdeform
