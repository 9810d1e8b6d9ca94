#include "core/resize/resize.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/analysis/salience.h"
#include "core/base/fault.h"
#include "tests/core/poses.h"
#include "tests/core/round_shapes.h"

namespace lpdeform {
namespace {

Scaling along(double x, double y, double z) {
  return {.scale = {x, y, z}};
}

ResizeInputs inputs_for(const TriangleMesh& mesh, const Scaling& scaling) {
  return resize_inputs(ShapeFeatures(rest_shape(mesh)), scaling).value();
}

Points resized(const TriangleMesh& mesh, const Scaling& scaling,
               const std::optional<Material>& material = {}) {
  const ResizeInputs inputs = inputs_for(mesh, scaling);
  HandleSet handles;
  EXPECT_TRUE(handles.set("resize", inputs.handle).ok());
  auto solver = deformer(rest_shape(mesh), handles, material.value_or(inputs.material));
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  EXPECT_EQ(solver->solve(settings).value().stop_reason, StopReason::kConverged);
  return solver->positions();
}

/// The longer over the shorter principal axis, in x and y, of the rims of a block's three tunnels at z = 0, the
/// worst of the three; the tunnels are square.
double worst_rim_ratio(const TriangleMesh& block, const Points& positions) {
  double worst = 1;
  for (const double begin : {4.0, 12.0, 20.0}) {
    Points rim(0, 3);
    for (Eigen::Index i = 0; i < block.vertices.rows(); ++i) {
      const double x = block.vertices(i, 0) - begin, y = block.vertices(i, 1) - 4;
      const bool is_inside = x >= 0 && x <= 4 && y >= 0 && y <= 4;
      const bool is_on_rim = is_inside && (x == 0 || x == 4 || y == 0 || y == 4) && block.vertices(i, 2) == 0;
      if (!is_on_rim) continue;
      rim.conservativeResize(rim.rows() + 1, 3);
      rim.bottomRows(1) = positions.row(i);
    }
    EXPECT_EQ(rim.rows(), 16);
    const Eigen::MatrixXd flat = rim.leftCols(2).rowwise() - rim.leftCols(2).colwise().mean();
    const Eigen::Vector2d axes =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(flat.transpose() * flat).eigenvalues();
    worst = std::max(worst, std::sqrt(axes[1] / axes[0]));
  }
  return worst;
}

TEST(Resize, KeepsTheHolesOfABlockThatIsTwiceAsLong) {
  const TriangleMesh block = block_with_holes(28, 12, 8);
  const Scaling twice = along(2, 1, 1);
  const Points aware = resized(block, twice);
  EXPECT_NEAR(worst_rim_ratio(block, block.vertices), 1, 1e-12);
  EXPECT_NEAR(worst_rim_ratio(block, twice(block.vertices)), 2, 1e-12);  // without sparing
  EXPECT_LT(worst_rim_ratio(block, aware), 1.05);
  // Stiffness that is the same everywhere is not enough, for p = 2 not even as good as no sparing.
  EXPECT_GT(worst_rim_ratio(block, resized(block, twice, Material::uniform(1))), 1.5);
  EXPECT_GT(worst_rim_ratio(block, resized(block, twice, Material::uniform(2))), 1.5);
  EXPECT_NEAR(aware.col(0).maxCoeff() - aware.col(0).minCoeff(), 56, 1e-9);
}

TEST(Resize, KeepsTheProfileAcrossTheStretch) {
  const TriangleMesh block = block_with_holes(28, 12, 8);
  const Points aware = resized(block, along(2, 1, 1));
  EXPECT_LT((aware.rightCols(2) - block.vertices.rightCols(2)).cwiseAbs().maxCoeff(), 0.4);  // of 12 and 8
}

/// How many times its length at rest an edge has become, the worst of those in the outer tenths of the shape along an axis.
double most_stretched_at_ends(const TriangleMesh& mesh, const Points& positions, int axis) {
  const auto height = mesh.vertices.col(axis);
  const double low = height.minCoeff(), high = height.maxCoeff(), tenth = (high - low) / 10;
  double most = 0;
  for (const auto& face : mesh.faces.rowwise()) {
    for (int k = 0; k < 3; ++k) {
      const auto a = face[k], b = face[(k + 1) % 3];
      const bool is_outer =
          std::max(height[a], height[b]) < low + tenth || std::min(height[a], height[b]) > high - tenth;
      if (!is_outer) continue;
      most = std::max(most, (positions.row(a) - positions.row(b)).norm() /
                                (mesh.vertices.row(a) - mesh.vertices.row(b)).norm());
    }
  }
  return most;
}

// Slices near the ends are small, and would give way first.
TEST(Resize, DrawsNoTipOutIntoASpike) {
  for (const TriangleMesh& mesh : {creature(32), rocker_arm(32)}) {
    for (int axis = 0; axis < 3; ++axis) {
      Scaling scaling;
      scaling.scale[axis] = 1.5;
      EXPECT_LT(most_stretched_at_ends(mesh, resized(mesh, scaling), axis), 1.8)
          << mesh.vertices.rows() << " vertices, axis " << axis;
    }
  }
}

struct Round {
  std::string name;
  TriangleMesh mesh;
};

/// For names of tests, which would have the bytes of the mesh.
void PrintTo(const Round& round, std::ostream* out) {
  *out << round.name;
}

/// Balls and ellipsoids, from coarse to fine.
std::vector<Round> round_shapes() {
  std::vector<Round> shapes;
  for (const int rows : {8, 12, 16, 32})
    shapes.push_back({absl::StrCat("rows_", rows), ball_with_poles(2 * rows, rows)});
  for (const int levels : {1, 2, 3, 4}) shapes.push_back({absl::StrCat("levels_", levels), sphere(levels)});
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()));
  for (const Eigen::Vector3d& axes :
       {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(3, 1, 1), Eigen::Vector3d(1, 1, 0.3)}) {
    TriangleMesh ellipsoid = ball_with_poles(32, 16);
    ellipsoid.vertices *= axes.asDiagonal();
    shapes.push_back({absl::StrCat("ellipsoid_", shapes.size()), ellipsoid});
    ellipsoid.vertices *= turn;
    shapes.push_back({absl::StrCat("ellipsoid_", shapes.size()), ellipsoid});
  }
  return shapes;
}

