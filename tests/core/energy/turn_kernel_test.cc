#include "core/energy/turn_kernel.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/energy/cell_pass.h"
#include "core/energy/rotation_fit.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLanes = CellBlocks::kLanes;
const Eigen::Vector3d kAxis = Eigen::Vector3d(1, -2, 0.5).normalized();

Eigen::Matrix3d about_axis(double angle) {
  return Eigen::AngleAxisd(angle, kAxis).toRotationMatrix();
}

/// An edge of a cell: e_ij, and T_i e_ij.
struct TurnedEdge {
  std::int32_t i, j;
  double weight;
  Eigen::Vector3d edge, turned;
};

/// All edges of all cells with a weight of their own, cell by cell.
std::vector<TurnedEdge> turned_edges(const RestShape& shape, const Points& before, const Points& now,
                                     double share) {
  const CellBlocks blocks(shape, CellPass::kChunk);
  BlockState state(blocks);
  turn_blocks(blocks, 0, blocks.block_count(), OngoingMotion{before.data(), now.data(), share}, state);
  std::vector<TurnedEdge> result;
  for (std::size_t k = 0; k < blocks.cells.size(); ++k) {
    const std::int32_t i = blocks.cells[k];
    if (i < 0) continue;
    for (std::size_t slot = blocks.first_slot[k / kLanes]; slot < blocks.first_slot[k / kLanes + 1]; ++slot) {
      const std::size_t at = slot * kLanes + k % kLanes;
      const double w = blocks.weight[at];
      const Eigen::Vector3d residual =
          Eigen::Map<const Eigen::Vector3f>(state.residuals.data() + 3 * at).cast<double>();
      EXPECT_TRUE(residual.allFinite()) << i;
      if (std::abs(w) < 1e-6) continue;
      const std::int32_t j = blocks.neighbour[at];
      const Eigen::Vector3d e = now.row(i) - now.row(j), b = before.row(i) - before.row(j);
      result.push_back({i, j, w, e, residual / w + e + share * (e - b)});
    }
  }
  EXPECT_GE(result.size(), shape.neighbours().size() / 2);
  return result;
}

/// T_i of each vertex.
std::vector<Eigen::Matrix3d> turns(const RestShape& shape, const Points& before, const Points& now,
                                   double share) {
  std::vector<Eigen::Matrix3d> moments(static_cast<std::size_t>(now.rows()), Eigen::Matrix3d::Zero());
  for (const TurnedEdge& at : turned_edges(shape, before, now, share))
    moments[static_cast<std::size_t>(at.i)] += at.turned * at.edge.transpose();
  for (Eigen::Matrix3d& moment : moments) moment = fit_rotation(moment);
  return moments;
}

/// A bumpy sheet, and the same turned and moved.
class Turns : public testing::Test {
 protected:
  Points moved(double angle) const {
    return (mesh.vertices * about_axis(angle).transpose()).rowwise() + Eigen::RowVector3d(3, -1, 7);
  }
  /// Turned, and shaken so that nothing moves rigidly.
  Points shaken_and_moved(double angle) const {
    Points result = moved(angle);
    for (Eigen::Index i = 0; i < result.rows(); ++i)
      result.row(i) += 0.2 * Eigen::RowVector3d(std::sin(3.0 * double(i)), std::sin(5.0 * double(i)),
                                                std::sin(7.0 * double(i)));
    return result;
  }

  const TriangleMesh mesh = grid(9, 7, 2);
  const std::shared_ptr<const RestShape> shape = rest_shape(mesh);
};

TEST_F(Turns, ARigidMotionIsFoundExactly) {
  for (const double angle : {-1.5, -0.3, 0.0, 1e-4, 0.05, 1.0, 1.57}) {
    for (const TurnedEdge& at : turned_edges(*shape, mesh.vertices, moved(angle), 1))
      EXPECT_LE((at.turned - about_axis(angle) * at.edge).norm(), 2e-5) << angle;
  }
}

TEST_F(Turns, MoreThanARightAngleCountsAsNone) {
  for (const double angle : {1.58, 2.5, 3.0}) {
    for (const TurnedEdge& at : turned_edges(*shape, mesh.vertices, moved(angle), 0.5))
      EXPECT_LE((at.turned - at.edge).norm(), 2e-6) << angle;
  }
}

