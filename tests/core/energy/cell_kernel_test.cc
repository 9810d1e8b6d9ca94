// The vector kernels compared with plain arithmetic and SVD, cell by cell, in every instruction set that this processor has.

#include "core/energy/cell_kernel.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <Eigen/Geometry>
#include <numbers>

#include "core/energy/rotation_fit.h"
#include "tests/core/every_instruction_set.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLanes = CellBlocks::kLanes;

class CellKernel : public EveryInstructionSet {
 protected:
  /// Evaluates, and checks what comes out in every lane. `tolerance`: of E_i^2 over the cell's size.
  void expect_right(const RestShape& shape, const Points& x, double tolerance = 1e-14) {
    const CellBlocks blocks(shape, 64);
    BlockState state(blocks);
    state.keep_rotations(blocks);
    evaluate_blocks(blocks, 0, blocks.block_count(), with_fillers(x).data(), true, state);
    std::vector<int> seen(shape.vertex_count(), 0);
    for (std::size_t k = 0; k < blocks.cells.size(); ++k) {
      const std::int32_t i = blocks.cells[k];
      if (i < 0) continue;
      ++seen[i];
      Eigen::Matrix3d r;
      for (std::size_t e = 0; e < 9; ++e) {
        r(e / 3, e % 3) = state.rotations[(k / kLanes * 9 + e) * kLanes + k % kLanes];
      }
      ASSERT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-13) << "vertex " << i;
      ASSERT_NEAR(r.determinant(), 1, 1e-13) << "vertex " << i;
      const Cell cell(shape, x, i);
      ASSERT_NEAR(state.squared[i], cell.squared_energy(r), 1e-14 * cell.size) << "vertex " << i;
      ASSERT_NEAR(state.squared[i], cell.squared_energy(fit_rotation_svd(cell.b)), tolerance * cell.size)
          << "vertex " << i;
    }
    EXPECT_EQ(seen, std::vector<int>(shape.vertex_count(), 1));
  }

  static std::vector<double> with_fillers(const Points& x) {
    std::vector<double> rows(static_cast<std::size_t>(x.rows()) * kRow);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      for (int axis = 0; axis < 3; ++axis) rows[static_cast<std::size_t>(i) * kRow + axis] = x(i, axis);
    }
    return rows;
  }

  static Points turned(const Points& points, double angle, const Eigen::Vector3d& axis) {
    return points * Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix().transpose();
  }

 private:
  /// A one-ring by itself.
  struct Cell {
    Cell(const RestShape& shape, const Points& x, std::int32_t i) {
      for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
        const std::int32_t j = shape.neighbours()[k];
        weights.push_back(shape.weights()[k]);
        moved.emplace_back(x.row(i) - x.row(j));
        rest.emplace_back(shape.scaled_positions().row(i) - shape.scaled_positions().row(j));
        b += weights.back() * moved.back() * rest.back().transpose();
        size += weights.back() * (moved.back().squaredNorm() + rest.back().squaredNorm());
      }
    }
    double squared_energy(const Eigen::Matrix3d& r) const {
      double sum = 0;
      for (std::size_t k = 0; k < weights.size(); ++k) {
        sum += weights[k] * (moved[k] - r * rest[k]).squaredNorm();
      }
      return sum;
    }
    std::vector<double> weights;
    std::vector<Eigen::Vector3d> moved, rest;
    Eigen::Matrix3d b = Eigen::Matrix3d::Zero();
    double size = 0;
  };
};

TEST_P(CellKernel, FitsLikeSvdOnAnyPose) {
  for (const TriangleMesh& mesh : {creature(24), box_surface(2, 3, 4), grid(7, 5, 1)}) {
    const auto shape = rest_shape(mesh);
    for (const double amount : {1e-9, 1e-3, 0.1, 1.0, 30.0}) {
      expect_right(*shape, shaken(shape->scaled_positions(), amount));
    }
  }
}

TEST_P(CellKernel, FitsHalfTurnsToRounding) {
  const auto shape = rest_shape(creature(24));
  for (const double angle : {0.0, 1e-9, std::numbers::pi - 1e-9, std::numbers::pi}) {
    for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0),
                                        Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 2, -3)}) {
      // Rounding in x is of order 1e-16 of its size, so E_i^2 is of its square.
      expect_right(*shape, turned(shape->scaled_positions(), angle, axis), 1e-26);
    }
  }
}

TEST_P(CellKernel, FitsMirroredFlatStraightAndPointLikeCells) {
  const auto shape = rest_shape(creature(24));
  const Points& rest = shape->scaled_positions();
  for (const Eigen::RowVector3d& stretch :
       {Eigen::RowVector3d(-1, 1, 1), Eigen::RowVector3d(-1, -1, -1), Eigen::RowVector3d(1, 1, 0),
        Eigen::RowVector3d(1, 0, 0), Eigen::RowVector3d(0, 0, 0), Eigen::RowVector3d(1, 1e-9, 1e-9)}) {
    const Points x = rest.array().rowwise() * stretch.array();
    expect_right(*shape, turned(x, 1.0, {1, 1, 2}));
  }
}

TEST_P(CellKernel, IsAsGoodAtTheEdgeOfTheRange) {
  const auto shape = rest_shape(box_surface(2, 2, 2));
  for (const double scale : {1e-310, 1e-158, 1e-150, 1e-9, 1e9, 1e100}) {
    expect_right(*shape, scale * shaken(shape->scaled_positions(), 0.2));
  }
}

TEST_P(CellKernel, LeavesVerticesWithoutNeighboursAtZero) {
  TriangleMesh mesh = box_surface(1, 1, 1);
  mesh.vertices.conservativeResize(mesh.vertices.rows() + 1, 3);
  mesh.vertices.bottomRows(1).setConstant(7);
  const auto shape = rest_shape(mesh);
  expect_right(*shape, shaken(shape->scaled_positions(), 0.2));
}

TEST_P(CellKernel, HoldsRotationsWhereTheyAreNotToBeFitted) {
  const auto shape = rest_shape(box_surface(2, 2, 2));
  const CellBlocks blocks(*shape, 64);
  BlockState state(blocks);
  state.keep_rotations(blocks);
  evaluate_blocks(blocks, 0, blocks.block_count(),
                  with_fillers(turned(shape->scaled_positions(), 1, {0, 0, 1})).data(), false, state);
  double sum = 0;
  for (const double squared : state.squared) sum += squared;
  EXPECT_GT(sum, 1);  // the identity is not the best here
}

INSTANTIATE_TEST_SUITE_P(Targets, CellKernel, testing::ValuesIn(instruction_sets()), by_its_name);

}  // namespace
}  // namespace lpdeform
