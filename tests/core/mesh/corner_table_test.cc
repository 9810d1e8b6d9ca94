#include "core/mesh/corner_table.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <set>
#include <utility>

#include "core/mesh/report.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

constexpr double kAnyTurn = -1;

/// The first way from a to b that the table has.
CornerTable::Way way(const CornerTable& table, std::int32_t a, std::int32_t b) {
  for (std::int32_t edge = 0; edge < table.edge_count(); ++edge) {
    if (table.is_gone(edge)) continue;
    for (const CornerTable::Way& found : table.ways(edge)) {
      if (found.from == a && found.to == b) return found;
    }
  }
  ADD_FAILURE() << "no edge from " << a << " to " << b;
  return {};
}

int edges_with_right_lengths(const CornerTable& table, const TriangleMesh& mesh) {
  int count = 0;
  for (std::int32_t edge = 0; edge < table.edge_count(); ++edge) {
    if (table.is_gone(edge)) continue;
    const auto [from, to, left, right] = table.ways(edge)[0];
    count +=
        table.squared_length(edge) == (mesh.vertices.row(to) - mesh.vertices.row(from)).squaredNorm() ? 1 : 0;
  }
  return count;
}

/// A fan of `count` triangles around vertex 0, closed or with a gap.
TriangleMesh fan(int count, bool is_closed) {
  TriangleMesh mesh;
  mesh.vertices = Points::Zero(count + 2, 3);
  for (int k = 0; k <= count; ++k)
    mesh.vertices.row(k + 1) << std::cos(6.2 * k / count), std::sin(6.2 * k / count), 0;
  mesh.faces.resize(count, 3);
  for (int k = 0; k < count; ++k) mesh.faces.row(k) << 0, k + 1, is_closed ? 1 + (k + 1) % count : k + 2;
  return mesh;
}

TEST(CornerTable, HasTheEdgesOfTheMeshInTheOrderOfItsFaces) {
  const TriangleMesh mesh = creature(24);
  const CornerTable table(mesh);
  EXPECT_EQ(table.edge_count(), check_mesh(mesh).edges);
  EXPECT_EQ(table.faces(), mesh.faces);
  const auto [there, back] = table.ways(0);
  EXPECT_EQ(there.from, mesh.faces(0, 0));
  EXPECT_EQ(there.to, mesh.faces(0, 1));
  EXPECT_EQ(back.from, there.to);
  EXPECT_EQ(back.left, there.right);
  EXPECT_EQ(table.squared_length(0),
            (mesh.vertices.row(there.to) - mesh.vertices.row(there.from)).squaredNorm());
}

TEST(CornerTable, CollapsesAnEdgeWithBothItsFaces) {
  const TriangleMesh mesh = fan(6, true);
  CornerTable table(mesh);
  const CornerTable::Way inwards = way(table, 0, 1);
  ASSERT_TRUE(table.may_collapse(inwards, 14, kAnyTurn));
  table.collapse(inwards);
  Faces left(4, 3);
  left << 1, 2, 3, 1, 3, 4, 1, 4, 5, 1, 5, 6;
  EXPECT_EQ(table.faces(), left);
  const CornerTable::Way moved = way(table, 1, 4);
  EXPECT_NE(moved.left, -1);
  EXPECT_EQ(edges_with_right_lengths(table, mesh), 9);
}

TEST(CornerTable, KeepsTheBoundaryWhereItIs) {
  const TriangleMesh mesh = grid(4, 4);
  CornerTable table(mesh);
  EXPECT_FALSE(table.may_collapse(way(table, 1, 7), 14, kAnyTurn));  // from the boundary inwards
  EXPECT_TRUE(table.may_collapse(way(table, 7, 1), 14, kAnyTurn));
  EXPECT_FALSE(table.may_collapse(way(table, 1, 2), 5, kAnyTurn));  // more neighbours than that
  const CornerTable::Way along = way(table, 1, 2);
  ASSERT_TRUE(table.may_collapse(along, 14, kAnyTurn));
  table.collapse(along);
  EXPECT_EQ(table.faces().rows(), mesh.faces.rows() - 1);
  EXPECT_EQ(edges_with_right_lengths(table, mesh), table.edge_count() - 2);
}