TEST_F(Turns, SolveTheWeightedLeastSquares) {
  const Points now = shaken_and_moved(0.7);
  const std::vector<Eigen::Matrix3d> found = turns(*shape, mesh.vertices, now, 1);
  const auto [least, most] = std::minmax_element(shape->weights().begin(), shape->weights().end());
  ASSERT_LT(*least, 0.5 * *most);  // else weights would not matter
  for (Eigen::Index i = 0; i < now.rows(); ++i) {
    const Eigen::AngleAxisd turn(found[static_cast<std::size_t>(i)]);
    const Eigen::Vector3d v = 2 * std::tan(0.5 * turn.angle()) * turn.axis();
    Eigen::Vector3d rest = Eigen::Vector3d::Zero();
    double size = 0;
    for (std::int32_t k = shape->offsets()[i]; k < shape->offsets()[i + 1]; ++k) {
      const std::int32_t j = shape->neighbours()[k];
      const Eigen::Vector3d e = mesh.vertices.row(i) - mesh.vertices.row(j), f = now.row(i) - now.row(j);
      const Eigen::Vector3d mean = 0.5 * (e + f);
      rest += shape->weights()[k] * mean.cross(f - e - v.cross(mean));
      size += shape->weights()[k] * mean.squaredNorm();
    }
    EXPECT_LE(rest.norm(), 1e-5 * size) << i;
  }
}

TEST_F(Turns, AShareOfItIsThatOfTheAngleToThirdOrder) {
  for (const double share : {0.25, 0.5, 1.5, 1.9}) {
    for (const TurnedEdge& at : turned_edges(*shape, mesh.vertices, moved(0.1), share))
      EXPECT_LE((at.turned - about_axis(0.1 * share) * at.edge).norm(), 1e-3 * at.edge.norm()) << share;
  }
}

/// A flat sheet on a cylinder of radius 10: what is at x turns by 0.1 x.
TEST(TurnsOfASheet, ABendTurnsEachVertexByItsOwnAngle) {
  const TriangleMesh flat = grid(9, 7, 0);
  Points bent = flat.vertices;
  for (Eigen::Index i = 0; i < bent.rows(); ++i) {
    const double angle = 0.1 * bent(i, 0);
    bent(i, 0) = 10 * std::sin(angle);
    bent(i, 2) = 10 * (std::cos(angle) - 1);
  }
  const std::vector<Eigen::Matrix3d> found = turns(*rest_shape(flat), flat.vertices, bent, 1);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double x = flat.vertices(static_cast<Eigen::Index>(i), 0);
    if (x == 0 || x == 9) continue;  // edges to one side only
    const Eigen::AngleAxisd expected(0.1 * x, Eigen::Vector3d::UnitY());
    EXPECT_LE((found[i] - expected.toRotationMatrix()).norm(), 0.005) << x;
  }
}

TEST_F(Turns, KeepLengthsAndAngles) {
  Points now = moved(1.2);
  for (Eigen::Index i = 0; i < now.rows(); ++i) now.row(i) *= 1 + 0.3 * std::sin(7.0 * double(i));
  const std::vector<TurnedEdge> edges = turned_edges(*shape, mesh.vertices, now, 1.7);
  for (std::size_t k = 0; k + 2 < edges.size(); ++k) {
    const TurnedEdge &a = edges[k], &b = edges[k + 1], &c = edges[k + 2];
    if (a.i != c.i || b.i != c.i) continue;
    const auto near = [&](double one, double other) {
      EXPECT_NEAR(one, other, 1e-5 * (1 + a.edge.norm()) * (1 + b.edge.norm()) * (1 + c.edge.norm())) << a.i;
    };
    near(a.turned.norm(), a.edge.norm());
    near(a.turned.dot(b.turned), a.edge.dot(b.edge));
    near(a.turned.cross(b.turned).dot(c.turned), a.edge.cross(b.edge).dot(c.edge));  // no mirror image
  }
}

TEST_F(Turns, WhereNothingOrOnlyALineIsLeftThereIsATurnThatIsFinite) {
  const Points point = Points::Zero(mesh.vertices.rows(), 3);
  for (const TurnedEdge& at : turned_edges(*shape, point, point, 1)) EXPECT_EQ(at.turned.norm(), 0);
  Points line = point, across = point;
  line.col(0) = mesh.vertices.col(0) + 0.37 * mesh.vertices.col(1);
  across.col(1) = line.col(0);
  for (const TurnedEdge& at : turned_edges(*shape, line, across, 1))
    EXPECT_LE((at.turned - Eigen::Vector3d(-at.edge.y(), 0, 0)).norm(), 1e-4)
        << "e_ij is along y, and turns on by 90 degrees";
  for (const TurnedEdge& at : turned_edges(*shape, line, -line, 1))
    EXPECT_LE((at.turned - at.edge).norm(), 2e-6);
  Points flipped = -line;
  flipped.col(2) += 1e-9 * mesh.vertices.col(1);
  for (const TurnedEdge& at : turned_edges(*shape, line, flipped, 1))
    EXPECT_NEAR(at.turned.norm(), at.edge.norm(), 1e-5 * at.edge.norm());
}

