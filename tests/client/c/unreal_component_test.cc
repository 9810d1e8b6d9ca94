// The sample for Unreal Engine with a small replacement of the engine (unreal_engine/), against a real server.

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "DynamicMesh/MeshNormals.h"
#include "client/unreal/Source/LpdeformUnreal/Public/LpdeformComponent.h"
#include "tests/client/servers.h"

namespace lpdeform {
namespace {

class UnrealComponent : public testing::Test {
 protected:
  UnrealComponent() {
    unreal_logs.clear();
    address_ = server_.address();
    component_.Address = address_.c_str();
    // A strip in the plane z = 0 that looks up, in metres of 100, with a number that no vertex has.
    UE::Geometry::FDynamicMesh3& mesh = component_.mesh.mesh;
    mesh.AppendVertex({});
    mesh.RemoveVertex(0);
    for (int k = 0; k <= 10; ++k) {
      for (const double y : {0.0, 100.0}) mesh.AppendVertex({100.0 * k, y, 0});
    }
    for (int k = 1; k < 20; k += 2) {
      mesh.AppendTriangle(k, k + 3, k + 2);
      mesh.AppendTriangle(k, k + 1, k + 3);
    }
    UE::Geometry::FMeshNormals::mesh = &mesh;
    hold("base", base_, 0);
    hold("tip", tip_, 1000);
  }

  /// What lies around x on the strip, by a scene component of its own.
  void hold(const char* name, USceneComponent& by, double x) {
    by.transform = {FQuat(), FVector(x, 50, 0)};
    FLpdeformHandle handle;
    handle.Name = name;
    handle.Component.component = &by;
    handle.Radius = 60;
    component_.Handles.Add(handle);
  }

  bool tick_until(const std::function<bool()>& holds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!holds()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // as a game between two frames
      component_.TickComponent(0.016F, LEVELTICK_All, nullptr);
    }
    return true;
  }

  FVector3f normal(int vertex) {
    return component_.mesh.mesh.Attributes()->PrimaryNormals()->GetElement(vertex -
                                                                           1);  // vertices begin with 1
  }

  FVector vertex(int number) const { return component_.mesh.mesh.GetVertex(number); }

