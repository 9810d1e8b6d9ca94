#include "LpdeformComponent.h"

#include "DynamicMesh/DynamicMesh3.h"
#include "DynamicMesh/DynamicMeshAttributeSet.h"
#include "DynamicMesh/MeshNormals.h"

using UE::Geometry::FDynamicMesh3;
using UE::Geometry::FDynamicMeshColorOverlay;
using UE::Geometry::FDynamicMeshNormalOverlay;
using UE::Geometry::FIndex3i;

ULpdeformComponent::ULpdeformComponent() {
  PrimaryComponentTick.bCanEverTick = true;
}

void ULpdeformComponent::BeginPlay() {
  Super::BeginPlay();
  const LpdeformShape Shape = Read();
  try {
    Follower = std::make_unique<LpdeformFollower>(LpdeformServer{TCHAR_TO_UTF8(*Address)}, kUnrealSpace, Shape);
  } catch (const std::exception& Error) {  // LpdeformUnreal.Build.cs enables exceptions
    UE_LOG(LogTemp, Warning, TEXT("lpdeform: %s"), UTF8_TO_TCHAR(Error.what()));
    return;
  }
  Follower->set(P, {bShowBetterShapes, SearchEffort, LeastShare});
  for (FLpdeformHandle& Handle : Handles) Hold(Handle, Shape.positions);
  SetComponentTickEnabled(true);
}

static bool HasNormals(const FDynamicMesh3& Mesh) {
  if (!Mesh.HasAttributes() || Mesh.Attributes()->PrimaryNormals() == nullptr) return false;
  for (const int32 Id : Mesh.TriangleIndicesItr()) {
    if (!Mesh.Attributes()->PrimaryNormals()->IsSetTriangle(Id)) return false;
  }
  return true;
}

/** The mesh as the server needs it. Gives it normals, and colours if they are shown, that it does not have. */
LpdeformShape ULpdeformComponent::Read() {
  LpdeformShape Shape;
  for (TArray<int32>* const Ids : {&ElementIds, &VertexIds, &ColorIds}) Ids->Reset();  // of a play before
  GetDynamicMesh()->EditMesh([&](FDynamicMesh3& Mesh) {
    if (!HasNormals(Mesh)) {
      Mesh.EnableAttributes();
      UE::Geometry::FMeshNormals::InitializeOverlayToPerVertexNormals(Mesh.Attributes()->PrimaryNormals());
    }
    const FDynamicMeshNormalOverlay& Normals = *Mesh.Attributes()->PrimaryNormals();
    FDynamicMeshColorOverlay* Colors = nullptr;
    if (bShowDistortion) {
      Mesh.Attributes()->EnablePrimaryColors();
      Colors = Mesh.Attributes()->PrimaryColors();
      Colors->ClearElements();
    }
    TArray<uint32> Numbers;
    Numbers.SetNumZeroed(Normals.MaxElementID());
    for (const int32 Id : Normals.ElementIndicesItr()) {
      Numbers[Id] = static_cast<uint32>(ElementIds.Add(Id));
      VertexIds.Add(Normals.GetParentVertex(Id));
      const FVector3d At = Mesh.GetVertex(Normals.GetParentVertex(Id));
      for (const double Coordinate : {At.X, At.Y, At.Z}) Shape.positions.push_back(static_cast<float>(Coordinate));
      const FVector3f Normal = Normals.GetElement(Id);
      Shape.normals.insert(Shape.normals.end(), {Normal.X, Normal.Y, Normal.Z});
      if (Colors != nullptr) ColorIds.Add(Colors->AppendElement(FVector4f(0, 0, 1, 1)));
    }
    for (const int32 Id : Mesh.TriangleIndicesItr()) {
      const FIndex3i Corners = Normals.GetTriangle(Id);
      for (const int32 Corner : {Corners.A, Corners.B, Corners.C}) Shape.indices.push_back(Numbers[Corner]);
      if (Colors == nullptr) continue;
      Colors->SetTriangle(Id, FIndex3i(ColorIds[Numbers[Corners.A]], ColorIds[Numbers[Corners.B]], ColorIds[Numbers[Corners.C]]));
    }
  });
  return Shape;
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

bool ULpdeformComponent::TakeBetterShape() {
  return Follower && Follower->take_better_shape();  // the next tick says what was wrong
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
  const std::string Trouble = bIsOver ? "" : Follower->trouble();
  if (!Trouble.empty() && !bWasInTrouble) UE_LOG(LogTemp, Warning, TEXT("lpdeform: %s; trying again"), UTF8_TO_TCHAR(Trouble.c_str()));
  bWasInTrouble = !Trouble.empty();
  const std::string Notice = Follower->notice();
  if (!Notice.empty()) UE_LOG(LogTemp, Log, TEXT("lpdeform: %s"), UTF8_TO_TCHAR(Notice.c_str()));
  if (bIsOver) {  // said once; the mesh stays as it is
    Follower.reset();
    SetComponentTickEnabled(false);
  }
}

void ULpdeformComponent::Show() {
  const std::vector<float>& Positions = Follower->positions();
  const std::vector<float>& Normals = Follower->normals();
  GetDynamicMesh()->EditMesh([&](FDynamicMesh3& Mesh) {
    FDynamicMeshNormalOverlay& Overlay = *Mesh.Attributes()->PrimaryNormals();
    for (int32 Vertex = 0; Vertex < VertexIds.Num(); ++Vertex) {
      const float* const At = &Positions[3 * Vertex];
      Mesh.SetVertex(VertexIds[Vertex], FVector3d(At[0], At[1], At[2]));
      const float* const Normal = &Normals[3 * Vertex];
      Overlay.SetElement(ElementIds[Vertex], FVector3f(Normal[0], Normal[1], Normal[2]));
    }
    for (int32 Vertex = 0; Vertex < ColorIds.Num(); ++Vertex) {
      const uint8* const Color = &Follower->colours()[4 * Vertex];
      Mesh.Attributes()->PrimaryColors()->SetElement(ColorIds[Vertex], FVector4f(Color[0] / 255.f, Color[1] / 255.f, Color[2] / 255.f, 1));
    }
  }, EDynamicMeshChangeType::MeshVertexChange,
     EDynamicMeshAttributeChangeFlags::VertexPositions | EDynamicMeshAttributeChangeFlags::NormalsTangents |
         EDynamicMeshAttributeChangeFlags::VertexColors);
  FastNotifyPositionsUpdated(/* bNormals = */ true, /* bColors = */ ColorIds.Num() > 0);
}
