#include "core/energy/intrinsic_delaunay.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "core/energy/cell_pass.h"
#include "core/energy/weights.h"
#include "tests/core/mesh_support.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using WeightMap = std::map<std::array<std::int32_t, 2>, double>;

EdgeWeights intrinsic(const TriangleMesh& mesh) {
  return edge_weights(mesh, WeightKind::kIntrinsicDelaunay);
}

WeightMap by_edge(const EdgeWeights& weights) {
  WeightMap map;
  for (std::size_t e = 0; e < weights.edges.size(); ++e) map[weights.edges[e]] = weights.weights[e];
  return map;
}

/// Two triangles on the long diagonal of a flat kite.
TriangleMesh kite() {
  return make_mesh({{0, 0, 0}, {4, 0, 0}, {2, 0.5, 0}, {2, -0.5, 0}}, {{0, 1, 2}, {1, 0, 3}});
}

/// A closed surface whose triangles are slivers: a sphere pressed flat.
TriangleMesh pressed_sphere() {
  TriangleMesh mesh = sphere(3);
  mesh.vertices.col(2) *= 0.02;
  mesh.vertices.col(0) *= 5;
  return mesh;
}

/// A strip with half a twist: one boundary loop, no orientation.
TriangleMesh moebius_strip(int cells) {
  TriangleMesh mesh{Points(2 * cells, 3), Faces(2 * cells, 3)};
  for (int k = 0; k < cells; ++k) {
    const double around = 2 * std::numbers::pi * k / cells, tilt = around / 2;
    for (const int side : {0, 1}) {
      const double r = 3 + (side == 0 ? -1 : 1) * std::cos(tilt);
      mesh.vertices.row(2 * k + side) << r * std::cos(around), r * std::sin(around),
          (side == 0 ? -1 : 1) * std::sin(tilt);
    }
    const bool is_last = k + 1 == cells;
    const int a = 2 * k, b = a + 1, c = is_last ? 1 : a + 2, d = is_last ? 0 : a + 3;
    mesh.faces.row(2 * k) << a, b, c;
    mesh.faces.row(2 * k + 1) << b, d, c;
  }
  return mesh;
}

TEST(IntrinsicDelaunay, FlipsTheLongDiagonalOfAKite) {
  const IntrinsicDelaunay result = intrinsic_delaunay(kite());
  EXPECT_THAT(result.flipped, ElementsAre(std::array{0, 1}));
  TriangleMesh other = kite();
  other.faces << 0, 3, 2, 1, 2, 3;
  const WeightMap expected = by_edge(edge_weights(other, WeightKind::kCotangent));
  const WeightMap weights = by_edge(intrinsic(kite()));
  ASSERT_EQ(weights.size(), expected.size());
  for (const auto& [edge, weight] : expected) EXPECT_NEAR(weights.at(edge), weight, 1e-12);
}

TEST(IntrinsicDelaunay, OfASlantedLatticeIsTheUprightOne) {
  // (x, y) goes to (x + 2 y, y): the same points of the plane, the cells drawn as slivers. Away from the
  // boundary the Delaunay cells are unit squares, each side with weight 1.
  constexpr int kSide = 24;
  TriangleMesh mesh = grid(kSide, kSide);
  mesh.vertices.col(0) += 2 * mesh.vertices.col(1);
  const auto shape = rest_shape(mesh, WeightKind::kIntrinsicDelaunay);
  int seen = 0;
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    const int x = i % (kSide + 1), y = i / (kSide + 1);
    if (std::min({x, y, kSide - x, kSide - y}) < 8) continue;
    ++seen;
    for (std::int32_t k = shape->offsets()[i]; k < shape->offsets()[i + 1]; ++k) {
      const double length = (mesh.vertices.row(i) - mesh.vertices.row(shape->neighbours()[k])).squaredNorm();
      EXPECT_NEAR(shape->weights()[k], length == 1 ? 1.0 : 0.0, 1e-9) << "at " << length;
    }
  }
  EXPECT_GT(seen, 50);
}

TEST(IntrinsicDelaunay, KeepsTheDirichletEnergyOfCoordinatesInThePlane) {
  // The sum over edges of w |x_i - x_j|^2 is the Dirichlet energy of the two coordinates: twice the area.
  TriangleMesh mesh = grid(6, 6);
  mesh.vertices.col(0) += 0.4 * mesh.vertices.col(1);
  double energy = 0;
  const EdgeWeights weights = intrinsic(mesh);
  for (std::size_t e = 0; e < weights.edges.size(); ++e) {
    const auto [u, v] = weights.edges[e];
    energy += weights.weights[e] * (mesh.vertices.row(u) - mesh.vertices.row(v)).squaredNorm();
  }
  EXPECT_NEAR(energy, 2 * 36.0, 1e-9);
}

