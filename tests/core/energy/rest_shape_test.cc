#include "core/energy/rest_shape.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/fault.h"
#include "core/energy/material.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

TEST(RestShape, HasSymmetricRows) {
  const auto shape = RestShape::create(creature(24)).value();
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    for (std::int32_t k = shape->offsets()[i]; k < shape->offsets()[i + 1]; ++k) {
      const std::int32_t j = shape->neighbours()[k];
      if (k > shape->offsets()[i]) {
        EXPECT_LT(shape->neighbours()[k - 1], j);
      }
      bool is_found = false;
      for (std::int32_t m = shape->offsets()[j]; m < shape->offsets()[j + 1]; ++m) {
        if (shape->neighbours()[m] == i) is_found = shape->weights()[m] == shape->weights()[k];
      }
      EXPECT_TRUE(is_found) << i << " " << j;
    }
  }
}

TEST(RestShape, RefusesWhatCannotBeDeformed) {
  TriangleMesh mesh = box_surface(1, 1, 1);
  mesh.vertices(3, 1) = std::numeric_limits<double>::quiet_NaN();
  const auto not_finite = RestShape::create(mesh);
  ASSERT_FALSE(not_finite.ok());
  EXPECT_EQ(fault_of(not_finite.status()).reason, "MESH_NOT_FINITE");
  EXPECT_EQ(fault_of(not_finite.status()).element, "vertex 3");

  mesh = box_surface(1, 1, 1);
  mesh.faces(4, 2) = 8;
  const auto bad_index = RestShape::create(mesh);
  ASSERT_FALSE(bad_index.ok());
  EXPECT_EQ(fault_of(bad_index.status()).reason, "MESH_INDEX_OUT_OF_RANGE");
  EXPECT_EQ(fault_of(bad_index.status()).element, "face 4");

  EXPECT_EQ(fault_of(RestShape::create({}).status()).reason, "MESH_EMPTY");
}

TEST(RestShape, RefusesSizesThatLeaveTheRangeOfItsNumbers) {
  for (const double scale : {1e-200, 1e-100, 1e-26, 1e26, 1e100, 1e200}) {
    TriangleMesh mesh = box_surface(2, 2, 2);
    mesh.vertices *= scale;
    EXPECT_EQ(fault_of(RestShape::create(mesh).status()).reason, "MESH_SCALE") << scale;
  }
  for (const double scale : {1e-24, 1e24}) {
    TriangleMesh mesh = box_surface(2, 2, 2);
    mesh.vertices *= scale;
    EXPECT_TRUE(RestShape::create(mesh).ok()) << scale;
  }
}

TEST(RestShape, IsNotStretchedByAVertexThatNoFaceUses) {
  TriangleMesh mesh = box_surface(2, 2, 2);
  const auto alone = RestShape::create(mesh).value();
  mesh.vertices.conservativeResize(mesh.vertices.rows() + 1, 3);
  mesh.vertices.bottomRows(1) << 1e300, -1e300, 0;
  const auto shape = RestShape::create(mesh).value();
  EXPECT_EQ(shape->diagonal(), alone->diagonal());
  EXPECT_EQ(shape->centre(), alone->centre());
  EXPECT_TRUE(shape->scaled_positions().allFinite());
}

TEST(RestShape, KnowsItsSize) {
  TriangleMesh mesh = box_surface(1, 1, 1);
  const auto shape = RestShape::create(mesh).value();
  EXPECT_NEAR(shape->diagonal(), std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(shape->mean_edge_length(), (12 + 6 * std::sqrt(2.0)) / 18, 1e-15);
  EXPECT_GT(shape->memory_bytes(), 8u * 6 * sizeof(double));
}

TEST(Material, RefusesValuesOutOfRangeAndNamesThem) {
  const auto reason = [](const Material& material) { return fault_of(check_material(material, 3)); };
  EXPECT_TRUE(check_material(Material::uniform(1), 3).ok());
  EXPECT_TRUE(check_material(Material::uniform(64), 3).ok());
  EXPECT_EQ(reason(Material::uniform(0.99)).reason, "P_OUT_OF_RANGE");
  EXPECT_EQ(reason(Material::uniform(std::nan(""))).reason, "P_OUT_OF_RANGE");
  Material material;
  material.p = Eigen::Vector3d(1, 65, 2);
  EXPECT_EQ(reason(material).element, "p[1]");
  material.p = Eigen::Vector2d(1, 2);
  EXPECT_EQ(reason(material).reason, "FIELD_SIZE");
  material = {};
  material.stiffness = Eigen::Vector3d(1, 1, 0);
  EXPECT_EQ(reason(material).reason, "STIFFNESS_OUT_OF_RANGE");
  EXPECT_EQ(reason(material).element, "stiffness[2]");
  material = {};
  material.length_unit = -1;
  EXPECT_EQ(reason(material).reason, "LENGTH_UNIT_OUT_OF_RANGE");
}

}  // namespace
}  // namespace lpdeform
