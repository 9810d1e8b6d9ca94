#include "core/analysis/automatic_material.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "core/analysis/shape_features.h"
#include "core/base/fault.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

TEST(AutomaticMaterial, FollowsItsFormula) {
  const Field joint{{0, 0.5, 1}};
  const Material material = automatic_material(joint, 0.8).value();
  EXPECT_NEAR(material.p[0], 1.2, 1e-15);
  EXPECT_NEAR(material.p[1], 1.6, 1e-15);
  EXPECT_NEAR(material.p[2], 2, 1e-15);
  EXPECT_NEAR(material.stiffness[0], 1, 1e-15);
  EXPECT_NEAR(material.stiffness[1], std::pow(10, -0.4), 1e-15);
  EXPECT_NEAR(material.stiffness[2], std::pow(10, -0.8), 1e-15);
  EXPECT_TRUE(check_material(automatic_material(joint, 1).value(), 3).ok());
}

TEST(AutomaticMaterial, OfStrengthZeroIsTheSameEverywhere) {
  const auto shape = rest_shape(necked_bar(4, 12, 2, 4));
  EXPECT_EQ(automatic_material(*shape, 0).value(), Material::uniform(2));
}

/// A tube of `around` faces around and `length` rings, open at both ends, with the radius around / 6: its cells
/// are about square.
TriangleMesh tube(int around, int length) {
  TriangleMesh mesh{Points((length + 1) * around, 3), Faces(2 * length * around, 3)};
  const double radius = around / 6.0;
  Eigen::Index f = 0;
  for (int ring = 0; ring <= length; ++ring) {
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      const int v = ring * around + k, beside = ring * around + (k + 1) % around;
      mesh.vertices.row(v) << radius * std::cos(angle), radius * std::sin(angle), ring;
      if (ring == length) continue;
      mesh.faces.row(f++) << v, beside, v + around;
      mesh.faces.row(f++) << beside, beside + around, v + around;
    }
  }
  return mesh;
}

TEST(AutomaticMaterial, OfAShapeWithoutJointsIsTwoEverywhere) {
  for (const TriangleMesh& mesh : {tube(24, 40), box_surface(4, 4, 21), sphere(3)}) {
    const auto shape = rest_shape(mesh);
    EXPECT_FALSE(has_joints(ShapeFeatures(shape).joint()));
    EXPECT_EQ(automatic_material(*shape, 1).value(), Material::uniform(2));
  }
  const ShapeFeatures necked(rest_shape(necked_bar(8, 42, 4, 6)));
  EXPECT_TRUE(has_joints(necked.joint()));
  EXPECT_LT(automatic_material(necked.joint(), 1).value().p.minCoeff(), 1.1);
}

/// A shape of one part: its mesh and its radius, half of what it is thick.
struct OnePart {
  const char* name;
  TriangleMesh (*make)();
  double radius;
};

const OnePart kOneParts[] = {{"tube", [] { return tube(24, 40); }, 4},
                             {"fine tube", [] { return tube(48, 80); }, 8},
                             {"coarse tube", [] { return tube(16, 15); }, 8.0 / 3},
                             {"bar", [] { return box_surface(4, 4, 21); }, 2},
                             {"fine bar", [] { return box_surface(8, 8, 42); }, 4},
                             {"sheet", [] { return box_surface(2, 30, 60); }, 1},
                             {"sphere", [] { return sphere(3); }, 1}};

TriangleMesh noisy(TriangleMesh mesh, double distance, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> move(-distance, distance);
  for (double& coordinate : mesh.vertices.reshaped()) coordinate += move(random);
  return mesh;
}

class NoisyShapes : public testing::TestWithParam<double> {};

TEST_P(NoisyShapes, OfOnePartAreTwoEverywhere) {
  for (const OnePart& part : kOneParts) {
    for (const unsigned seed : {1, 2, 3}) {
      const ShapeFeatures features(rest_shape(noisy(part.make(), GetParam() * part.radius, seed)));
      EXPECT_FALSE(has_joints(features.joint())) << part.name << ", " << features.joint().maxCoeff();
      EXPECT_EQ(automatic_material(features.joint(), 1).value(), Material::uniform(2)) << part.name;
    }
  }
}

