#include "client/cli/reproduce/convex_step.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/energy/rest_shape.h"

namespace lpdeform::reproduce {
namespace {

class ConvexStepTest : public testing::TestWithParam<double> {
 protected:
  const PaperPose pose_ = paper_bar(0.5);
  const std::shared_ptr<const RestShape> shape_ = RestShape::create(pose_.mesh).value();
};

// Its minimum is one: to what a step that promises 1e-9 of the energy leaves.
TEST_P(ConvexStepTest, EndsAtOneCertifiedMinimumFromEveryStart) {
  const ConvexStep step = convex_step(shape_, pose_, GetParam(), 3, {}).value();
  ASSERT_EQ(step.lengths.size(), 5u);
  EXPECT_GT(std::ranges::min(step.lengths), 0);
  EXPECT_LT(step.spread(), 1e-8);
  EXPECT_LT(step.certified, 1e-3);
}
INSTANTIATE_TEST_SUITE_P(P, ConvexStepTest, testing::Values(1.0, 1.5, 2.0, 6.0));

TEST_P(ConvexStepTest, EndsWhereItIsAskedTo) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(convex_step(shape_, pose_, GetParam(), 1, stop.get_token()).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(ConvexStep, SpreadIsOfTheLowest) {
  EXPECT_DOUBLE_EQ((ConvexStep{2, {4, 5, 4.5}, 1}).spread(), 0.25);
}

}  // namespace
}  // namespace lpdeform::reproduce