TEST(IntrinsicDelaunay, NeedsNoClampOnAnyMesh) {
  TriangleMesh fan = make_mesh({{0, 0, 0}, {1, 0, 0}, {0.5, 0.05, 0}, {0.5, -0.05, 0}, {0.5, 0, 0.05}},
                               {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});  // three triangles on an edge
  TriangleMesh twisted = moebius_strip(9);
  twisted.vertices.col(1) *= 20;
  TriangleMesh bumpy = grid(20, 20, 3.0);
  bumpy.vertices = shaken(bumpy.vertices, 0.45);
  TriangleMesh pillow = make_mesh({{0, 0, 0}, {4, 0, 0}, {1, 0.1, 0}}, {{0, 1, 2}, {0, 2, 1}});
  TriangleMesh doubled = kite();
  doubled.faces.conservativeResize(3, 3);
  doubled.faces.row(2) = doubled.faces.row(0);
  for (const TriangleMesh& mesh : {kite(), fan, twisted, bumpy, pillow, doubled, pressed_sphere()}) {
    EXPECT_THAT(edge_weights(mesh, WeightKind::kCotangent).clamped_edges, testing::Not(IsEmpty()));
    const EdgeWeights weights = intrinsic(mesh);
    EXPECT_THAT(weights.clamped_edges, IsEmpty());
    EXPECT_THAT(weights.floored_vertices, IsEmpty());
    EXPECT_THAT(weights.flipped_edges, testing::Not(IsEmpty()));
    for (std::size_t e = 0; e < weights.edges.size(); ++e) {
      EXPECT_TRUE(std::isfinite(weights.weights[e]) && weights.weights[e] >= 0);
      EXPECT_LT(weights.edges[e][0], weights.edges[e][1]) << "an edge from a vertex to itself, or backwards";
    }
  }
}

TEST(IntrinsicDelaunay, OfZeroAreaFacesIsFiniteAndJoinsTheirVertices) {
  // Vertex 3 lies on the long edge of the triangle that it subdivides badly; vertex 4 on vertex 1.
  const TriangleMesh mesh = make_mesh({{0, 0, 0}, {1, 0, 0}, {0.4, 1, 0}, {0.5, 0, 0}, {1, 0, 0}, {1, -1, 0}},
                                      {{0, 1, 2}, {0, 3, 1}, {1, 4, 5}, {3, 3, 1}, {3, 4, 1}});
  const EdgeWeights weights = intrinsic(mesh);
  EXPECT_THAT(weights.clamped_edges, IsEmpty());
  EXPECT_THAT(weights.floored_vertices, IsEmpty());
  const WeightMap map = by_edge(weights);
  for (const auto& [edge, weight] : map) EXPECT_TRUE(std::isfinite(weight) && weight >= 0);
  EXPECT_GT(map.at({2, 3}), 0.1) << "the apex is tied to the vertex on the edge below";
  EXPECT_GT(map.at({1, 4}), 1e3) << "vertices in one place move as one";
}

TEST(IntrinsicDelaunay, OfAHealthyMeshIsTheMeshToTheLastBit) {
  for (const TriangleMesh& mesh : {sphere(2), box_surface(3, 4, 5)}) {
    const EdgeWeights cotangent = edge_weights(mesh, WeightKind::kCotangent), other = intrinsic(mesh);
    EXPECT_EQ(other.edges, cotangent.edges);
    EXPECT_EQ(other.weights, cotangent.weights);
    EXPECT_THAT(other.flipped_edges, IsEmpty());
  }
}

TEST(IntrinsicDelaunay, DoesNotDependOnScaleOrPlace) {
  const TriangleMesh mesh = pressed_sphere();
  const WeightMap expected = by_edge(intrinsic(mesh));
  TriangleMesh moved = mesh;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  moved.vertices = 1e6 * mesh.vertices * turn;
  moved.vertices.rowwise() += Eigen::RowVector3d(3e5, -2e5, 1e5);
  const WeightMap weights = by_edge(intrinsic(moved));
  ASSERT_EQ(weights.size(), expected.size());
  for (const auto& [edge, weight] : expected) EXPECT_NEAR(weights.at(edge), weight, 1e-6 * (1 + weight));
}

TEST(IntrinsicDelaunay, GivesRigidMotionsNoEnergy) {
  const auto shape = rest_shape(pressed_sphere(), WeightKind::kIntrinsicDelaunay);
  EXPECT_GT(shape->report().flipped_edges.count, 100);
  EXPECT_EQ(shape->report().clamped_edges.count, 0);
  CellPass cells(shape, Workers(1));
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(2, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix();
  const Points x = (shape->scaled_positions() * turn.transpose()).rowwise() + Eigen::RowVector3d(3, 1, 2);
  cells.evaluate(x, LpNorm(Material::uniform(2), shape->vertex_count(), 1, 1));
  for (const double e2 : cells.squared_energies()) EXPECT_LT(e2, 1e-18);
}

TEST(IntrinsicDelaunay, MakesResultsDependLessOnTheTriangulation) {
  // One plate, once in squares and once in slivers of the same vertices: the results should be the same.
  constexpr int kSide = 16;
  const TriangleMesh good = grid(kSide, kSide), bad = slanted_plate(kSide, 4);
  HandleSet handles;
  ASSERT_TRUE(handles.set("left", {slice(good, 0, 0, 1), Fixed{}}).ok());
  ASSERT_TRUE(handles
                  .set("right", {slice(good, 0, kSide - 1, kSide),
                                 turn(Eigen::Vector3d::UnitY(), -60, {kSide / 2.0, 0, 0})})
                  .ok());
  const auto solved = [&](const TriangleMesh& mesh, WeightKind kind) {
    auto result = deformer(rest_shape(mesh, kind), handles, Material::uniform(2));
    EXPECT_EQ(result->solve({})->stop_reason, StopReason::kConverged);
    return result->positions();
  };
  const Points reference = solved(good, WeightKind::kCotangent);
  const double clamped = (solved(bad, WeightKind::kCotangent) - reference).norm();
  const double robust = (solved(bad, WeightKind::kIntrinsicDelaunay) - reference).norm();
  EXPECT_LT(robust, clamped / 2);
}

TEST(IntrinsicDelaunay, LeavesTheLengthUnitAlone) {
  const TriangleMesh mesh = pressed_sphere();
  EXPECT_EQ(rest_shape(mesh, WeightKind::kIntrinsicDelaunay)->mean_edge_length(),
            rest_shape(mesh)->mean_edge_length());
}

}  // namespace
}  // namespace lpdeform