  client::InProcessServer server_;
  std::string address_;
  USceneComponent base_, tip_;
  ULpdeformComponent component_;
};

TEST_F(UnrealComponent, FollowsItsHandles) {
  EXPECT_TRUE(component_.PrimaryComponentTick.bCanEverTick);
  component_.BeginPlay();
  EXPECT_TRUE(component_.is_ticking);
  tip_.transform = {FQuat(), FVector(1000, 50, 200)};
  EXPECT_TRUE(tick_until([this] { return vertex(21).Z == 200; }));
  EXPECT_EQ(vertex(1), FVector(0, 0, 0));
  // A quarter turn about x, seen from the component's own place, takes y to z.
  tip_.transform = {FQuat(std::sqrt(0.5), 0, 0, std::sqrt(0.5)), FVector(1000, 50, 200)};
  EXPECT_TRUE(tick_until([this] { return std::abs(vertex(22).Z - 250) < 1e-2; }));
  EXPECT_NEAR(vertex(22).Y, 50, 1e-2);
  EXPECT_NEAR(vertex(21).Z, 150, 1e-2);
  EXPECT_GT(component_.times_drawn, 0);
  EXPECT_TRUE(component_.draws_normals);
  EXPECT_FALSE(component_.draws_colours);
  EXPECT_NEAR(normal(1).Z, 1, 0.1);    // the base looks up still
  EXPECT_NEAR(normal(22).Y, -1, 0.1);  // the tip has turned
  EXPECT_TRUE(unreal_logs.empty());
  component_.EndPlay(EEndPlayReason::Destroyed);
  component_.TickComponent(0.016F, LEVELTICK_All, nullptr);  // the engine may tick once more
}

TEST_F(UnrealComponent, KeepsHardEdgesAndShowsDistortion) {
  // Vertex 1 has a normal of its own in its second triangle, as along a hard edge.
  UE::Geometry::FDynamicMesh3& mesh = component_.mesh.mesh;
  mesh.EnableAttributes();
  UE::Geometry::FDynamicMeshNormalOverlay& normals = *mesh.Attributes()->PrimaryNormals();
  UE::Geometry::FMeshNormals::InitializeOverlayToPerVertexNormals(&normals);
  const int32 other = normals.AppendElement(FVector3f(-1, 0, 0));
  normals.set_parent(other, 1);
  const UE::Geometry::FIndex3i corners = normals.GetTriangle(1);
  normals.SetTriangle(1, {other, corners.B, corners.C});
  component_.bShowDistortion = true;
  component_.BeginPlay();
  tip_.transform = {FQuat(), FVector(1000, 50, 200)};
  EXPECT_TRUE(tick_until([this] { return vertex(21).Z == 200; }));
  EXPECT_NEAR(normal(1).Z, 1, 0.1);
  EXPECT_NEAR(normals.GetElement(other).X, -1, 0.1);
  EXPECT_TRUE(component_.draws_normals);
  EXPECT_TRUE(component_.draws_colours);
  UE::Geometry::FDynamicMeshColorOverlay& colours = *mesh.Attributes()->PrimaryColors();
  ASSERT_EQ(colours.MaxElementID(), normals.MaxElementID());
  for (const int32 triangle : mesh.TriangleIndicesItr()) EXPECT_TRUE(colours.IsSetTriangle(triangle));
  const auto redness = [&](int32 element) {
    return colours.GetElement(element).X - colours.GetElement(element).Z;
  };
  bool is_red = false;
  for (const int32 element : colours.ElementIndicesItr()) is_red = is_red || redness(element) > 0.4F;
  EXPECT_TRUE(is_red);
}

TEST_F(UnrealComponent, SaysThatThereIsNoBetterShapeToTake) {
  EXPECT_FALSE(component_.TakeBetterShape());  // before the game begins
  EXPECT_TRUE(unreal_logs.empty());
  component_.BeginPlay();
  tip_.transform = {FQuat(), FVector(1000, 50, 200)};
  EXPECT_TRUE(tick_until([this] { return vertex(21).Z == 200; }));
  EXPECT_FALSE(component_.TakeBetterShape());
  component_.TickComponent(0.016F, LEVELTICK_All, nullptr);
  ASSERT_EQ(unreal_logs.size(), 1u);
  EXPECT_NE(unreal_logs[0].find("NO_BETTER_SHAPE"), std::string::npos) << unreal_logs[0];
}

TEST_F(UnrealComponent, TellsTheServerHowFarToLook) {
  component_.LeastShare = 1.5;  // refused, so that the log shows what was sent
  component_.BeginPlay();
  EXPECT_TRUE(tick_until([] { return unreal_logs.size() == 1; }));
  EXPECT_NE(unreal_logs[0].find("1.5"), std::string::npos) << unreal_logs[0];
  component_.EndPlay(EEndPlayReason::Destroyed);
  component_.LeastShare = 0.02;
  component_.SearchEffort = 1001;
  component_.BeginPlay();
  EXPECT_TRUE(tick_until([] { return unreal_logs.size() == 2; }));
  EXPECT_NE(unreal_logs[1].find("1001"), std::string::npos) << unreal_logs[1];
}

TEST_F(UnrealComponent, SaysWhatIsRefusedOnceAndRests) {
  component_.mesh.mesh.SetVertex(5, FVector(NAN, 0, 0));
  component_.BeginPlay();
  EXPECT_TRUE(tick_until([this] { return !component_.is_ticking; }));
  ASSERT_EQ(unreal_logs.size(), 1u);
  EXPECT_NE(unreal_logs[0].find("MESH_NOT_FINITE"), std::string::npos) << unreal_logs[0];
  component_.TickComponent(0.016F, LEVELTICK_All, nullptr);
  EXPECT_EQ(unreal_logs.size(), 1u);
  EXPECT_EQ(vertex(21), FVector(1000, 0, 0));  // the mesh stays as it is
}

TEST_F(UnrealComponent, SaysOnceThatNoServerAnswers) {
  component_.Address = "127.0.0.1:1";
  component_.BeginPlay();
  ASSERT_TRUE(tick_until([] { return !unreal_logs.empty(); }));
  EXPECT_NE(unreal_logs[0].find("trying again"), std::string::npos) << unreal_logs[0];
  for (int k = 0; k < 30; ++k) component_.TickComponent(0.016F, LEVELTICK_All, nullptr);
  EXPECT_EQ(unreal_logs.size(), 1u);
}

}  // namespace
}  // namespace lpdeform
