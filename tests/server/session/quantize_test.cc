#include "server/session/quantize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

namespace lpdeform {
namespace {

template <typename Integer>
std::vector<Integer> integers(const std::string& bytes) {
  std::vector<Integer> out(bytes.size() / sizeof(Integer));
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

TEST(Quantize, IsOffByHalfAStepAtMost) {
  std::mt19937 chance(1);
  std::uniform_real_distribution<double> place(-1, 1);
  for (const double scale : {1e-25, 1.0, 1e25}) {
    Points points(500, 3);
    Field distortion(500);
    for (Eigen::Index k = 0; k < 500; ++k) {
      points.row(k) << 1e6 * scale + scale * place(chance), 100 * scale * place(chance),
          scale * place(chance);
      distortion[k] = scale * std::abs(place(chance));
    }
    const Quantization found = quantization_of(points, distortion);
    const auto q = integers<std::uint16_t>(quantize(points, distortion, found));
    for (Eigen::Index k = 0; k < 500; ++k) {
      const auto of = [&](Eigen::Index part) { return q[static_cast<std::size_t>(4 * k + part)] / 65535.0; };
      for (int axis = 0; axis < 3; ++axis) {
        // Half a step, and the rounding of double where the mesh is far from the origin.
        const double bound = found.extent[axis] / 65535 / 2 + 4e-16 * std::abs(points(k, axis));
        EXPECT_NEAR(found.origin[axis] + of(axis) * found.extent[axis], points(k, axis), bound * (1 + 1e-9));
      }
      EXPECT_NEAR(of(3) * found.distortion_extent, distortion[k],
                  found.distortion_extent / 65535 / 2 * (1 + 1e-9));
    }
  }
}

TEST(Quantize, WhatHasNoExtentIsItsOrigin) {
  Points points(2, 3);
  points << 5, 1e-310, -3, 5, 0, -3;
  const Quantization found = quantization_of(points, Field::Zero(2));
  EXPECT_EQ(found.origin, Eigen::Vector3d(5, 0, -3));
  EXPECT_EQ(integers<std::uint16_t>(quantize(points, Field::Zero(2), found)),
            std::vector<std::uint16_t>(8, 0));
}

TEST(Quantize, ReachesBothEnds) {
  Points points(2, 3);
  points << -1, 0, 2, 1, 10, 2.5;
  Field distortion(2);
  distortion << 3, 0;
  const auto q = integers<std::uint16_t>(quantize(points, distortion, quantization_of(points, distortion)));
  EXPECT_EQ(q, (std::vector<std::uint16_t>{0, 0, 0, 65535, 65535, 65535, 65535, 0}));
}

TEST(Quantize, NormalsAreOfTheFullRangeWithNothingBeside) {
  Points normals(3, 3);
  normals << 1, 0, 0, 0, -1, 0, 0.6, 0, -0.8;
  EXPECT_EQ(integers<std::int16_t>(quantize_normals(normals)),
            (std::vector<std::int16_t>{32767, 0, 0, 0, 0, -32767, 0, 0, 19660, 0, -26214, 0}));
}

TEST(Quantize, CompressesASmoothSheet) {
  Points points(10000, 3);
  for (Eigen::Index k = 0; k < points.rows(); ++k) {
    const double x = static_cast<double>(k % 100) / 100, y = static_cast<double>(k / 100) / 100;
    points.row(k) << x, y, 0.2 * std::sin(3 * x);
  }
  const Field distortion = points.col(0);
  const std::string quantized = quantize(points, distortion, quantization_of(points, distortion));
  EXPECT_EQ(quantized.size(), 80000u);
  EXPECT_LT(compress(quantized).size(), quantized.size());
}

}  // namespace
}  // namespace lpdeform
