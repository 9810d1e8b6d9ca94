#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/solve/deformer.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// A bumpy plane. It is large enough for the lowest level to judge a guess.
class GoodGuessTest : public testing::Test {
 protected:
  static constexpr int kSide = 180;
  const TriangleMesh mesh = grid(kSide, kSide, 4);
  const std::shared_ptr<const RestShape> shape = rest_shape(mesh);

  std::vector<std::int32_t> around(double x, double y, double radius) const {
    std::vector<std::int32_t> found;
    for (std::int32_t v = 0; v < shape->vertex_count(); ++v) {
      if (std::hypot(mesh.vertices(v, 0) - x, mesh.vertices(v, 1) - y) < radius) found.push_back(v);
    }
    return found;
  }
  /// Holds the rim and moves the middle.
  HandleSet with(const HandleMotion& motion) const {
    std::vector<std::int32_t> rim;
    for (const int axis : {0, 1}) {
      for (const double side : {0.0, 172.0}) {
        for (const std::int32_t v : slice(mesh, axis, side, side + 8)) rim.push_back(v);
      }
    }
    std::sort(rim.begin(), rim.end());
    rim.erase(std::unique(rim.begin(), rim.end()), rim.end());
    HandleSet handles;
    (void)handles.set("rim", {rim, Fixed{}});
    (void)handles.set("middle", {around(90, 90, 18), motion});
    return handles;
  }
  HandleSet lifted() const { return with(RigidMotion{.translation = {0, 0, 50}}); }
  /// Holds the left edge and turns the right one.
  HandleSet turned() const {
    HandleSet handles;
    (void)handles.set("left", {slice(mesh, 0, 0, 4), Fixed{}});
    (void)handles.set("right", {slice(mesh, 0, kSide - 4, kSide),
                                turn(Eigen::Vector3d::UnitY(), -120, {0.5 * kSide, 0, 0})});
    return handles;
  }

  static SolveSettings settings(Method method = Method::kAuto) {
    SolveSettings result;
    result.method = method;
    result.initial = InitialGuess::kLaplacian;
    result.effort = 0;
    return result;
  }
  Method taken(const HandleSet& handles, const Material& material) const {
    return deformer(shape, handles, material)->solve(settings()).value().method;
  }
};

TEST_F(GoodGuessTest, NeedsNoCoarseLevel) {
  EXPECT_EQ(taken(lifted(), Material::uniform(2)), Method::kQuasiNewton);
  EXPECT_EQ(taken(turned(), Material::uniform(2)), Method::kMultiresolution);
}

TEST_F(GoodGuessTest, IsNotToldAtAnotherPOrWithSoftHandles) {
  EXPECT_EQ(taken(lifted(), Material::uniform(1.5)), Method::kMultiresolution);
  HandleSet soft = lifted();
  ASSERT_TRUE(soft.set("line", {around(40, 90, 4), Fixed{}, Soft{1}}).ok());
  EXPECT_EQ(taken(soft, Material::uniform(2)), Method::kMultiresolution);
}

/// At a soft hinge even a good shape has large E_i. They say nothing of the guess, which is far from the minimum here.
TEST_F(GoodGuessTest, IsJudgedWithTheStiffness) {
  Material hinge = Material::uniform(2);
  hinge.stiffness = Field::Ones(shape->vertex_count());
  for (Eigen::Index v = 0; v < hinge.stiffness.size(); ++v) {
    if (std::abs(mesh.vertices(v, 0) - 0.5 * kSide) < 10) hinge.stiffness[v] = 1e-3;
  }
  EXPECT_EQ(taken(turned(), hinge), Method::kMultiresolution);
}

TEST_F(GoodGuessTest, EndsInTheSameMinimum) {
  const auto solve = [&](Method method) {
    return deformer(shape, lifted(), Material::uniform(2))->solve(settings(method)).value().energy;
  };
  EXPECT_LT(std::sqrt(solve(Method::kAuto) / solve(Method::kMultiresolution)), 1.001);
}

/// The lowest level begins from its own guess, not where an earlier solve has left it.
TEST_F(GoodGuessTest, IsJudgedTheSameWhateverWasSolvedBefore) {
  const auto alone = deformer(shape, lifted(), Material::uniform(2));
  (void)alone->solve(settings());
  const auto later = deformer(shape, turned(), Material::uniform(2));
  (void)later->solve(settings());
  ASSERT_TRUE(later->set_handles(lifted()).ok());
  EXPECT_EQ(later->solve(settings()).value().method, Method::kQuasiNewton);
  EXPECT_EQ(alone->positions(), later->positions());

  ASSERT_TRUE(later->set_handles(turned()).ok());
  EXPECT_EQ(later->solve(settings()).value().method, Method::kMultiresolution);
  const auto other = deformer(shape, turned(), Material::uniform(2));
  (void)other->solve(settings());
  EXPECT_EQ(other->positions(), later->positions());
}

TEST_F(GoodGuessTest, GivesTheSameBitsOnAnyNumberOfThreads) {
  const auto one = deformer(shape, lifted(), Material::uniform(2), {.threads = 1});
  const auto two = deformer(shape, lifted(), Material::uniform(2), {.threads = 2});
  (void)one->solve(settings());
  (void)two->solve(settings());
  EXPECT_EQ(one->positions(), two->positions());
}

/// A drag goes on from what the fine level has found alone.
TEST_F(GoodGuessTest, IsFollowedByADrag) {
  const auto solver = deformer(shape, lifted(), Material::uniform(2));
  (void)solver->solve(settings());
  SolveSettings warm = settings();
  warm.initial = InitialGuess::kCurrent;
  for (int move = 1; move <= 4; ++move) {
    ASSERT_TRUE(solver->set_handles(with(RigidMotion{.translation = {0, 0, 50.0 + 3 * move}})).ok());
    (void)solver->solve(warm);
  }
  const auto cold = deformer(shape, with(RigidMotion{.translation = {0, 0, 62}}), Material::uniform(2));
  EXPECT_LT(std::sqrt(solver->summary().energy / cold->solve(settings()).value().energy), 1.001);
}

}  // namespace
}  // namespace lpdeform
