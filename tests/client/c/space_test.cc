// Coordinates of engines and back.

#include "client/c/space.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/base/fault.h"

namespace lpdeform::engine {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;

Space space_of(lpdeform_handedness handedness, lpdeform_up up, double units = 1,
               lpdeform_winding winding = 0) {
  lpdeform_options options{};
  options.handedness = handedness;
  options.up = up;
  options.units_per_metre = units;
  options.winding = winding;
  return Space::of(options).value();
}

double determinant(const Space& space) {
  const Vector x = space.direction_to_server({1, 0, 0});
  const Vector y = space.direction_to_server({0, 1, 0});
  const Vector z = space.direction_to_server({0, 0, 1});
  return x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0]) +
         x[2] * (y[0] * z[1] - y[1] * z[0]);
}

TEST(Space, ZeroIsTheServersOwn) {
  const Space space = Space::of(lpdeform_options{}).value();
  EXPECT_THAT(space.point_to_server({1, 2, 3}), ElementsAre(1, 2, 3));
  EXPECT_FALSE(space.turns_triangles());
}

TEST(Space, UpIsUpAndHandednessIsAsSaid) {
  for (const auto handedness : {LPDEFORM_RIGHT_HANDED, LPDEFORM_LEFT_HANDED}) {
    for (const auto up : {LPDEFORM_Y_UP, LPDEFORM_Z_UP}) {
      const Space space = space_of(handedness, up);
      const Vector engine_up = up == LPDEFORM_Y_UP ? Vector{0, 1, 0} : Vector{0, 0, 1};
      EXPECT_THAT(space.direction_to_server(engine_up), ElementsAre(0, 1, 0));
      EXPECT_EQ(determinant(space), handedness == LPDEFORM_RIGHT_HANDED ? 1 : -1);
    }
  }
}

TEST(Space, UnrealsAxesAreThoseOfItsGltfImporter) {
  EXPECT_THAT(space_of(LPDEFORM_LEFT_HANDED, LPDEFORM_Z_UP, 100).point_to_server({100, 200, 300}),
              ElementsAre(DoubleEq(1), DoubleEq(3), DoubleEq(2)));
}

TEST(Space, WhatGoesInComesBack) {
  for (const auto handedness : {LPDEFORM_RIGHT_HANDED, LPDEFORM_LEFT_HANDED}) {
    for (const auto up : {LPDEFORM_Y_UP, LPDEFORM_Z_UP}) {
      for (const double units : {1.0, 100.0, 39.37}) {
        const Space space = space_of(handedness, up, units);
        const Vector point{0.1, -2.5, 371};
        const Vector back = space.point_to_engine(space.point_to_server(point));
        for (int k = 0; k < 3; ++k) EXPECT_FLOAT_EQ(back[k], point[k]);  // twice rounded, as a double
        const Vector there = space.direction_to_engine(space.direction_to_server(point));
        EXPECT_EQ(there, point);
      }
    }
  }
}

/// v turned about `axis` by `angle`: Rodrigues' formula, which says the same left- and right-handed with components.
Vector turned(const Vector& v, const Vector& axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
  return {c * v[0] + s * (axis[1] * v[2] - axis[2] * v[1]) + (1 - c) * along * axis[0],
          c * v[1] + s * (axis[2] * v[0] - axis[0] * v[2]) + (1 - c) * along * axis[1],
          c * v[2] + s * (axis[0] * v[1] - axis[1] * v[0]) + (1 - c) * along * axis[2]};
}

TEST(Space, ARotationOfTheEnginesIsTheSameOneOnTheServer) {
  const Vector axis{2.0 / 7, 3.0 / 7, 6.0 / 7}, v{0.3, -1, 2};
  for (const auto handedness : {LPDEFORM_RIGHT_HANDED, LPDEFORM_LEFT_HANDED}) {
    for (const auto up : {LPDEFORM_Y_UP, LPDEFORM_Z_UP}) {
      const Space space = space_of(handedness, up);
      const Vector there = turned(space.direction_to_server(v), space.rotation_axis_to_server(axis), 0.7);
      const Vector here = space.direction_to_server(turned(v, axis, 0.7));
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(there[k], here[k], 1e-14);  // a few roundings
    }
  }
}

TEST(Space, TrianglesAreTurnedWhereTheyAreClockwise) {
  EXPECT_TRUE(space_of(LPDEFORM_LEFT_HANDED, LPDEFORM_Y_UP).turns_triangles());   // Unity
  EXPECT_FALSE(space_of(LPDEFORM_LEFT_HANDED, LPDEFORM_Z_UP).turns_triangles());  // Unreal
  EXPECT_TRUE(space_of(LPDEFORM_LEFT_HANDED, LPDEFORM_Y_UP, 1, LPDEFORM_CLOCKWISE).turns_triangles());
  EXPECT_FALSE(
      space_of(LPDEFORM_LEFT_HANDED, LPDEFORM_Y_UP, 1, LPDEFORM_COUNTER_CLOCKWISE).turns_triangles());
  EXPECT_TRUE(space_of(LPDEFORM_RIGHT_HANDED, LPDEFORM_Z_UP, 1, LPDEFORM_CLOCKWISE).turns_triangles());
  EXPECT_FALSE(space_of(LPDEFORM_RIGHT_HANDED, LPDEFORM_Z_UP, 1).turns_triangles());
}

TEST(Space, UnknownSettingsAreErrors) {
  lpdeform_options options{};
  options.up = 7;
  EXPECT_EQ(fault_of(Space::of(options).status()).element, "up");
  options = {};
  options.units_per_metre = -1;
  EXPECT_EQ(fault_of(Space::of(options).status()).reason, "UNITS_OUT_OF_RANGE");
}

}  // namespace
}  // namespace lpdeform::engine
