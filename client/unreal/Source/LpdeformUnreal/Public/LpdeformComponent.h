// A UDynamicMeshComponent that follows handles over an lpdeform server. ../../../README.md says what was tried.
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
class LPDEFORMUNREAL_API ULpdeformComponent : public UDynamicMeshComponent {
  GENERATED_BODY()

 public:
  ULpdeformComponent();

  UPROPERTY(EditAnywhere, Category = "Lpdeform")
  FString Address = TEXT("localhost:8080");
  UPROPERTY(EditAnywhere, Category = "Lpdeform")
  TArray<FLpdeformHandle> Handles;
  /** Counts from the next BeginPlay. Below 2, the server looks for shapes of lower energy while nothing changes. */
  UPROPERTY(EditAnywhere, Category = "Lpdeform", meta = (ClampMin = 1, ClampMax = 64))
  double P = 2;
  /** Show such a shape at once. Otherwise a line of the log says that it is known, and TakeBetterShape shows it. */
  UPROPERTY(EditAnywhere, Category = "Lpdeform")
  bool bShowBetterShapes = false;
  /**
   * How far the server looks for such shapes while nothing changes. Each unit stands for 12 starts; at 0 there are none. At -1 the server
   * decides: 1 where p is below 2, otherwise 0. Counts from the next BeginPlay, as the share does.
   */
  UPROPERTY(EditAnywhere, Category = "Lpdeform", meta = (ClampMin = -1, ClampMax = 1000))
  int32 SearchEffort = -1;
  /** The share of the energy that such a shape must save; 0 is the server's own, 0.02. */
  UPROPERTY(EditAnywhere, Category = "Lpdeform", meta = (ClampMin = 0, ClampMax = 1))
  double LeastShare = 0.02;
  /** Write the distortion to the mesh's colours, from blue (none) to red. Counts from the next BeginPlay. */
  UPROPERTY(EditAnywhere, Category = "Lpdeform")
  bool bShowDistortion = false;

  /**
   * Shows the shape of lower energy that the log has announced. Waits for the server's answer, 30 s at most. False if the component is
   * not live, if there is no such shape, or if the server does not answer; in the last two cases the log says why.
   */
  UFUNCTION(BlueprintCallable, Category = "Lpdeform")
  bool TakeBetterShape();

  void BeginPlay() override;
  void EndPlay(const EEndPlayReason::Type Reason) override;
  void TickComponent(float Seconds, ELevelTick Tick, FActorComponentTickFunction* Function) override;

 private:
  LpdeformShape Read();
  void Hold(FLpdeformHandle& Handle, const std::vector<float>& Positions);
  void Move(FLpdeformHandle& Handle);
  void Show();

  // A vertex of the follower is an element of the mesh's normals: a vertex of the mesh has several where there is a hard edge.
  std::unique_ptr<LpdeformFollower> Follower;
  bool bWasInTrouble = false;  // the log says once that the server cannot be reached
  TArray<int32> ElementIds;    // of the follower's vertices, in the normals
  TArray<int32> VertexIds;     // and in the mesh
  TArray<int32> ColorIds;      // and in the colours, if they are shown
};
