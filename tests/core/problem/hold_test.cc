// What each kind of handle promises, and what is refused.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/base/fault.h"
#include "core/energy/cell_pass.h"
#include "core/problem/footprint.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

SolveSettings cold(double tolerance = 1e-9) {
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  settings.tolerance = tolerance;
  return settings;
}

/// A bar held at z = 0; handles go to its other end, z = 8.
class HoldTest : public testing::Test {
 protected:
  const TriangleMesh bar = box_surface(2, 2, 8);
  const std::shared_ptr<const RestShape> shape = rest_shape(bar);
  const std::vector<std::int32_t> top = slice(bar, 2, 8, 8);
  const RigidMotion lifted = turn({1, 0, 0}, 30, {1, 1, 4}, {0.5, 0, 0.5});

  HandleSet with(const Handle& handle) const {
    HandleSet handles;
    EXPECT_TRUE(handles.set("bottom", {slice(bar, 2, 0, 0), Fixed{}}).ok());
    EXPECT_TRUE(handles.set("top", handle).ok());
    return handles;
  }
  Points solved(const HandleSet& handles, double p = 2) const {
    auto solver = deformer(shape, handles, Material::uniform(p));
    EXPECT_EQ(solver->solve(cold()).value().stop_reason, StopReason::kConverged);
    return solver->positions();
  }
  double farthest(const Points& positions, const Handle& handle) const {
    const Points targets = target_positions(handle, bar.vertices, bar.faces);
    Handle there = handle;
    there.motion = Fixed{};
    return (target_positions(there, positions, bar.faces) - targets).rowwise().norm().maxCoeff();
  }
  std::int32_t face_at_top() const {
    for (std::int32_t f = 0; f < bar.faces.rows(); ++f) {
      if (bar.vertices(bar.faces(f, 0), 2) + bar.vertices(bar.faces(f, 1), 2) +
              bar.vertices(bar.faces(f, 2), 2) ==
          24)
        return f;
    }
    return -1;
  }
};

TEST_F(HoldTest, ASoftHandleNearsItsTargetsAsItsWeightGrows) {
  for (const double p : {1.0, 2.0, 6.0}) {
    double before = std::numeric_limits<double>::infinity();
    for (const double weight : {0.01, 1.0, 100.0, 10000.0}) {
      const Handle handle{top, lifted, Soft{weight}};
      const double distance = farthest(solved(with(handle), p), handle);
      EXPECT_LT(distance, before) << p;
      before = distance;
    }
    EXPECT_LT(before, 0.02) << p;
  }
}

