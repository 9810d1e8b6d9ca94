// A sample for Unreal Engine 5: a UDynamicMeshComponent that follows handles over an lpdeform server. Put it with
// lpdeform_follower.h into a module that depends on "GeometryFramework" and "GeometryCore", add lpdeform.h's folder to its
// PublicIncludePaths and liblpdeform_client to its PublicAdditionalLibraries.
//
// Compiled and tested here with a little of the engine in its place (tests/client/c/unreal_engine), against a real server; not compiled
// and not run with the engine.
#pragma once

#include <memory>

#include "Components/DynamicMeshComponent.h"
#include "CoreMinimal.h"
#include "lpdeform_follower.h"

#include "LpdeformComponent.generated.h"

/** A scene component that moves vertices with it: those within Radius when the game begins. */
USTRUCT(BlueprintType)
struct FLpdeformHandle {
  GENERATED_BODY()

  UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Lpdeform")
  FName Name;
  UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Lpdeform")
  FComponentReference Component;
  UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Lpdeform", meta = (Units = "cm"))
  float Radius = 10;

  FTransform Start, Sent;
  bool bHolds = false;  // vertices, so that it can be moved
};

UCLASS(ClassGroup = "Lpdeform", meta = (BlueprintSpawnableComponent))
class ULpdeformComponent : public UDynamicMeshComponent {
  GENERATED_BODY()

 public:
  ULpdeformComponent();

  UPROPERTY(EditAnywhere, Category = "Lpdeform")
  FString Address = TEXT("localhost:50051");
  UPROPERTY(EditAnywhere, Category = "Lpdeform")
  TArray<FLpdeformHandle> Handles;
  /** Counts from the next BeginPlay. Below 2, the server looks for shapes of lower energy while nothing changes. */
  UPROPERTY(EditAnywhere, Category = "Lpdeform", meta = (ClampMin = 1, ClampMax = 64))
  double P = 2;
  /** Show such a shape at once. Otherwise a line of the log says that it is known. */
  UPROPERTY(EditAnywhere, Category = "Lpdeform")
  bool bShowBetterShapes = false;

  void BeginPlay() override;
  void EndPlay(const EEndPlayReason::Type Reason) override;
  void TickComponent(float Seconds, ELevelTick Tick, FActorComponentTickFunction* Function) override;

 private:
  void Hold(FLpdeformHandle& Handle, const std::vector<float>& Positions);
  void Move(FLpdeformHandle& Handle);
  void Show();

  std::unique_ptr<LpdeformFollower> Follower;
  TArray<int32> VertexIds;  // of the follower's vertices, in the dynamic mesh
};
