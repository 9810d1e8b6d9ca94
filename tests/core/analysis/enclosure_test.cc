#include "core/analysis/enclosure.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/analysis/thickness.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

std::vector<Enclosure> enclosures_of(const RestShape& shape) {
  return enclosures(shape, thickness_behind_faces(shape, Workers(1)));
}

TEST(Enclosure, OfABoxIsItsThickness) {
  const auto shape = rest_shape(box_surface(4, 4, 21));
  const std::vector<Enclosure> components = enclosures_of(*shape);
  ASSERT_EQ(components.size(), 1u);
  EXPECT_NEAR(components[0].thickness * shape->mean_edge_length(), 4, 1e-9);
  EXPECT_NEAR(components[0].noise_length() * shape->mean_edge_length(), 0.6, 1e-9);
  EXPECT_NEAR(components[0].share, 1, 1e-12);
}

TEST(Enclosure, OfAnOpenSurfaceIsNone) {
  const std::vector<Enclosure> components = enclosures_of(*rest_shape(grid(8, 8)));
  ASSERT_EQ(components.size(), 1u);
  EXPECT_TRUE(std::isinf(components[0].thickness));
  EXPECT_EQ(components[0].noise_length(), 0);
  EXPECT_EQ(components[0].share, 0);
}

TEST(WithoutNoise, ASphereIsRoundAgain) {
  const TriangleMesh smooth = sphere(4);
  const auto shape = rest_shape({shaken(smooth.vertices, 0.03), smooth.faces});
  const auto roughness = [](const Points& points) {
    const Eigen::VectorXd radii = points.rowwise().norm();
    return std::sqrt((radii.array() - radii.mean()).square().mean()) / radii.mean();
  };
  const auto result = without_noise(*shape, enclosures_of(*shape));
  ASSERT_TRUE(result);
  EXPECT_LT(roughness(result->scaled_positions()), 0.25 * roughness(shape->positions()));
}

TEST(WithoutNoise, AnOpenSurfaceStaysAsItIs) {
  const auto shape = rest_shape(grid(8, 8, 1));
  const auto result = without_noise(*shape, enclosures_of(*shape));
  ASSERT_TRUE(result);
  EXPECT_LT((result->scaled_positions() - shape->scaled_positions()).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace lpdeform