TEST_F(HoldTest, ASoftHandleOfNoWeightLeavesTheSurfaceAtRest) {
  EXPECT_LT((solved(with({top, lifted, Soft{0}})) - bar.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

TEST_F(HoldTest, SoftHandlesAloneHoldAComponent) {
  HandleSet handles;
  ASSERT_TRUE(handles.set("all", {top, RigidMotion{.translation = {1, 2, 3}}, Soft{1e-6}}).ok());
  const Points moved = solved(handles);
  EXPECT_LT((moved - (bar.vertices.rowwise() + Eigen::RowVector3d(1, 2, 3))).cwiseAbs().maxCoeff(), 1e-6);
  ASSERT_TRUE(handles.set("all", {top, Fixed{}, Soft{0}}).ok());
  auto solver = Deformer::create(shape, {}).value();
  EXPECT_EQ(fault_of(solver->set_handles(handles)).reason, "COMPONENT_WITHOUT_HANDLE");
  ASSERT_TRUE(handles.set("all", {top, Fixed{}, Orientation{}}).ok());
  EXPECT_EQ(fault_of(solver->set_handles(handles)).reason, "COMPONENT_WITHOUT_HANDLE");
}

TEST_F(HoldTest, SoftHandlesAloneHoldAComponentAtEveryP) {
  for (const double p : {1.0, 1.5, 6.0}) {
    HandleSet handles;
    ASSERT_TRUE(handles.set("one", {top, lifted, Soft{1}}).ok());
    ASSERT_TRUE(handles.set("other", {slice(bar, 2, 0, 0), Fixed{}, Soft{1}}).ok());
    auto solver = deformer(shape, handles, Material::uniform(p));
    const SolveSummary summary = solver->solve(cold(1e-6)).value();
    EXPECT_EQ(summary.stop_reason, StopReason::kConverged) << p;
    EXPECT_LT(summary.energy, summary.initial_energy) << p;
  }
}

TEST_F(HoldTest, APointInsideAFaceGoesWhereItIsSent) {
  const Handle handle{{}, lifted, Exactly{}, {{face_at_top(), {0.2, 0.3, 0.5}}}};
  for (const double p : {1.0, 2.0, 6.0}) EXPECT_LT(farthest(solved(with(handle), p), handle), 8e-9) << p;
}

TEST_F(HoldTest, PointsAloneHoldAComponent) {
  HandleSet handles;
  const std::int32_t f = face_at_top();
  ASSERT_TRUE(handles
                  .set("points", {{},
                                  RigidMotion{.translation = {1, 0, 0}},
                                  Exactly{},
                                  {{f, {0.2, 0.3, 0.5}}, {0, {0.2, 0.3, 0.5}}, {5, {0.6, 0.2, 0.2}}}})
                  .ok());
  const Points moved = solved(handles);
  EXPECT_LT((moved - (bar.vertices.rowwise() + Eigen::RowVector3d(1, 0, 0))).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_F(HoldTest, AnOrientationTurnsItsNeighbourhoodAndLeavesItsPlaceFree) {
  HandleSet handles = with({top, turn({0, 0, 1}, 60, {1, 1, 0}), Orientation{1e4}});
  auto solver = deformer(shape, handles, Material::uniform(2));
  ASSERT_TRUE(solver->solve(cold()).ok());
  const Eigen::Matrix3d wanted = rotation_of(handles.handles().at("top").motion);
  for (Eigen::Index f = 0; f < bar.faces.rows(); ++f) {
    bool is_at_top = true;
    for (int c = 0; c < 3; ++c) is_at_top = is_at_top && bar.vertices(bar.faces(f, c), 2) == 8;
    if (!is_at_top) continue;
    const std::int32_t i = bar.faces(f, 0), j = bar.faces(f, 1);
    const Eigen::RowVector3d edge = solver->positions().row(i) - solver->positions().row(j);
    EXPECT_LT((edge - (bar.vertices.row(i) - bar.vertices.row(j)) * wanted.transpose()).norm(), 1e-3);
  }
  // Twisting shortens the bar: a handle that held positions would not let it.
  EXPECT_LT(solver->positions().row(top[0]).z(), 8 - 1e-3);
  EXPECT_GT(solver->summary().soft_energy, 0);
}

TEST_F(HoldTest, LocksHoldAcrossAndAreAtTheOptimumAlong) {
  const Eigen::Vector3d direction = Eigen::Vector3d(0.3, -0.5, 1).normalized();
  for (const double p : {1.5, 2.0}) {
    for (const bool is_axis : {true, false}) {
      const Hold hold = is_axis ? Hold(AxisLock{3 * direction}) : Hold(PlaneLock{3 * direction});
      const Handle handle{top, lifted, hold};
      const Points x = solved(with(handle), p);
      const Points off = rows_of(x, top) - target_positions(handle, bar.vertices);
      for (Eigen::Index k = 0; k < off.rows(); ++k) {
        const double along = off.row(k) * direction;
        const double across = (off.row(k) - along * direction.transpose()).norm();
        EXPECT_LT(is_axis ? across : std::abs(along), 1e-12);
      }
      EXPECT_GT(off.norm(), 1e-3);  // and it did use its freedom
      // Moving a locked vertex a little the way it is free never helps.
      CellPass cells(shape, Workers(1));
      const LpNorm norm(Material::uniform(p), shape->vertex_count(), shape->mean_edge_length(), 1);
      const Points scaled = (x.rowwise() - shape->centre()) / shape->mean_edge_length();
      const double optimum = cells.evaluate(scaled, norm);
      const Eigen::Vector3d free = is_axis ? direction : direction.unitOrthogonal();
      for (const double step : {-1e-2, 1e-2}) {
        Points moved = scaled;
        moved.row(top[1]) += step * free.transpose();
        EXPECT_GT(cells.evaluate(moved, norm), optimum);
      }
    }
  }
}

TEST_F(HoldTest, ALockAloneHoldsAComponent) {
  HandleSet handles;
  ASSERT_TRUE(handles.set("rail", {top, RigidMotion{.translation = {1, 2, 0}}, AxisLock{{0, 0, 1}}}).ok());
  auto solver = deformer(shape, handles, Material::uniform(2));
  SolveSettings settings = cold();
  settings.certify = true;
  const SolveSummary summary = solver->solve(settings).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kConverged);
  EXPECT_LT(
      (solver->positions().leftCols(2) - (bar.vertices.leftCols(2).rowwise() + Eigen::RowVector2d(1, 2)))
          .cwiseAbs()
          .maxCoeff(),
      1e-6);
}

TEST_F(HoldTest, CertificatesBoundEveryKind) {
  const std::vector<Handle> kinds = {{top, lifted, Soft{2}},
                                     {{}, lifted, Exactly{}, {{face_at_top(), {0.2, 0.3, 0.5}}}},
                                     {top, lifted, Orientation{}},
                                     {top, lifted, AxisLock{{1, 2, 3}}},
                                     {top, lifted, PlaneLock{{1, 2, 3}}}};
  for (const Handle& kind : kinds) {
    for (const double p : {1.0, 1.5, 2.0, 6.0}) {
      auto solver = deformer(shape, with(kind), Material::uniform(p));
      SolveSettings settings = cold();
      settings.certify = true;
      const double gap = solver->solve(settings).value().optimality_gap.value();
      EXPECT_LT(gap, p == 1 ? 1e-3 : 1e-5) << kind.hold.index() << ", p = " << p;
      EXPECT_GE(gap, 0);
    }
  }
}

TEST_F(HoldTest, OtherMethodsTakeThemOrSayThatTheyDoNot) {
  const std::vector<Handle> kinds = {{top, lifted, Soft{2}},
                                     {{}, lifted, Exactly{}, {{face_at_top(), {0.2, 0.3, 0.5}}}},
                                     {top, lifted, Orientation{}},
                                     {top, lifted, AxisLock{{1, 2, 3}}}};
  for (const Handle& kind : kinds) {
    auto solver = deformer(shape, with(kind), Material::uniform(2));
    const double energy = solver->solve(cold()).value().energy;
    SolveSettings settings = cold();
    settings.method = Method::kLocalGlobal;
    EXPECT_NEAR(solver->solve(settings).value().energy / energy, 1, 1e-3);
    settings.method = Method::kLineSearch;
    settings.max_iterations = 300;  // gradient descent is far from the end by then
    EXPECT_LT(solver->solve(settings).value().energy, 0.9 * solver->summary().initial_energy);
    EXPECT_GT(solver->summary().energy, 0.999 * energy);
    ASSERT_TRUE(solver->set_material(Material::uniform(1)).ok());
    settings.method = Method::kConic;
    EXPECT_EQ(fault_of(solver->start(settings)),
              (Fault{"METHOD_NEEDS_EXACT_HANDLES", "handle \"top\"", "handles that hold vertices exactly"}));
  }
}

TEST_F(HoldTest, OnlyTheRegionMoves) {
  const std::vector<std::int32_t> upper = slice(bar, 2, 4, 8);
  HandleSet handles = with({top, lifted});
  handles.set_region(upper);
  auto solver = deformer(shape, handles, Material::uniform(1.5));
  ASSERT_TRUE(solver->solve(cold()).ok());
  for (Eigen::Index i = 0; i < bar.vertices.rows(); ++i) {
    if (bar.vertices(i, 2) >= 4) continue;
    EXPECT_EQ(solver->positions().row(i), bar.vertices.row(i));
  }
  EXPECT_GT((solver->positions() - bar.vertices).norm(), 1);

  // Another region holds the rest where it is by now; the base handle outside of it is no longer needed.
  const Points before = solver->positions();
  ASSERT_TRUE(handles.remove("bottom"));
  ASSERT_TRUE(handles.set_motion("top", Fixed{}).ok());
  handles.set_region(slice(bar, 2, 6, 8));
  ASSERT_TRUE(solver->set_handles(handles).ok());
  ASSERT_TRUE(solver->solve({}).ok());
  for (Eigen::Index i = 0; i < bar.vertices.rows(); ++i) {
    if (bar.vertices(i, 2) >= 6) continue;
    EXPECT_EQ(solver->positions().row(i), before.row(i));
  }

  handles.clear_region();
  ASSERT_TRUE(solver->set_handles(handles).ok());
  ASSERT_TRUE(solver->solve(cold()).ok());
  EXPECT_LT((solver->positions() - bar.vertices).cwiseAbs().maxCoeff(), 1e-3);  // nothing bends it any more
}

TEST_F(HoldTest, ARegionNeedsNoHandleInEveryComponent) {
  HandleSet handles;
  ASSERT_TRUE(handles.set("top", {top, lifted}).ok());
  handles.set_region(slice(bar, 2, 4, 8));
  EXPECT_LT(farthest(solved(handles), {top, lifted}), 1e-12);
}

TEST_F(HoldTest, AFootprintIsStiffAtItsHandleAndFallsToOneAtItsRadius) {
  HandleSet handles;
  Handle handle{{top[0]}, lifted};
  handle.footprint = 2.5;
  ASSERT_TRUE(handles.set("tip", handle).ok());
  const Field factors = footprint_stiffness(*shape, handles);
  EXPECT_EQ(factors[top[0]], kFootprintStiffness);
  EXPECT_EQ(factors.minCoeff(), 1);
  for (Eigen::Index i = 0; i < factors.size(); ++i) {
    const double distance = (bar.vertices.row(i) - bar.vertices.row(top[0])).norm();
    if (distance >= 2.5) {
      EXPECT_EQ(factors[i], 1);
    } else if (distance == 1) {
      EXPECT_DOUBLE_EQ(factors[i], 1 + (kFootprintStiffness - 1) * std::pow(1 - 0.16, 2));
    }
  }
  EXPECT_EQ(footprint_stiffness(*shape, with({top, lifted})).size(), 0);
}

TEST_F(HoldTest, AFootprintTakesTheSpikeOfASingleVertex) {
  const TriangleMesh plane = grid(24, 24);
  const std::vector<std::int32_t> middle = slice(plane, 0, 12, 12);
  std::int32_t centre = -1;
  for (const std::int32_t i : middle) {
    if (plane.vertices(i, 1) == 12) centre = i;
  }
  for (const double p : {1.0, 2.0}) {
    double spike[2];
    for (const bool has_footprint : {false, true}) {
      HandleSet handles;
      ASSERT_TRUE(handles.set("left", {slice(plane, 0, 0, 0), Fixed{}}).ok());
      ASSERT_TRUE(handles.set("right", {slice(plane, 0, 24, 24), Fixed{}}).ok());
      Handle tip{{centre}, RigidMotion{.translation = {0, 0, 5}}};
      tip.footprint = has_footprint ? 3 : 0;
      ASSERT_TRUE(handles.set("tip", tip).ok());
      auto solver = deformer(rest_shape(plane), handles, Material::uniform(p));
      ASSERT_TRUE(solver->solve(cold(1e-5)).ok());
      double ring = 0;
      for (Eigen::Index i = 0; i < plane.vertices.rows(); ++i) {
        const double distance = (plane.vertices.row(i) - plane.vertices.row(centre)).norm();
        if (distance > 0 && distance < 1.1) ring += solver->positions()(i, 2) / 4;
      }
      spike[has_footprint] = 5 - ring;
    }
    EXPECT_LT(spike[1], 0.25 * spike[0]) << p;
  }
}

TEST_F(HoldTest, RefusesWhatCannotBeHeldAndNamesIt) {
  HandleSet handles;
  const auto reason = [&](const Handle& handle) { return fault_of(handles.set("top", handle)).reason; };
  EXPECT_EQ(reason({top, Fixed{}, Soft{-1}}), "HANDLE_WEIGHT_OUT_OF_RANGE");
  EXPECT_EQ(reason({top, Fixed{}, Soft{kNan}}), "HANDLE_WEIGHT_OUT_OF_RANGE");
  EXPECT_EQ(reason({top, Fixed{}, Orientation{2e6}}), "HANDLE_WEIGHT_OUT_OF_RANGE");
  EXPECT_EQ(reason({top, Fixed{}, AxisLock{{0, 0, 0}}}), "HANDLE_LOCK_DIRECTION");
  EXPECT_EQ(reason({top, Fixed{}, PlaneLock{{0, kNan, 0}}}), "HANDLE_LOCK_DIRECTION");
  EXPECT_EQ(reason({top, TargetPositions{rows_of(bar.vertices, top)}, Orientation{}}),
            "HANDLE_KIND_NEEDS_ROTATION");
  EXPECT_EQ(reason({{}, Fixed{}, AxisLock{}, {{0, {1, 0, 0}}}}), "HANDLE_KIND_NEEDS_VERTICES");
  EXPECT_EQ(reason({{}, Fixed{}, Exactly{}, {{0, {0.5, 0.5, 0.5}}}}), "HANDLE_BARYCENTRIC");
  EXPECT_EQ(reason({{}, Fixed{}, Exactly{}, {{0, {kNan, 0.5, 0.5}}}}), "HANDLE_BARYCENTRIC");
  EXPECT_EQ(reason({{}, Fixed{}, Exactly{}, {{0, {1.5, -0.5, 0}}}}), "HANDLE_BARYCENTRIC");
  EXPECT_EQ(reason({top, Fixed{}, Exactly{}, {{0, {1, 0, 0}}}}), "HANDLE_POINTS_AND_VERTICES");
  EXPECT_EQ(reason({top, Fixed{}, Exactly{}, {}, -1}), "HANDLE_FOOTPRINT_OUT_OF_RANGE");
  EXPECT_EQ(reason({top, Fixed{}, Exactly{}, {}, kNan}), "HANDLE_FOOTPRINT_OUT_OF_RANGE");
  EXPECT_TRUE(handles.handles().empty());
}

TEST_F(HoldTest, RefusesPointsAndRegionsThatAreNotThere) {
  HandleSet handles =
      with({{}, Fixed{}, Exactly{}, {{static_cast<std::int32_t>(bar.faces.rows()), {1, 0, 0}}}});
  auto solver = Deformer::create(shape, {}).value();
  EXPECT_EQ(fault_of(solver->set_handles(handles)).reason, "HANDLE_FACE_OUT_OF_RANGE");
  handles = with({top, Fixed{}});
  handles.set_region({});
  EXPECT_EQ(fault_of(solver->set_handles(handles)).reason, "REGION_EMPTY");
  handles.set_region({0, 100000});
  EXPECT_EQ(fault_of(solver->set_handles(handles)).element, "vertex 100000");
  handles.set_region({-3});
  EXPECT_EQ(fault_of(solver->set_handles(handles)).reason, "REGION_VERTEX_OUT_OF_RANGE");
  EXPECT_EQ(solver->positions(), bar.vertices);
}

TEST_F(HoldTest, RefusesPointsAndLocksThatFollowFromOthersAndNamesBoth) {
  const std::int32_t f = face_at_top();
  const auto reason = [&](const HandleSet& handles) {
    const absl::Status status = Deformer::create(shape, {}).value()->set_handles(handles);
    EXPECT_EQ(fault_of(status).reason, "HANDLE_CONSTRAINTS_DEPENDENT");
    return std::string(status.message());
  };
  HandleSet handles = with({{}, Fixed{}, Exactly{}, {{f, {0.2, 0.3, 0.5}}}});
  ASSERT_TRUE(handles.set("twin", {{}, lifted, Exactly{}, {{f, {0.2, 0.3, 0.5}}}}).ok());
  const std::string twins = reason(handles);
  EXPECT_NE(twins.find("\"twin\""), std::string::npos);
  EXPECT_NE(twins.find("\"top\""), std::string::npos);
  // Four points of one face.
  EXPECT_NE(reason(with({{},
                         Fixed{},
                         Exactly{},
                         {{f, {1, 0, 0}}, {f, {0, 1, 0}}, {f, {0, 0, 1}}, {f, {0.2, 0.3, 0.5}}}}))
                .find("of its own"),
            std::string::npos);
  // A point in a face that is held altogether.
  handles = with({top, Fixed{}});
  ASSERT_TRUE(handles.set("point", {{}, Fixed{}, Exactly{}, {{f, {0.2, 0.3, 0.5}}}}).ok());
  EXPECT_NE(reason(handles).find("\"point\""), std::string::npos);
}

TEST_F(HoldTest, RefusesMoreLocksThanItCanTake) {
  const TriangleMesh plane = grid(40, 40);
  HandleSet handles;
  std::vector<std::int32_t> all(plane.vertices.rows());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::int32_t>(i);
  ASSERT_TRUE(handles.set("all", {all, Fixed{}, PlaneLock{}}).ok());
  EXPECT_EQ(fault_of(Deformer::create(rest_shape(plane), {}).value()->set_handles(handles)),
            (Fault{"TOO_MANY_LOCKS", "handle \"all\"", "equations <= 1024"}));
}

}  // namespace
}  // namespace lpdeform