/// Of any linear maps.
TEST_F(Turns, ThatAreGivenAreTaken) {
  const Points to = shaken_and_moved(0.7);
  std::vector<Turn> turns(static_cast<std::size_t>(to.rows()));
  for (std::size_t i = 0; i < turns.size(); ++i) {
    for (int e = 0; e < 9; ++e) turns[i](e / 3, e % 3) = std::sin(static_cast<float>(10 * i + e + 1));
  }
  const CellBlocks blocks(*shape, CellPass::kChunk);
  BlockState state(blocks);
  turn_blocks(blocks, 0, blocks.block_count(), TurnedMotion{mesh.vertices.data(), to.data(), turns.data()},
              state);
  std::size_t seen = 0;
  for (std::size_t k = 0; k < blocks.cells.size(); ++k) {
    const std::int32_t i = blocks.cells[k];
    if (i < 0) continue;
    for (std::size_t slot = blocks.first_slot[k / kLanes]; slot < blocks.first_slot[k / kLanes + 1]; ++slot) {
      const std::size_t at = slot * kLanes + k % kLanes;
      const std::int32_t j = blocks.neighbour[at];
      const Eigen::RowVector3d e = mesh.vertices.row(i) - mesh.vertices.row(j), y = to.row(i) - to.row(j);
      const Eigen::RowVector3d r =
          blocks.weight[at] * (e * turns[static_cast<std::size_t>(i)].cast<double>() - y);
      EXPECT_LE(
          (Eigen::Map<const Eigen::RowVector3f>(state.residuals.data() + 3 * at).cast<double>() - r).norm(),
          1e-6 * (1 + r.norm()));
      seen += r.norm() > 0.01;
    }
  }
  EXPECT_GE(seen, shape->neighbours().size() / 2);
}

/// Also of a mesh whose cells have between 3 and 12 neighbours, so that lanes and slots stay unused.
TEST(TurningForces, AreThoseOfTheCellsAtBothEndsOfAnEdge) {
  for (const TriangleMesh& mesh : {grid(9, 7, 2), creature(24), box_surface(2, 2, 3)}) {
    const auto shape = rest_shape(mesh);
    const Points before = shape->scaled_positions(), now = shaken(before, 0.2);
    std::vector<double> c(static_cast<std::size_t>(shape->vertex_count()));
    for (std::size_t i = 0; i < c.size(); ++i) c[i] = 0.1 + 0.01 * double(i % 97);
    const double share = 0.8;
    Points expected = Points::Zero(now.rows(), 3), forces;
    for (const TurnedEdge& at : turned_edges(*shape, before, now, share)) {
      const Eigen::RowVector3d b = before.row(at.i) - before.row(at.j);
      const Eigen::RowVector3d pull =
          2 * c[static_cast<std::size_t>(at.i)] * at.weight *
          (at.turned.transpose() - at.edge.transpose() - share * (at.edge.transpose() - b));
      expected.row(at.i) += pull, expected.row(at.j) -= pull;
    }
    CellPass cells(shape, Workers(1));
    cells.turning_forces(OngoingMotion{before.data(), now.data(), share}, c, forces);
    EXPECT_LE((forces - expected).norm(), 1e-6 * expected.norm());
    EXPECT_GT(expected.norm(), 0);
  }
}

TEST(TurningForces, AreTheSameBitsOnAnyNumberOfThreads) {
  const auto shape = rest_shape(grid(80, 80, 2));
  const Points before = shape->scaled_positions();
  Points now = before, one, other;
  now.col(2) += 0.5 * before.col(0).cwiseAbs2();
  const std::vector<double> c(static_cast<std::size_t>(shape->vertex_count()), 0.5);
  const OngoingMotion motion{before.data(), now.data(), 1.2};
  CellPass(shape, Workers(1)).turning_forces(motion, c, one);
  for (const int threads : {2, 3, 7}) {
    CellPass(shape, Workers(threads)).turning_forces(motion, c, other);
    EXPECT_EQ(other, one) << threads;
  }
}

/// It leaves E_i and c_i of the last evaluation as they are.
TEST(TurningForces, ChangeNothingThatTheNextEvaluationDoesNotMake) {
  const auto shape = rest_shape(grid(20, 20, 2));
  const LpNorm norm(Material::uniform(1.5), shape->vertex_count(), shape->mean_edge_length(), 1.0);
  const Points before = shape->scaled_positions(), x = shaken(before, 0.2);
  CellPass cells(shape, Workers(1)), alone(shape, Workers(1));
  const double f = cells.evaluate(x, norm);
  EXPECT_EQ(alone.evaluate(x, norm), f);
  Points forces, gradient, expected;
  cells.turning_forces(OngoingMotion{before.data(), x.data(), 1}, cells.cell_weights(), forces);
  EXPECT_EQ(cells.squared_energies(), alone.squared_energies());
  EXPECT_EQ(cells.cell_weights(), alone.cell_weights());
  EXPECT_EQ(cells.rotations(), alone.rotations());
  EXPECT_EQ(cells.evaluate(x, norm), f);
  cells.gradient(gradient), alone.gradient(expected);
  EXPECT_EQ(gradient, expected);
}

}  // namespace
}  // namespace lpdeform