TEST(CornerTable, KeepsASurfaceAManifold) {
  // The two sides of a triangle.
  TriangleMesh sides;
  sides.vertices = Points::Identity(3, 3);
  sides.faces.resize(2, 3);
  sides.faces << 0, 1, 2, 0, 2, 1;
  CornerTable table(sides);
  for (const CornerTable::Way& found : table.ways(0))
    EXPECT_FALSE(table.may_collapse(found, CornerTable::kMostNeighbours, kAnyTurn));
  // A tube around which three edges lead.
  TriangleMesh tube;
  tube.vertices = Points::Random(12, 3);
  tube.faces.resize(18, 3);
  for (int k = 0; k < 9; ++k) {
    const int a = k, b = k - k % 3 + (k + 1) % 3;
    tube.faces.row(2 * k) << a, b, a + 3;
    tube.faces.row(2 * k + 1) << b, b + 3, a + 3;
  }
  CornerTable narrow(tube);
  EXPECT_FALSE(narrow.may_collapse(way(narrow, 3, 4), CornerTable::kMostNeighbours, kAnyTurn));
  // Two triangles: the edge between them joins two vertices of the boundary.
  const TriangleMesh two = grid(1, 1);
  CornerTable pair(two);
  for (std::int32_t edge = 0; edge < pair.edge_count(); ++edge) {
    for (const CornerTable::Way& found : pair.ways(edge)) {
      if (found.left >= 0 && found.right >= 0) {
        EXPECT_FALSE(pair.may_collapse(found, 14, kAnyTurn));
      }
    }
  }
}

TEST(CornerTable, LocksAVertexThatOnlyJoinsTwoFans) {
  const TriangleMesh one = fan(5, false);
  TriangleMesh mesh;
  mesh.vertices.resize(2 * one.vertices.rows() - 1, 3);
  mesh.vertices << one.vertices, one.vertices.bottomRows(one.vertices.rows() - 1);
  mesh.faces.resize(2 * one.faces.rows(), 3);
  const auto shift = static_cast<std::int32_t>(one.vertices.rows() - 1);
  mesh.faces << one.faces, one.faces.unaryExpr([&](std::int32_t v) { return v == 0 ? 0 : v + shift; });
  CornerTable table(mesh);
  EXPECT_FALSE(table.may_collapse(way(table, 0, 1), CornerTable::kMostNeighbours, kAnyTurn));
  EXPECT_FALSE(table.may_collapse(way(table, 1, 0), CornerTable::kMostNeighbours, kAnyTurn));
  EXPECT_TRUE(table.may_collapse(way(table, 2, 3), CornerTable::kMostNeighbours, kAnyTurn));
}

TEST(CornerTable, RefusesAVertexWithMoreNeighboursThanItTakes) {
  const TriangleMesh mesh = fan(1000, true);
  CornerTable table(mesh);
  EXPECT_FALSE(table.may_collapse(way(table, 1, 0), CornerTable::kMostNeighbours, kAnyTurn));
  EXPECT_FALSE(table.may_collapse(way(table, 0, 1), CornerTable::kMostNeighbours, kAnyTurn));
}

/// Each face shares a half-edge with the one before it and the one after it.
TEST(CornerTable, KeepsEverySecondFaceOfAStripThatIsWoundOneWay) {
  TriangleMesh strip;
  strip.vertices = Points::Random(102, 3);
  strip.faces.resize(100, 3);
  for (int f = 0; f < 100; ++f) strip.faces.row(f) << f, f + 1, f + 2;
  const CornerTable table(strip);
  ASSERT_EQ(table.faces().rows(), 50);
  for (int f = 0; f < 50; ++f) EXPECT_EQ(table.faces().row(f), strip.faces.row(2 * f)) << f;
}

TEST(CornerTable, LeavesNoHalfEdgeTwiceWhateverTheFacesAre) {
  std::mt19937 random(1);
  const auto below = [&](std::uint32_t bound) { return static_cast<std::int32_t>(random() % bound); };
  for (int soup = 0; soup < 500; ++soup) {
    const std::int32_t vertices = 3 + below(20);
    TriangleMesh mesh;
    mesh.vertices = Points::Random(vertices, 3);
    mesh.faces.resize(1 + below(60), 3);
    for (Eigen::Index k = 0; k < mesh.faces.size(); ++k) mesh.faces.data()[k] = below(vertices);
    CornerTable table(mesh);
    for (std::int32_t edge = 0; edge < table.edge_count(); ++edge) {
      if (table.is_gone(edge)) continue;
      const CornerTable::Way found = table.ways(edge)[below(2)];
      if (table.may_collapse(found, CornerTable::kMostNeighbours, kAnyTurn)) table.collapse(found);
    }
    std::set<std::pair<std::int32_t, std::int32_t>> half_edges;
    const Faces left = table.faces();
    for (const auto& face : left.rowwise()) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_NE(face[k], face[(k + 1) % 3]) << soup;
        EXPECT_TRUE(half_edges.emplace(face[k], face[(k + 1) % 3]).second) << soup;
      }
    }
  }
}

}  // namespace
}  // namespace lpdeform
