#include "core/base/colour.h"

#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

TEST(Colour, RunsFromBlueOverGreenToRed) {
  const Rgb blue = blue_to_red(0), green = blue_to_red(0.5), red = blue_to_red(1);
  EXPECT_GT(blue[2], 2 * std::max(blue[0], blue[1]));
  EXPECT_GT(green[1], 1.5 * std::max(green[0], green[2]));
  EXPECT_GT(red[0], 2 * std::max(red[1], red[2]));
}

TEST(Colour, IsContinuousAndClamped) {
  EXPECT_EQ(blue_to_red(-3), blue_to_red(0));
  EXPECT_EQ(blue_to_red(7), blue_to_red(1));
  for (int k = 0; k < 1000; ++k) {
    const Rgb a = blue_to_red(k / 1000.0), b = blue_to_red((k + 1) / 1000.0);
    for (int channel = 0; channel < 3; ++channel) EXPECT_LE(std::abs(a[channel] - b[channel]), 1) << k;
  }
}

TEST(Colour, RedIsThe95thPercentile) {
  EXPECT_EQ(distortion_of_red(Field::LinSpaced(100, 1, 100)), 95);
  EXPECT_EQ(distortion_of_red(Field::Constant(1, 7)), 7);
  EXPECT_EQ(distortion_of_red({}), 0);
}

TEST(Colour, AFewHotVerticesShowEvenWhereTheRestIsZero) {
  Field distortion = Field::Zero(1000);
  distortion[17] = 2;
  const std::vector<Rgb> colours = distortion_colours(distortion);
  EXPECT_EQ(colours[17], blue_to_red(1));
  EXPECT_EQ(colours[18], blue_to_red(0));
}

TEST(Colour, ZerosAreBlueThroughout) {
  for (const Rgb colour : distortion_colours(Field::Zero(5))) EXPECT_EQ(colour, blue_to_red(0));
}

TEST(Colour, IsLinearBelowRedAndDoesNotDependOnTheUnit) {
  const Field distortion = Field::LinSpaced(101, 0, 100);
  const std::vector<Rgb> colours = distortion_colours(distortion);
  EXPECT_EQ(colours, distortion_colours(1e-6 * distortion));
  EXPECT_EQ(colours[19], blue_to_red(0.2));
  EXPECT_EQ(colours[100], blue_to_red(1));
}

}  // namespace
}  // namespace lpdeform