TEST_P(NoisyShapes, KeepTheMaterialOfTheirJoints) {
  const TriangleMesh meshes[] = {necked_bar(8, 42, 4, 6), creature(48), rocker_arm(48)};
  const double radii[] = {4, 0.1, 0.15};  // of the creature's legs and of the arm
  for (int k = 0; k < 3; ++k) {
    const Material plain = automatic_material(*rest_shape(meshes[k]), 1).value();
    const Material noise =
        automatic_material(*rest_shape(noisy(meshes[k], GetParam() * radii[k], 1)), 1).value();
    ASSERT_EQ(noise.p.size(), meshes[k].vertices.rows());
    EXPECT_LT((noise.p - plain.p).cwiseAbs().maxCoeff(), 0.15) << k;
    EXPECT_LT((noise.p - plain.p).cwiseAbs().mean(), 0.03) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(AutomaticMaterial, NoisyShapes, testing::Values(0, 0.01, 0.02, 0.03, 0.05),
                         [](const auto& info) {
                           return std::to_string(static_cast<int>(100 * info.param + 0.5)) + "Percent";
                         });

TEST(AutomaticMaterial, ChangesContinuouslyWithTheLargestJoint) {
  Field before;
  for (double largest = 0; largest <= 1; largest += 0.001) {
    const Material material = automatic_material(Field{{0, largest}}, 1).value();
    const Field p = material.p.size() == 1 ? Field(Field::Constant(2, material.p[0])) : material.p;
    if (before.size() > 0) {
      EXPECT_LT((p - before).cwiseAbs().maxCoeff(), 0.01) << largest;
    }
    before = p;
  }
  EXPECT_NEAR(before[0], 1, 1e-12);
}

TEST(AutomaticMaterial, RefusesAStrengthOutOfRange) {
  const auto shape = rest_shape(box_surface(1, 1, 1));
  for (const double strength : {-0.1, 1.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
    const absl::Status status = automatic_material(*shape, strength).status();
    EXPECT_EQ(fault_of(status), (Fault{"STRENGTH_OUT_OF_RANGE", "strength", "0 <= strength <= 1"}));
  }
}

TEST(ShapeFeatures, KeepWhatTheyFound) {
  const auto shape = rest_shape(necked_bar(4, 12, 2, 4));
  const ShapeFeatures features(shape);
  const Field& first = features.joint();
  EXPECT_EQ(&first, &features.joint());
  EXPECT_EQ(automatic_material(first, 1).value(), automatic_material(*shape, 1).value());
}

/// The bar with a neck bent by 60 degrees: how its two halves turn against each other, and what share of the
/// distortion lies in the neck.
struct Bend {
  double degrees;
  double share_in_neck;
};

Points at(const Points& points, const std::vector<std::int32_t>& vertices) {
  Points chosen(vertices.size(), 3);
  for (std::size_t k = 0; k < vertices.size(); ++k) chosen.row(k) = points.row(vertices[k]);
  return chosen;
}

Bend bend(const Material& material) {
  const TriangleMesh bar = necked_bar(8, 42, 4, 6);
  HandleSet handles;
  (void)handles.set("bottom", {slice(bar, 2, 0, 0), Fixed{}});
  (void)handles.set("top", {slice(bar, 2, 42, 42), turn(Eigen::Vector3d::UnitX(), 60, {4, 4, 21})});
  auto solver = deformer(rest_shape(bar), handles, material);
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  EXPECT_EQ(solver->solve(settings).value().stop_reason, StopReason::kConverged);

  const auto turn_of = [&](double low, double high) {
    const std::vector<std::int32_t> part = slice(bar, 2, low, high);
    return fit_rigid(at(bar.vertices, part), at(solver->positions(), part)).rotation;
  };
  const Eigen::Matrix3d between = turn_of(0, 17.5).transpose() * turn_of(24.5, 42);
  double in_neck = 0;
  for (const std::int32_t i : slice(bar, 2, 17.5, 24.5)) in_neck += solver->cell_energies()[i];
  return {Eigen::AngleAxisd(between).angle() * 180 / std::numbers::pi,
          in_neck / solver->cell_energies().sum()};
}

TEST(AutomaticMaterial, BendsABarAtItsNeckMoreThanTheSamePEverywhere) {
  const auto shape = rest_shape(necked_bar(8, 42, 4, 6));
  const Bend plain = bend(Material::uniform(2)), half = bend(automatic_material(*shape, 0.5).value()),
             full = bend(automatic_material(*shape, 1).value());
  EXPECT_LT(plain.share_in_neck, half.share_in_neck);
  EXPECT_LT(half.share_in_neck, full.share_in_neck);
  EXPECT_LT(plain.degrees, 59);
  EXPECT_GT(full.degrees, 59.9);  // of 60: the halves are rigid
  EXPECT_LT(plain.share_in_neck, 0.6);
  EXPECT_GT(full.share_in_neck, 0.99);
}

}  // namespace
}  // namespace lpdeform
