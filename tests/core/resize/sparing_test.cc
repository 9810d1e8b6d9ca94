#include "core/resize/sparing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/resize/resize.h"
#include "tests/core/poses.h"
#include "tests/core/round_shapes.h"

namespace lpdeform {
namespace {

Scaling twice_along(int axis) {
  Scaling scaling;
  scaling.scale[axis] = 2;
  return scaling;
}

std::vector<double> sparing_of(const TriangleMesh& mesh, int axis) {
  return sparing(ShapeFeatures(rest_shape(mesh)), twice_along(axis));
}

/// A ball with a round knob towards x.
TriangleMesh knobbed(int rows, double height) {
  TriangleMesh mesh = ball_with_poles(2 * rows, rows);
  for (auto x : mesh.vertices.rowwise()) {
    const double away = (x - Eigen::RowVector3d::UnitX()).squaredNorm();
    x *= 1 + height * std::exp(-away / (0.3 * 0.3));
  }
  return mesh;
}

TriangleMesh both(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh two{Points(a.vertices.rows() + b.vertices.rows(), 3),
                   Faces(a.faces.rows() + b.faces.rows(), 3)};
  two.vertices << a.vertices, b.vertices;
  two.faces << a.faces, (b.faces.array() + static_cast<std::int32_t>(a.vertices.rows())).matrix();
  return two;
}

TEST(Sparing, OfWhatHasEdgesHolesOrLimbsIsWhole) {
  for (const TriangleMesh& mesh :
       {creature(32), rocker_arm(32), pierced_block(32), block_with_holes(14, 6, 4), necked_bar(6, 21, 2, 5),
        box_surface(2, 2, 6), box_surface(4, 4, 21), box_surface(2, 30, 60), box_surface(4, 2, 2),
        box_surface(10, 10, 10)}) {
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(sparing_of(mesh, axis), std::vector<double>{1}) << mesh.vertices.rows() << ", axis " << axis;
  }
}

TEST(Sparing, OfWhatIsStraightAlongTheAxisIsNone) {
  TriangleMesh tube = grid(16, 30);  // rolled up; its seam stays open
  for (auto x : tube.vertices.rowwise()) {
    const double turn = 0.99 * 2 * std::numbers::pi * x[0] / 16;
    x = Eigen::RowVector3d(2.5 * std::cos(turn), 2.5 * std::sin(turn), x[1]);
  }
  EXPECT_EQ(sparing_of(tube, 2), std::vector<double>{0});
  EXPECT_EQ(sparing_of(grid(5, 5), 0), std::vector<double>{0});
}

TEST(Sparing, OfAKnobGrowsWithItAndDoesNotJump) {
  EXPECT_EQ(sparing_of(knobbed(24, 0), 2)[0], 0);
  EXPECT_EQ(sparing_of(knobbed(24, 0.8), 2)[0], 1);
  double before = 0;
  for (int step = 0; step <= 80; ++step) {
    const double now = sparing_of(knobbed(24, 0.01 * step), 2)[0];
    EXPECT_GE(now, before - 1e-9) << step;
    EXPECT_LE(now, before + 0.2) << step;
    before = now;
  }
}

TEST(Sparing, IsThatOfEachComponent) {
  TriangleMesh ball = ball_with_poles(16, 8);
  ball.vertices.rowwise() += Eigen::RowVector3d(20, 0, 0);
  const TriangleMesh two = both(box_surface(4, 4, 6), ball);
  EXPECT_EQ(sparing_of(two, 2), (std::vector<double>{1, 0}));
  const ResizeInputs inputs = resize_inputs(ShapeFeatures(rest_shape(two)), twice_along(2)).value();
  EXPECT_EQ(static_cast<Eigen::Index>(inputs.handle.vertices.size()), 2 * 25 + ball.vertices.rows());
}

TEST(Blended, IsEitherToTheBitAtItsEnds) {
  const TriangleMesh two = both(box_surface(1, 1, 1), box_surface(2, 1, 1));
  const auto shape = rest_shape(two);
  const Points plain = shaken(two.vertices, 0.3), spared = two.vertices;
  const Points result = blended(*shape, {1, 0}, plain, spared);
  EXPECT_EQ(result.topRows(8), spared.topRows(8));
  EXPECT_EQ(result.bottomRows(12), plain.bottomRows(12));
  EXPECT_LT((blended(*shape, {0.25, 0.25}, plain, spared) - (0.75 * plain + 0.25 * spared)).norm(), 1e-12);
}

}  // namespace
}  // namespace lpdeform