class RoundResize : public testing::TestWithParam<Round> {};

TEST_P(RoundResize, IsPlainScalingHoweverItIsSampled) {
  for (const double noise : {0.0, 0.002, 0.01}) {
    TriangleMesh mesh = GetParam().mesh;
    mesh.vertices = with_noisy_radii(mesh.vertices, noise);
    for (const Scaling& scaling : {along(2, 1, 1), along(1, 1, 2), along(2, 3, 1), along(0.5, 1, 1)}) {
      const Points plain = scaling(mesh.vertices);
      EXPECT_LT((resized(mesh, scaling) - plain).rowwise().norm().maxCoeff(), 0.03)
          << "noise " << noise << ", by " << scaling.scale.transpose();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, RoundResize, testing::ValuesIn(round_shapes()),
                         [](const auto& info) { return info.param.name; });

TEST(Resize, OfAScaleOfOneIsTheRestShape) {
  const TriangleMesh mesh = creature(32);
  EXPECT_LT((resized(mesh, along(1, 1, 1)) - mesh.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Resize, FollowsTurnedAxesAndAnOrigin) {
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()));
  const TriangleMesh block = block_with_holes(14, 6, 4);
  TriangleMesh turned = block;
  turned.vertices = block.vertices * turn.transpose();
  Scaling scaling = along(1.5, 1, 1);
  const Points plain = resized(block, scaling);
  scaling.axes = axes_of(turn.col(0), turn.col(1)).value();
  const Points same = resized(turned, scaling);
  EXPECT_LT((same - plain * turn.transpose()).rowwise().norm().maxCoeff(), 0.05);  // of a length of 21
}

TEST(Resize, HoldsTheEndsOfEachComponentAlongScaledAxesOnly) {
  TriangleMesh two = box_surface(2, 2, 6);
  const Eigen::Index n = two.vertices.rows(), m = two.faces.rows();
  two.vertices.conservativeResize(2 * n, 3);
  two.vertices.bottomRows(n) = two.vertices.topRows(n).rowwise() + Eigen::RowVector3d(9, 0, 2);
  two.faces.conservativeResize(2 * m, 3);
  two.faces.bottomRows(m) = two.faces.topRows(m).array() + static_cast<std::int32_t>(n);
  const ResizeInputs inputs = inputs_for(two, along(1, 1, 3));
  EXPECT_EQ(inputs.handle.vertices.size(), 4u * 9);
  const Points& targets = std::get<TargetPositions>(inputs.handle.motion).positions;
  for (std::size_t k = 0; k < inputs.handle.vertices.size(); ++k) {
    const Eigen::RowVector3d rest = two.vertices.row(inputs.handle.vertices[k]);
    EXPECT_EQ(targets.row(k), Eigen::RowVector3d(rest[0], rest[1], 3 * rest[2]));
  }
}

TEST(Resize, HoldsTheSameVerticesWithTheSameMaterialWhileOneScaleIsDragged) {
  const TriangleMesh mesh = creature(32);
  const ResizeInputs a = inputs_for(mesh, along(1.2, 1, 1)), b = inputs_for(mesh, along(3, 1, 1));
  EXPECT_EQ(a.handle.vertices, b.handle.vertices);
  EXPECT_EQ(a.material, b.material);
}

// A spindle whose tips are narrow along every axis.
TEST(Resize, OfAllAxesAtOnceKeepsStiffnessInRange) {
  TriangleMesh spindle = box_surface(6, 6, 60);
  for (auto x : spindle.vertices.rowwise()) {
    const double thick = 1.01 - std::abs(x[2] - 30) / 30;
    x = Eigen::RowVector3d(thick * (x[0] - 3), thick * (x[1] - 3), x[2] - 30);
  }
  const auto turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Ones());
  spindle.vertices = (spindle.vertices * turn.toRotationMatrix().transpose()).eval();
  const Material material = inputs_for(spindle, along(2, 2, 2)).material;
  EXPECT_TRUE(check_material(material, static_cast<std::int32_t>(spindle.vertices.rows())).ok());
}

TEST(Resize, RefusesWhatIsOutOfRange) {
  const ShapeFeatures features(rest_shape(box_surface(1, 1, 2)));
  const auto reason = [&](const Scaling& scaling) {
    return fault_of(resize_inputs(features, scaling).status()).reason;
  };
  for (const double scale : {0.0, -1.0, 0.009, 101.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(reason(along(1, scale, 1)), "RESIZE_SCALE_OUT_OF_RANGE") << scale;
  EXPECT_EQ(reason({.origin = {std::nan(""), 0, 0}}), "RESIZE_ORIGIN_NOT_FINITE");
  EXPECT_EQ(reason(along(100, 0.01, 1)), "");
  for (const Eigen::Vector3d& y :
       {Eigen::Vector3d(2, 0, 0), Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, std::nan(""), 0)})
    EXPECT_EQ(fault_of(axes_of(Eigen::Vector3d::UnitX(), y).status()).reason, "RESIZE_AXES");
}

TEST(Resize, SharesTheMiddleFactor) {
  EXPECT_EQ(shared_factor({2, 1, 1}), 1);
  EXPECT_EQ(shared_factor({0.3, 0.7, 0.1}), 0.1);
  EXPECT_EQ(shared_factor({3, 3, 3}), 3);
}

TEST(Salience, IsWhereTheSurfaceTurnsAlongTheStretch) {
  const TriangleMesh bar = box_surface(4, 4, 21);
  const auto shape = rest_shape(bar);
  const BendingMeasure bending = smoothed_bending(*shape);
  const Field lengthwise = salience(*shape, bending, Eigen::Matrix3d::Identity(), {0, 0, 1});
  const Field crosswise = salience(*shape, bending, Eigen::Matrix3d::Identity(), {1, 0, 0});
  for (const std::int32_t i : slice(bar, 2, 10, 11)) {
    const bool is_on_edge = std::abs(bar.vertices(i, 0) - 2) == 2 && std::abs(bar.vertices(i, 1) - 2) == 2;
    EXPECT_LT(lengthwise[i], 0.01);
    EXPECT_TRUE(!is_on_edge || crosswise[i] > 0.2) << i;
  }
  for (const std::int32_t i : slice(bar, 2, 21, 21)) {
    const bool is_on_rim = std::max(std::abs(bar.vertices(i, 0) - 2), std::abs(bar.vertices(i, 1) - 2)) == 2;
    EXPECT_TRUE(!is_on_rim || lengthwise[i] > 0.2) << i;
  }
}

}  // namespace
}  // namespace lpdeform
