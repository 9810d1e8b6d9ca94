#include "core/multiresolution/coarse_level.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/core/multiresolution/keeping_solver.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// The edges of cell i as rows, each times the square root of its weight.
Eigen::MatrixXd edges(const RestShape& shape, std::int32_t i) {
  const std::int32_t begin = shape.offsets()[i], end = shape.offsets()[i + 1];
  Eigen::MatrixXd result(end - begin, 3);
  for (std::int32_t k = begin; k < end; ++k) {
    result.row(k - begin) =
        std::sqrt(shape.weights()[k]) *
        (shape.scaled_positions().row(i) - shape.scaled_positions().row(shape.neighbours()[k]));
  }
  return result;
}

/// A solver at rest, or moved, some of whose cells have turned by half a turn about their longest direction.
class TurnedSolver : public KeepingSolver {
 public:
  TurnedSolver(const RestShape& level, const std::vector<std::int32_t>& turned) : KeepingSolver(level) {
    rotations_.assign(level.vertex_count(), Eigen::Matrix3d::Identity());
    for (const std::int32_t i : turned) {
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(edges(level, i), Eigen::ComputeThinV);
      const Eigen::Vector3d axis = svd.matrixV().col(0);
      rotations_[i] = Eigen::AngleAxisd(std::numbers::pi, axis).toRotationMatrix();
    }
  }
  std::vector<Eigen::Matrix3d> rotations() override { return rotations_; }

 private:
  std::vector<Eigen::Matrix3d> rotations_;
};

/// A coarse level of a sheet, two corners of which are in one face only, where one edge weighs nothing.
class CoarseLevelTest : public testing::Test {
 protected:
  const std::shared_ptr<const RestShape> fine = rest_shape(grid(36, 36, 1));

  /// The coarse cells whose edges all lie in one line.
  std::vector<std::int32_t> thin_cells() const {
    const auto coarse = rest_shape(CoarseLevel::coarsened(*fine).mesh);
    std::vector<std::int32_t> result;
    for (std::int32_t i = 0; i < coarse->vertex_count(); ++i) {
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(edges(*coarse, i));
      if (svd.singularValues()[1] < 1e-6 * svd.singularValues()[0]) result.push_back(i);
    }
    return result;
  }
  /// How far the fine vertices are from where they are at rest if these cells have turned.
  double prolonged_off(const std::vector<std::int32_t>& turned) const {
    const auto level = CoarseLevel::create(*fine, CoarseLevel::coarsened(*fine),
                                           [&](std::shared_ptr<const RestShape> shape) {
                                             return std::make_unique<TurnedSolver>(*shape, turned);
                                           });
    return (level->prolong(*fine, Workers(1)) - fine->scaled_positions()).rowwise().norm().maxCoeff();
  }
};

TEST_F(CoarseLevelTest, ACellThatCannotTellHowItHasTurnedGuidesNoVertex) {
  const std::vector<std::int32_t> thin = thin_cells();
  ASSERT_FALSE(thin.empty());
  EXPECT_LT(prolonged_off(thin), 1e-6);
}

TEST_F(CoarseLevelTest, OtherCellsGuideTheVerticesAroundThem) {
  const std::vector<std::int32_t> thin = thin_cells();
  for (const std::int32_t i : {0, 100, 150}) {
    ASSERT_EQ(std::ranges::count(thin, i), 0);
    EXPECT_GT(prolonged_off({i}), 0.1);
  }
}

/// A strip almost without width. With uniform weights each cell is thin.
TEST(ThinCoarseLevelTest, WhereThereAreNoOtherCellsTheyGuide) {
  constexpr int kLength = 8;
  const auto strip = [](int length, double spacing) {
    TriangleMesh mesh = grid(length, 1);
    mesh.vertices.col(0) *= spacing;
    mesh.vertices.col(1) *= 1e-3;
    return mesh;
  };
  const auto fine = rest_shape(strip(kLength, 1), WeightKind::kUniform);
  CoarseMesh coarse{strip(kLength / 4, 4), {}, {}};
  for (const int row : {0, 1}) {
    for (int x = 0; x <= kLength; x += 4) coarse.fine_vertex.push_back(row * (kLength + 1) + x);
    for (int x = 0; x <= kLength; ++x) coarse.coarse_vertex.push_back(row * (kLength / 4 + 1) + (x + 1) / 4);
  }
  KeepingSolver* solver = nullptr;
  const auto level =
      CoarseLevel::create(*fine, std::move(coarse), [&](std::shared_ptr<const RestShape> shape) {
        auto made = std::make_unique<KeepingSolver>(*shape);
        solver = made.get();
        return made;
      });
  ASSERT_NE(level, nullptr);
  Points stretched = solver->positions();
  stretched.col(0) *= 2;
  ASSERT_TRUE(solver->set_positions(stretched).ok());
  const Points moved = level->prolong(*fine, Workers(1)) * fine->mean_edge_length();
  EXPECT_NEAR(moved(4, 0) - moved(2, 0), 4, 1e-3);  // halfway between two coarse vertices
  EXPECT_NEAR(moved(6, 0) - moved(4, 0), 4, 1e-3);
}

}  // namespace
}  // namespace lpdeform
