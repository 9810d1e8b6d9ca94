#include "core/shapes/tetrahedra_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace lpdeform {
namespace {

const SampleGrid kGrid{{-1, -1, -1}, 0.05, {40, 45, 50}};
constexpr int kSamples = 41 * 46 * 51;

/// Three balls, of which one is as small as a cube of the grid, with the steepest slope that is allowed.
double balls(const Eigen::RowVector3d& point) {
  const std::array<Eigen::RowVector4d, 3> kBalls{
      {{0, 0, 0, 0.5}, {-0.62, 0.71, 0.83, 0.05}, {0.5, 0.9, 1.1, 0.21}}};
  double least = 1e9;
  for (const Eigen::RowVector4d& ball : kBalls)
    least = std::min(least, (point - ball.head<3>()).norm() - ball[3]);
  return kSteepestField * least;
}

TEST(TetrahedraSurface, IsThatOfAllSamplesHoweverSteepTheField) {
  // A power of two changes no digit of the cuts. So flat a field decides nothing from afar.
  const TriangleMesh all =
      tetrahedra_surface([](const auto& point) { return 0x1p-20 * balls(point); }, kGrid);
  const TriangleMesh surface = tetrahedra_surface(balls, kGrid);
  ASSERT_GT(surface.faces.rows(), 1000);
  EXPECT_EQ(surface.vertices, all.vertices);
  EXPECT_EQ(surface.faces, all.faces);
}

TEST(TetrahedraSurface, SamplesTheFieldNearTheSurfaceOnly) {
  int evaluations = 0;
  const auto counted = [&](const Eigen::RowVector3d& point) { return ++evaluations, balls(point); };
  const TriangleMesh mesh = tetrahedra_surface(counted, kGrid);
  EXPECT_LT(evaluations - 2 * mesh.vertices.rows(), kSamples / 2);
}

}  // namespace
}  // namespace lpdeform
