#include "core/mesh/coarsen.h"

#include <gmock/gmock.h>

#include "core/mesh/report.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

void expect_consistent(const CoarseMesh& coarse, const TriangleMesh& fine) {
  ASSERT_EQ(coarse.mesh.vertices.rows(), static_cast<Eigen::Index>(coarse.fine_vertex.size()));
  ASSERT_EQ(fine.vertices.rows(), static_cast<Eigen::Index>(coarse.coarse_vertex.size()));
  for (std::size_t c = 0; c < coarse.fine_vertex.size(); ++c) {
    const std::int32_t v = coarse.fine_vertex[c];
    EXPECT_EQ(coarse.mesh.vertices.row(static_cast<Eigen::Index>(c)), fine.vertices.row(v));
    EXPECT_EQ(coarse.coarse_vertex[v], static_cast<std::int32_t>(c));
  }
}

TEST(Coarsen, KeepsVerticesOfTheFineMeshAndSaysWhereTheOthersWent) {
  const TriangleMesh fine = creature(40);
  const auto wanted = static_cast<std::int32_t>(fine.vertices.rows() / 6);
  const CoarseMesh coarse = coarsen(fine, wanted);
  expect_consistent(coarse, fine);
  EXPECT_LE(coarse.mesh.vertices.rows(), wanted + wanted / 10);
  EXPECT_GE(coarse.mesh.vertices.rows(), wanted);
  double longest_edge = 0;
  for (const auto& face : coarse.mesh.faces.rowwise()) {
    const auto edge = coarse.mesh.vertices.row(face[0]) - coarse.mesh.vertices.row(face[1]);
    longest_edge = std::max(longest_edge, edge.norm());
  }
  for (std::size_t v = 0; v < coarse.coarse_vertex.size(); ++v) {
    const auto into = coarse.mesh.vertices.row(coarse.coarse_vertex[v]);
    EXPECT_LT((into - fine.vertices.row(static_cast<Eigen::Index>(v))).norm(), 1.5 * longest_edge) << v;
  }
}

TEST(Coarsen, KeepsMarkedVertices) {
  const TriangleMesh fine = creature(40);
  std::vector<char> stays(fine.vertices.rows(), 0);
  std::int32_t marked = 0;
  for (std::size_t v = 0; v < stays.size(); ++v)
    marked += stays[v] = fine.vertices(static_cast<Eigen::Index>(v), 0) > 0 ? 1 : 0;
  const auto rest = static_cast<std::int32_t>(stays.size()) - marked;
  ASSERT_GT(std::min(marked, rest), 400);
  const CoarseMesh coarse = coarsen(fine, marked + rest / 6, stays);
  expect_consistent(coarse, fine);
  for (std::size_t v = 0; v < stays.size(); ++v) {
    if (stays[v] != 0) {
      EXPECT_EQ(coarse.fine_vertex[coarse.coarse_vertex[v]], static_cast<std::int32_t>(v));
    }
  }
  EXPECT_LE(coarse.mesh.vertices.rows(), marked + rest / 5);
  EXPECT_EQ(check_mesh(coarse.mesh).boundary_loops, 0);
}

TEST(Coarsen, KeepsTheTopologyOfAClosedSurface) {
  const TriangleMesh fine = block_with_holes(28, 12, 8);
  const CoarseMesh coarse = coarsen(fine, 400);
  const MeshReport report = check_mesh(coarse.mesh);
  EXPECT_EQ(report.boundary_loops, 0);
  EXPECT_EQ(report.components, 1);
  const auto euler = coarse.mesh.vertices.rows() - report.edges + coarse.mesh.faces.rows();
  EXPECT_EQ(euler, -4);  // genus 3
}

TEST(Coarsen, KeepsTheOutlineOfAGrid) {
  const TriangleMesh fine = grid(40, 30);
  const CoarseMesh coarse = coarsen(fine, 200);
  EXPECT_LT(coarse.mesh.vertices.rows(), 260);
  EXPECT_EQ(check_mesh(coarse.mesh).boundary_loops, 1);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_EQ(coarse.mesh.vertices.col(axis).minCoeff(), fine.vertices.col(axis).minCoeff());
    EXPECT_EQ(coarse.mesh.vertices.col(axis).maxCoeff(), fine.vertices.col(axis).maxCoeff());
  }
}

TEST(Coarsen, LeavesFacesOutAtWhichTheMeshIsNoManifold) {
  TriangleMesh fine = grid(10, 10);
  const Eigen::Index faces = fine.faces.rows();
  fine.faces.conservativeResize(faces + 3, 3);
  fine.faces.row(faces) = fine.faces.row(0);                             // twice the same
  fine.faces.row(faces + 1) << 0, 0, 5;                                  // no triangle
  fine.faces.row(faces + 2) << fine.faces(4, 0), fine.faces(4, 1), 120;  // a third face on an edge
  const CoarseMesh coarse = coarsen(fine, 30);
  expect_consistent(coarse, fine);
  EXPECT_LT(coarse.mesh.vertices.rows(), 80);
}

TEST(Coarsen, GivesTheMeshBackWhereThereIsNothingToDo) {
  const TriangleMesh fine = grid(2, 2);
  const CoarseMesh coarse = coarsen(fine, 9);
  expect_consistent(coarse, fine);
  EXPECT_EQ(coarse.mesh.faces.rows(), fine.faces.rows());
}

TEST(Coarsen, GivesTheSameTwice) {
  const TriangleMesh fine = creature(30);
  EXPECT_EQ(coarsen(fine, 300).mesh.faces, coarsen(fine, 300).mesh.faces);
}

}  // namespace
}  // namespace lpdeform
