#include "core/shapes/paper_poses.h"

#include <gtest/gtest.h>

#include <array>

#include "core/constraints/constraints.h"
#include "core/energy/rest_shape.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

using Maker = PaperPose (*)(double);
constexpr std::array<Maker, 5> kMakers{paper_sheet, paper_bar, paper_block, paper_creature, paper_arm};

TEST(PaperPoses, CanBeDeformedAtEverySize) {
  for (const Maker make : kMakers) {
    for (const double size : {kSmallestPoseSize, 0.5, 1.0, 1.3}) {
      const PaperPose pose = make(size);
      const auto shape = RestShape::create(pose.mesh);
      ASSERT_TRUE(shape.ok()) << pose.name << " " << size;
      EXPECT_TRUE(make_constraints(**shape, pose.handles, FreeComponents::kError).ok())
          << pose.name << " " << size;
      EXPECT_GE(pose.handles.handles().size(), 2);
    }
  }
}

TEST(PaperPoses, HaveAboutThePapersNumberOfVertices) {
  EXPECT_EQ(paper_sheet().mesh.vertices.rows(), 3962);
  EXPECT_EQ(paper_bar().mesh.vertices.rows(), 370);
  EXPECT_NEAR(paper_block().mesh.vertices.rows() / 2132.0, 1, 0.05);
  EXPECT_NEAR(paper_creature().mesh.vertices.rows() / 2251.0, 1, 0.05);
  EXPECT_NEAR(paper_arm().mesh.vertices.rows() / 2108.0, 1, 0.05);
}

TEST(PaperPoses, LeaveMostVerticesFree) {
  for (const Maker make : kMakers) {
    const PaperPose pose = make(1);
    std::size_t held = 0;
    for (const auto& [name, handle] : pose.handles.handles()) held += handle.vertices.size();
    EXPECT_LT(held, 0.25 * static_cast<double>(pose.mesh.vertices.rows())) << pose.name;
  }
}

TEST(VerticesBetween, TakesBothBounds) {
  const Points rest = box_surface(1, 1, 3).vertices;
  EXPECT_EQ(vertices_between(rest, 2, 1, 2).size(), 8);
  EXPECT_EQ(vertices_between(rest, 2, 0.5, 0.6).size(), 0);
}

}  // namespace
}  // namespace lpdeform
