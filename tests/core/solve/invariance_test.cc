// The result does not depend on the numbering of the mesh, nor on its position, orientation and unit: for the plain solve, and
// for the coarse level, intrinsic weights, a region, footprints and soft handles.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "core/shapes/paper_poses.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

enum class Variant { kPlain, kMultiresolution, kIntrinsic, kRegion, kFootprint, kSoft };

constexpr double kSameEnergy = 2e-4;  // of E^(1/p): rounding leads along other paths to the same end

struct Posed {
  TriangleMesh mesh;
  HandleSet handles;
};

Posed pose_of(Variant variant) {
  PaperPose pose = paper_creature();
  Posed posed{std::move(pose.mesh), {}};
  for (const auto& [name, before] : pose.handles.handles()) {
    Handle handle = before;
    if (!std::holds_alternative<Fixed>(handle.motion)) {
      if (variant == Variant::kSoft) handle.hold = Soft{.weight = 5};
    }
    if (variant == Variant::kFootprint) handle.footprint = 0.1;
    EXPECT_TRUE(posed.handles.set(name, std::move(handle)).ok());
  }
  if (variant == Variant::kRegion) {
    const auto x = posed.mesh.vertices.col(0);
    posed.handles.set_region(vertices_between(posed.mesh.vertices, 0, x.mean(), x.maxCoeff()));
  }
  return posed;
}

/// Vertex v is number place[v], and lies where `moved` says; lengths are `scale` times those before.
template <typename Move>
Posed renumbered(const Posed& posed, const std::vector<std::int32_t>& place, double scale, Move moved) {
  const auto placed = [&](const std::vector<std::int32_t>& vertices) {
    std::vector<std::int32_t> result;
    for (const std::int32_t v : vertices) result.push_back(place[static_cast<std::size_t>(v)]);
    return result;
  };
  Posed result{posed.mesh, {}};
  const Points points = moved(posed.mesh.vertices);
  for (Eigen::Index v = 0; v < points.rows(); ++v) result.mesh.vertices.row(place[v]) = points.row(v);
  for (Eigen::Index f = 0; f < posed.mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) result.mesh.faces(f, k) = place[posed.mesh.faces(f, k)];
  }
  for (const auto& [name, before] : posed.handles.handles()) {
    Handle handle = before;
    handle.vertices = placed(before.vertices);
    handle.motion = TargetPositions{moved(target_positions(before, posed.mesh.vertices))};
    handle.footprint *= scale;
    EXPECT_TRUE(result.handles.set(name, std::move(handle)).ok());
  }
  if (posed.handles.region() != nullptr) result.handles.set_region(placed(*posed.handles.region()));
  return result;
}

class InvarianceTest : public testing::TestWithParam<std::tuple<Variant, double>> {
 protected:
  Variant variant() const { return std::get<0>(GetParam()); }
  double p() const { return std::get<1>(GetParam()); }

  /// E^(1/p), which has the unit of lengths.
  double solved(const Posed& posed) const {
    const bool is_intrinsic = variant() == Variant::kIntrinsic;
    const auto shape =
        rest_shape(posed.mesh, is_intrinsic ? WeightKind::kIntrinsicDelaunay : WeightKind::kCotangent);
    const auto solver = deformer(shape, posed.handles, Material::uniform(p()));
    const bool is_multi = variant() == Variant::kMultiresolution;
    const auto summary =
        solver->solve({.method = is_multi ? Method::kMultiresolution : Method::kQuasiNewton});
    EXPECT_TRUE(summary.ok());
    EXPECT_EQ(summary->stop_reason, StopReason::kConverged);
    EXPECT_EQ(summary->method, is_multi ? Method::kMultiresolution : Method::kQuasiNewton);
    return std::pow(summary->energy, 1 / p());
  }

  std::vector<std::int32_t> in_order(const Posed& posed) const {
    std::vector<std::int32_t> place(static_cast<std::size_t>(posed.mesh.vertices.rows()));
    std::iota(place.begin(), place.end(), 0);
    return place;
  }
};

TEST_P(InvarianceTest, NumbersOfVerticesAndOrderOfFacesDoNotMatter) {
  const Posed posed = pose_of(variant());
  std::vector<std::int32_t> place = in_order(posed);
  std::mt19937 random(5);
  std::shuffle(place.begin(), place.end(), random);
  Posed other = renumbered(posed, place, 1, [](const Points& points) { return points; });
  std::vector<std::int32_t> faces(static_cast<std::size_t>(other.mesh.faces.rows()));
  std::iota(faces.begin(), faces.end(), 0);
  std::shuffle(faces.begin(), faces.end(), random);
  const auto before = other.mesh.faces;
  for (std::size_t f = 0; f < faces.size(); ++f) {  // each from another corner on
    for (std::size_t k = 0; k < 3; ++k) {
      other.mesh.faces(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(k)) =
          before(faces[f], static_cast<Eigen::Index>((k + f) % 3));
    }
  }
  EXPECT_NEAR(solved(other) / solved(posed), 1, kSameEnergy);
}

TEST_P(InvarianceTest, PlaceTurnAndUnitDoNotMatter) {
  const Posed posed = pose_of(variant());
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const double unit = 3;
  const Posed other = renumbered(posed, in_order(posed), unit, [&](const Points& points) -> Points {
    return (unit * points * turned.transpose()).rowwise() + Eigen::RowVector3d(5, -2, 70);
  });
  EXPECT_NEAR(solved(other) / (unit * solved(posed)), 1, kSameEnergy);
}

std::string name_of(const testing::TestParamInfo<InvarianceTest::ParamType>& info) {
  static const std::vector<std::string> names = {"Plain",  "Multiresolution", "Intrinsic",
                                                 "Region", "Footprint",       "Soft"};
  return names[static_cast<std::size_t>(std::get<0>(info.param))] + "P" +
         std::to_string(static_cast<int>(10 * std::get<1>(info.param)));
}

INSTANTIATE_TEST_SUITE_P(VariantsAndNorms, InvarianceTest,
                         testing::Combine(testing::Values(Variant::kPlain, Variant::kMultiresolution,
                                                          Variant::kIntrinsic, Variant::kRegion,
                                                          Variant::kFootprint, Variant::kSoft),
                                          testing::Values(1.0, 1.5, 2.0, 6.0)),
                         name_of);

}  // namespace
}  // namespace lpdeform
