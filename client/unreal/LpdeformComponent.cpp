// See LpdeformComponent.h for what was and was not tried.
#include "LpdeformComponent.h"

#include "DynamicMesh/DynamicMesh3.h"
#include "DynamicMesh/DynamicMeshAttributeSet.h"

using UE::Geometry::FDynamicMesh3;
using UE::Geometry::FIndex3i;

ULpdeformComponent::ULpdeformComponent() {
  PrimaryComponentTick.bCanEverTick = true;
}

void ULpdeformComponent::BeginPlay() {
  Super::BeginPlay();
  VertexIds.Reset();  // of a play before
  LpdeformShape Shape;
  GetDynamicMesh()->ProcessMesh([&](const FDynamicMesh3& Mesh) {
    TArray<uint32> Numbers;
    Numbers.SetNumZeroed(Mesh.MaxVertexID());
    for (const int32 Id : Mesh.VertexIndicesItr()) {
      Numbers[Id] = static_cast<uint32>(VertexIds.Add(Id));
      const FVector3d At = Mesh.GetVertex(Id);
      for (const double Coordinate : {At.X, At.Y, At.Z}) Shape.positions.push_back(static_cast<float>(Coordinate));
    }
    for (const int32 Id : Mesh.TriangleIndicesItr()) {
      const FIndex3i Corners = Mesh.GetTriangle(Id);
      for (const int32 Corner : {Corners.A, Corners.B, Corners.C}) Shape.indices.push_back(Numbers[Corner]);
    }
  });
  try {
    Follower = std::make_unique<LpdeformFollower>(LpdeformServer{TCHAR_TO_UTF8(*Address)}, kUnrealSpace, Shape);
  } catch (const std::exception& Error) {  // needs bEnableExceptions in the module's rules
    UE_LOG(LogTemp, Warning, TEXT("lpdeform: %s"), UTF8_TO_TCHAR(Error.what()));
    return;
  }
  Follower->set(P, bShowBetterShapes);
  for (FLpdeformHandle& Handle : Handles) Hold(Handle, Shape.positions);
  SetComponentTickEnabled(true);
}

void ULpdeformComponent::EndPlay(const EEndPlayReason::Type Reason) {
  Follower.reset();
  Super::EndPlay(Reason);
}

void ULpdeformComponent::Hold(FLpdeformHandle& Handle, const std::vector<float>& Positions) {
  const USceneComponent* const Component = Cast<USceneComponent>(Handle.Component.GetComponent(GetOwner()));
  if (Component == nullptr) return;
  Handle.Start = Component->GetComponentTransform().GetRelativeTransform(GetComponentTransform());
  Handle.Sent = Handle.Start;
  std::vector<uint32_t> Vertices;
  for (size_t Vertex = 0; 3 * Vertex < Positions.size(); ++Vertex) {
    const FVector At(Positions[3 * Vertex], Positions[3 * Vertex + 1], Positions[3 * Vertex + 2]);
    if (FVector::Dist(At, Handle.Start.GetLocation()) < Handle.Radius) Vertices.push_back(static_cast<uint32_t>(Vertex));
  }
  Handle.bHolds = !Vertices.empty() && Follower->hold(TCHAR_TO_UTF8(*Handle.Name.ToString()), Vertices);
}

void ULpdeformComponent::Move(FLpdeformHandle& Handle) {
  const USceneComponent* const Component = Cast<USceneComponent>(Handle.Component.GetComponent(GetOwner()));
  if (Component == nullptr) return;
  const FTransform Here = Component->GetComponentTransform().GetRelativeTransform(GetComponentTransform());
  if (Here.Equals(Handle.Sent, 0)) return;
  // What takes Start to Here: x -> R x + (here - R start).
  const FQuat Turn = Here.GetRotation() * Handle.Start.GetRotation().Inverse();
  const FVector Shift = Here.GetLocation() - Turn.RotateVector(Handle.Start.GetLocation());
  const bool bTaken = Follower->move(TCHAR_TO_UTF8(*Handle.Name.ToString()), {Turn.X, Turn.Y, Turn.Z, Turn.W},
                                     {Shift.X, Shift.Y, Shift.Z});
  if (bTaken) Handle.Sent = Here;
}

/** Once a picture. Nothing here waits for the network. */
void ULpdeformComponent::TickComponent(float Seconds, ELevelTick Tick, FActorComponentTickFunction* Function) {
  Super::TickComponent(Seconds, Tick, Function);
  if (!Follower) return;
  for (FLpdeformHandle& Handle : Handles) {
    if (Handle.bHolds) Move(Handle);
  }
  if (Follower->tick()) Show();
  const bool bIsOver = Follower->is_over();
  const std::string Problem = Follower->problem();
  if (!Problem.empty()) UE_LOG(LogTemp, Warning, TEXT("lpdeform: %s"), UTF8_TO_TCHAR(Problem.c_str()));
  const std::string Notice = Follower->notice();
  if (!Notice.empty()) UE_LOG(LogTemp, Log, TEXT("lpdeform: %s"), UTF8_TO_TCHAR(Notice.c_str()));
  if (bIsOver) {  // said once; the mesh stays as it is
    Follower.reset();
    SetComponentTickEnabled(false);
  }
}

void ULpdeformComponent::Show() {
  const std::vector<float>& Positions = Follower->positions();
  GetDynamicMesh()->EditMesh([&](FDynamicMesh3& Mesh) {
    for (int32 Vertex = 0; Vertex < VertexIds.Num(); ++Vertex) {
      const float* const At = &Positions[3 * Vertex];
      Mesh.SetVertex(VertexIds[Vertex], FVector3d(At[0], At[1], At[2]));
    }
  }, EDynamicMeshChangeType::MeshVertexChange, EDynamicMeshAttributeChangeFlags::VertexPositions);
  FastNotifyPositionsUpdated(/* bNormals = */ false);
}
